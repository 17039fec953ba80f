"""Leaves, flowers and stems as meshes, grown from seeds; local +y is the way a part grows."""

import numpy as np

import mesh

GOLDEN_ANGLE = 137.50776


def placed(part, position, direction, roll_degrees=0.0):
    """`part` with its +y turned to `direction`, its origin moved to `position`."""
    up = mesh.unit(np.asarray(direction, dtype=float))
    axis = np.cross([0.0, 1.0, 0.0], up)
    angle = np.degrees(np.arctan2(np.linalg.norm(axis), up[1]))
    part = part.rotated("y", roll_degrees)
    if np.linalg.norm(axis) > 1e-9:
        part = part.rotated(axis, angle)
    elif up[1] < 0.0:
        part = part.rotated("x", 180.0)
    return part.moved(*position)


def blade(half_width, length, fold, bend_degrees, nu, nv, wave=0.0):
    """A leaf: `half_width(v)` about a midrib that bends by `bend_degrees` from base to tip.

    `fold` lifts the edges; +z is the upper side. u runs across, v from base to tip.
    """

    def point(u, v):
        across = (2.0 * u - 1.0) * half_width(np.clip(v, 0.0, 1.0))
        bend = np.radians(bend_degrees)
        radius = length / bend if abs(bend) > 1e-6 else 1e6
        angle = v * length / radius
        lift = (
            fold * np.abs(across)
            + wave * np.sin(14.0 * v) * (across / (length + 1e-9)) ** 2 * length
        )
        y = (radius + lift) * np.sin(angle)
        z = (radius + lift) * np.cos(angle) - radius
        return np.stack([across, y, z], -1)

    return mesh.surface(point, nu, nv)


def oval_leaf(length, width, fold=0.35, bend_degrees=40.0, nu=6, nv=8, wave=0.0):
    return blade(
        lambda v: 0.5 * width * np.sin(np.pi * v**0.75) ** 0.8 + 1e-5,
        length,
        fold,
        bend_degrees,
        nu,
        nv,
        wave,
    )


def ivy_leaf(size, fold=0.25, bend_degrees=35.0):
    """Five-lobed leaf as a fan about the midrib; uv is its bounding square."""
    outline = np.array(
        [
            (0.0, 0.0),
            (-0.20, -0.10),
            (-0.46, 0.02),
            (-0.34, 0.20),
            (-0.62, 0.44),
            (-0.30, 0.50),
            (-0.24, 0.66),
            (0.0, 1.0),
            (0.24, 0.66),
            (0.30, 0.50),
            (0.62, 0.44),
            (0.34, 0.20),
            (0.46, 0.02),
            (0.20, -0.10),
        ]
    )
    rib = np.array([(0.0, 0.18), (0.0, 0.42), (0.0, 0.68)])
    flat = np.concatenate([outline, rib])
    a, b, c = 14, 15, 16
    fans = [
        (0, a, 1),
        (1, a, 2),
        (2, a, 3),
        (3, a, b),
        (3, b, 4),
        (4, b, 5),
        (5, b, 6),
        (6, b, c),
        (6, c, 7),
    ]
    mirror = {
        0: 0,
        7: 7,
        a: a,
        b: b,
        c: c,
        **{k: 14 - k for k in range(1, 7)},
        **{k: 14 - k for k in range(8, 14)},
    }
    triangles = fans + [tuple(mirror[k] for k in reversed(t)) for t in fans]
    bend = np.radians(bend_degrees)
    x, y = flat[:, 0] * size, flat[:, 1] * size
    radius = size / bend
    lift = fold * np.abs(x)
    positions = np.stack(
        [x, (radius + lift) * np.sin(y / radius), (radius + lift) * np.cos(y / radius) - radius], -1
    )
    normals = np.stack([-0.7 * fold * np.sign(x), np.sin(y / radius), np.cos(y / radius)], -1)
    uv = np.stack([0.5 + flat[:, 0] / 1.3, (flat[:, 1] + 0.1) / 1.1], -1)
    return mesh.Mesh(positions, mesh.unit(normals), uv, np.array(triangles))


def rose(radius, seed, petals=24, openness=1.0, nu=8, nv=8):
    """Double flower. u is how far out a petal stands (inner 0, outer 1), v its height."""
    random = np.random.RandomState(seed)
    parts = []
    for k in range(petals):
        out = (k + 0.5) / petals
        parts.append(
            rose_petal(radius, out, openness, random, nu, nv).rotated(
                "y", k * GOLDEN_ANGLE + random.uniform(-8, 8)
            )
        )
    return mesh.merged(parts)


def rose_petal(radius, out, openness, random, nu, nv):
    length = radius * (0.75 + 0.45 * out) * random.uniform(0.92, 1.08)
    tip_angle = np.radians(-38.0 + 118.0 * openness * out**1.3 + random.uniform(-7, 7))
    base_angle = np.radians(18.0 + 62.0 * openness * out)
    start = radius * 0.02 + radius * 0.10 * out
    span = (1.5 - 0.55 * out) * random.uniform(0.9, 1.1)
    phase, ruffle = random.uniform(0, 6.3), radius * 0.025 * (0.3 + out)

    def point(u, v):
        side = 2.0 * u - 1.0
        reach = np.clip(v, 0.0, 1.0) * (1.0 - 0.22 * side**4)
        t = np.linspace(0.0, 1.0, 65)
        lean = base_angle + (tip_angle - base_angle) * t**1.6 + np.radians(34.0 * out) * t**10
        step = length / 64.0
        across = start + np.concatenate([[0.0], np.cumsum(np.sin(lean[:-1]) * step)])
        up = np.concatenate([[0.0], np.cumsum(np.cos(lean[:-1]) * step)])
        r = np.interp(reach, t, across) * (1.0 + 0.10 * side**2 * out)
        y = np.interp(reach, t, up) - 0.10 * radius * side**2 * reach * out
        y = y + ruffle * reach**3 * np.sin(4.0 * side + phase)
        azimuth = side * span * np.sin(np.pi * (0.20 + 0.55 * reach)) * 0.9
        r = np.maximum(r, 0.02 * radius)
        return np.stack([r * np.sin(azimuth), y, r * np.cos(azimuth)], -1)

    petal = mesh.surface(point, nu, nv)
    uv = np.stack([np.full(len(petal.uv), 0.02 + 0.96 * out), petal.uv[:, 1]], -1)
    return mesh.Mesh(petal.positions, petal.normals, uv, petal.triangles)


def daisy(radius, seed, petals=15, nu=2, nv=5):
    """Ray petals only; `daisy_heart` is the middle. v runs outwards."""
    random = np.random.RandomState(seed)
    parts = []
    for k in range(petals):
        length = radius * random.uniform(0.72, 0.82)
        width = 2.9 * radius / petals * random.uniform(0.95, 1.2)
        petal = blade(
            lambda v: 0.5 * width * np.sin(np.pi * (0.12 + 0.80 * v)) ** 0.6,
            length,
            0.2,
            random.uniform(10, 45),
            nu,
            nv,
        )
        petal = petal.rotated("x", random.uniform(2, 20) - 90.0).moved(z=-0.22 * radius)
        parts.append(petal.rotated("y", 360.0 * k / petals + random.uniform(-7, 7)))
    return mesh.merged(parts)


def daisy_heart(radius, nu=14, nv=6):
    r, h = 0.30 * radius, 0.16 * radius
    return mesh.revolution(
        [(r, -0.3 * h), (0.95 * r, 0.35 * h), (0.6 * r, 0.85 * h), (0.0005 * r, h)], nu, nv
    )


def five_petals(radius, seed, nu=4, nv=5):
    """Open flower of five broad petals; v runs outwards."""
    random = np.random.RandomState(seed)
    parts = []
    for k in range(5):
        length = radius * random.uniform(0.92, 1.05)
        petal = blade(
            lambda v: 0.62 * radius * np.sin(np.pi * (0.06 + 0.78 * v)) ** 0.9,
            length,
            0.15,
            random.uniform(15, 40),
            nu,
            nv,
            wave=0.6,
        )
        petal = petal.rotated("x", random.uniform(15, 32) - 90.0)
        parts.append(petal.rotated("y", 72.0 * k + random.uniform(-6, 6)))
    return mesh.merged(parts)


def stem(points, radius, sides=8, steps=16):
    return mesh.tube(np.asarray(points, dtype=float), radius, sides, steps)


def on_sphere(count, seed, lowest=-1.0):
    """Spread directions: a spherical Fibonacci lattice down to height `lowest`, a little shaken."""
    random = np.random.RandomState(seed)
    k = np.arange(count) + 0.5
    y = 1.0 - (1.0 - lowest) * k / count
    angle = np.radians(GOLDEN_ANGLE) * k
    r = np.sqrt(np.maximum(0.0, 1.0 - y * y))
    shaken = np.stack([r * np.cos(angle), y, r * np.sin(angle)], -1)
    return mesh.unit(shaken + 0.25 * random.uniform(-1, 1, (count, 3)))
