"""Table, runner, vase, shell and fruit of the still life, in metres."""

import numpy as np

import mesh
import pattern
from mesh import merged, revolution, tube

TABLE = -0.19  # height of the table's top
TABLE_X, TABLE_Z = (-1.05, 1.05), (-2.95, -0.45)
CLOTH = {"centre": (-0.10, -1.98), "size": (1.10, 0.66), "turn": -9.0, "thickness": 0.002}

# Footprints that darken table and cloth: (x, z, radius, height of the middle above the table).
OCCLUDERS = [
    (0.08, -2.06, 0.066, 0.03),
    (0.08, -2.06, 0.12, 0.16),
    (0.08, -2.06, 0.17, 0.45),
    (-0.34, -1.92, 0.085, 0.085),
    (-0.29, -1.90, 0.05, 0.045),
    (-0.235, -0.98, 0.036, 0.036),
    (0.345, -1.93, 0.040, 0.038),
    (0.435, -2.08, 0.040, 0.038),
    (0.285, -2.13, 0.038, 0.038),
    (-0.66, -2.58, 0.07, 0.02),
    (-0.66, -2.58, 0.13, 0.09),
    (0.50, -2.56, 0.055, 0.012),
    (0.50, -2.56, 0.03, 0.10),
    (-0.155, -1.16, 0.030, 0.028),
    (-0.13, -1.81, 0.05, 0.025),
    (-0.06, -1.79, 0.035, 0.02),
]
BOOKS = {"centre": (0.365, -1.42), "turn": 24.0, "size": (0.21, 0.145), "thickness": (0.034, 0.026)}


def cloth_frame(x, z):
    """Place on the runner: s along, t across, both in [0, 1] on it."""
    turn = np.radians(CLOTH["turn"])
    dx, dz = x - CLOTH["centre"][0], z - CLOTH["centre"][1]
    along = np.cos(turn) * dx - np.sin(turn) * dz
    across = np.sin(turn) * dx + np.cos(turn) * dz
    return along / CLOTH["size"][0] + 0.5, 0.5 - across / CLOTH["size"][1]


def cloth_place(s, t):
    turn = np.radians(CLOTH["turn"])
    along, across = (s - 0.5) * CLOTH["size"][0], (0.5 - t) * CLOTH["size"][1]
    x = CLOTH["centre"][0] + np.cos(turn) * along + np.sin(turn) * across
    return x, CLOTH["centre"][1] - np.sin(turn) * along + np.cos(turn) * across


def cloth_height(x, z):
    """Folds of the runner above the table; it lies flat under what stands on it."""
    s, t = cloth_frame(x, z)
    fold = 0.5 + 0.5 * pattern.noise(s * 5.2 + 0.9 * t, t * 1.7 + 2.0, seed=7)
    ridge = np.exp(-(((s - 0.16 - 0.12 * t) / 0.020) ** 2)) + 0.8 * np.exp(
        -(((s - 0.86 + 0.10 * t) / 0.024) ** 2)
    )
    height = 0.010 * pattern.smoothstep(0.55, 0.95, fold) + 0.011 * ridge
    for ox, oz, radius, middle in OCCLUDERS:
        if middle < 0.1:
            height = height * pattern.smoothstep(
                radius * 0.9, radius + 0.07, np.hypot(x - ox, z - oz)
            )
    return CLOTH["thickness"] + height


def openness(x, z):
    """Share of the sky that a place on the table sees past the spheres on it.

    A sphere of radius r, its middle at height h, hides r^2 h / (d^2 + h^2)^1.5 of the sky from a
    place at distance d (cosine-weighted, sphere wholly above the plane).
    """
    seen = np.ones_like(x)
    for ox, oz, radius, middle in OCCLUDERS:
        middle = max(middle, radius)
        seen = seen * (
            1.0
            - np.minimum(
                0.9, radius**2 * middle / ((x - ox) ** 2 + (z - oz) ** 2 + middle**2) ** 1.5
            )
        )
    turn = np.radians(BOOKS["turn"])
    dx, dz = x - BOOKS["centre"][0], z - BOOKS["centre"][1]
    a = np.abs(np.cos(turn) * dx - np.sin(turn) * dz) - BOOKS["size"][0] / 2
    b = np.abs(np.sin(turn) * dx + np.cos(turn) * dz) - BOOKS["size"][1] / 2
    gap = np.hypot(np.maximum(a, 0), np.maximum(b, 0))
    return seen * (1.0 - 0.5 * np.exp(-gap / 0.03))


def shaded_table(wood):
    u, v = pattern.uv_grid(512, 512)
    x = TABLE_X[0] + u * (TABLE_X[1] - TABLE_X[0])
    z = TABLE_Z[1] + v * (TABLE_Z[0] - TABLE_Z[1])
    s, t = cloth_frame(x, z)
    rim = np.maximum(
        np.abs(s - 0.5) * CLOTH["size"][0] - CLOTH["size"][0] / 2,
        np.abs(t - 0.5) * CLOTH["size"][1] - CLOTH["size"][1] / 2,
    )
    small = wood.reshape(512, wood.shape[0] // 512, 512, wood.shape[1] // 512, 3).mean(axis=(1, 3))
    return (
        small
        * pattern.srgb_from_linear(
            openness(x, z) * (1 - 0.4 * np.exp(-np.maximum(rim, 0) / 0.012))
        )[..., None]
    )


def shaded_cloth(linen):
    u, v = pattern.uv_grid(512, 512)
    x, z = cloth_place(u, v)
    small = linen.reshape(512, linen.shape[0] // 512, 512, linen.shape[1] // 512, 3).mean(
        axis=(1, 3)
    )
    return small * pattern.srgb_from_linear(openness(x, z))[..., None]


def runner():
    def point(s, t):
        x, z = cloth_place(s, t)
        rim = pattern.smoothstep(
            0.0, 0.012, np.minimum(np.minimum(s, 1 - s), np.minimum(t, 1 - t) * 0.6)
        )
        return np.stack([x, TABLE + 0.0004 + cloth_height(x, z) * (0.25 + 0.75 * rim), z], -1)

    body = mesh.surface(point, 112, 56)
    random = np.random.RandomState(9)
    fringe = []
    for end, out in ((0.0, -1.0), (1.0, 1.0)):
        for t in np.linspace(0.006, 0.994, 66):
            s0, s1 = end, end + out * random.uniform(0.020, 0.028)
            x, z = cloth_place(
                np.array([s0, 0.5 * (s0 + s1), s1]),
                t + np.array([0, 0, random.uniform(-0.012, 0.012)]),
            )
            y = TABLE + np.array([0.0016, 0.0022, 0.0012])
            thread = tube(np.stack([x, y, z], -1), 0.0011, 4, 2)
            fringe.append(thread.mapped_uv((0.0, 0.0), (0.03, 0.5)))
    return merged([body] + fringe)


def vase():
    profile = [
        (0.004, 0.004),
        (0.048, 0.003),
        (0.052, 0.0),
        (0.055, 0.006),
        (0.049, 0.018),
        (0.046, 0.028),
        (0.062, 0.050),
        (0.088, 0.085),
        (0.103, 0.125),
        (0.102, 0.160),
        (0.080, 0.198),
        (0.050, 0.222),
        (0.041, 0.245),
        (0.045, 0.268),
        (0.058, 0.284),
        (0.061, 0.288),
        (0.058, 0.290),
        (0.041, 0.270),
        (0.034, 0.245),
        (0.040, 0.220),
        (0.060, 0.195),
    ]
    return revolution(profile, 96, 72)


def vase_handles():
    parts = []
    for side in (1, -1):
        path = np.array(
            [
                [0.040, 0.252, 0],
                [0.072, 0.268, 0],
                [0.107, 0.252, 0],
                [0.118, 0.215, 0],
                [0.100, 0.176, 0],
                [0.088, 0.168, 0],
            ]
        )
        handle = tube(path, lambda s: 0.0085 - 0.003 * np.sin(np.pi * s), 16, 28)
        scroll = tube(
            np.array([[0.106, 0.255, 0], [0.120, 0.268, 0], [0.122, 0.282, 0], [0.113, 0.286, 0]]),
            lambda s: 0.005 * (1 - 0.7 * s),
            10,
            10,
        )
        parts += [part.rotated("y", 0 if side > 0 else 180) for part in (handle, scroll)]
    return merged(parts).mapped_uv((0.02, 0.01), (0.0, 0.528))


def nautilus():
    """Logarithmic spiral, each whorl three times the last; the open chamber is lined apart."""
    growth, turns = np.log(3.0) / (2 * np.pi), 2.62

    def tube_point(size, bulge):
        def point(u, v):
            angle = 2 * np.pi * turns * (v - 1.0)
            radius = 0.118 * np.exp(growth * angle)
            phi = 2 * np.pi * (u - 0.5)
            middle, half = radius * 0.585, radius * 0.415
            reach = middle + half * size * np.cos(phi)
            side = radius * 0.40 * size * np.sin(phi) * (1.0 + bulge * np.cos(phi))
            return np.stack([reach * np.cos(angle), reach * np.sin(angle), side], -1)

        return point

    outside = mesh.surface(tube_point(1.0, -0.12), 40, 150)
    lining = mesh.surface(tube_point(0.955, -0.12), 48, 36, flip=True, v_range=(0.86, 1.0))
    lip = mesh.surface(
        lambda u, v: (1 - v)[..., None] * tube_point(0.955, -0.12)(u, np.ones_like(u))
        + v[..., None] * tube_point(1.0, -0.12)(u, np.ones_like(u)),
        48,
        1,
    )
    wall_u, wall_r = np.meshgrid(np.linspace(0, 1, 49), np.linspace(0, 1, 9))
    rim = tube_point(0.955, -0.12)(wall_u, np.full_like(wall_u, 0.862))
    core = rim.reshape(-1, 3)[:49].mean(axis=0)
    septum_points = core + (rim - core) * wall_r[..., None]
    septum = mesh.Mesh(
        septum_points.reshape(-1, 3),
        np.tile([0.0, 1.0, 0.0], (49 * 9, 1)),
        np.stack([wall_u, wall_r], -1).reshape(-1, 2),
        mesh.grid_triangles(48, 8),
    )
    direction = np.cross(septum_points[8, 10] - core, septum_points[8, 20] - core)
    septum.normals[:] = mesh.unit(direction)
    septum = mesh.without_slivers(
        mesh.Mesh(septum.positions, septum.normals, septum.uv, septum.triangles[:, ::-1])
    )
    pose = lambda part: part.scaled(1.2).rotated("z", -52).rotated("x", -8).rotated("y", -34)
    return pose(outside), pose(merged([lining, lip, septum]))


def standing(part, x, z, height=TABLE):
    """`part` moved so that its lowest point rests on `height`."""
    return part.moved(x, height - part.positions[:, 1].min(), z)


def apple_body():
    profile = [
        (0.0006, 0.009),
        (0.006, 0.006),
        (0.015, 0.001),
        (0.022, 0.0),
        (0.033, 0.010),
        (0.0405, 0.032),
        (0.0385, 0.052),
        (0.030, 0.066),
        (0.018, 0.071),
        (0.009, 0.067),
        (0.004, 0.058),
        (0.0006, 0.054),
    ]

    def lobes(p, u, v):
        five = 1.0 + 0.035 * np.cos(10 * np.pi * u)[..., None] * (
            1.0 - p[..., 1:2] / 0.07
        ) * np.array([1, 0, 1])
        return p * (five + 0.02 * np.sin(2 * np.pi * u + 1.0)[..., None] * np.array([1, 0, 1]))

    return revolution(profile, 40, 28, lobes)


def pear_body():
    profile = [
        (0.0006, 0.006),
        (0.008, 0.003),
        (0.017, 0.0),
        (0.029, 0.009),
        (0.0375, 0.030),
        (0.034, 0.052),
        (0.0225, 0.074),
        (0.0155, 0.092),
        (0.011, 0.102),
        (0.004, 0.105),
        (0.0006, 0.103),
    ]

    def lean(p, u, v):
        h = np.maximum(p[..., 1], 0.0) / 0.105
        return p + np.stack([0.012 * h**2.5, 0 * h, 0.004 * h**2], -1)

    return revolution(profile, 40, 32, lean)


def fruit_stem(height, length, lean):
    return tube(
        np.array(
            [
                [0, height - 0.012, 0],
                [0.0005, height, 0],
                [lean * 0.4, height + 0.6 * length, 0.001],
                [lean, height + length, 0.002],
            ]
        ),
        lambda s: 0.0013 + 0.0009 * s**3,
        8,
        10,
    )


def lemon():
    profile = [
        (0.0006, -0.002),
        (0.005, 0.0),
        (0.010, 0.006),
        (0.024, 0.018),
        (0.0285, 0.036),
        (0.024, 0.054),
        (0.011, 0.066),
        (0.006, 0.073),
        (0.0006, 0.075),
    ]
    return revolution(profile, 40, 32).rotated("z", 90)
