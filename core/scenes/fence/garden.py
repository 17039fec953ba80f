"""Meshes of the garden: wall with its arch, plants on it, pots, trees."""

import numpy as np

import mesh
import plants
from mesh import merged, revolution, rounded_box

WALL = -2.12  # front of the brick wall
WALL_X, WALL_Y = (-1.10, 1.10), (-0.62, 0.72)
LEDGE = -0.31  # top of the stone ledge before the wall
ARCH = {"centre": 0.36, "half": 0.215, "spring": 0.10, "depth": 0.22}


def brick_uv(x, y):
    return np.stack(
        [(x - WALL_X[0]) / (WALL_X[1] - WALL_X[0]), (y - WALL_Y[0]) / (WALL_Y[1] - WALL_Y[0])], -1
    )


def arch_edge(count=40):
    """Outline of the opening from its lower left over the crown to its lower right."""
    angle = np.linspace(np.pi, 0.0, count)
    crown = np.stack(
        [
            ARCH["centre"] + ARCH["half"] * np.cos(angle),
            ARCH["spring"] + ARCH["half"] * np.sin(angle),
        ],
        -1,
    )
    left, right = ARCH["centre"] - ARCH["half"], ARCH["centre"] + ARCH["half"]
    return np.concatenate([[[left, WALL_Y[0]]], crown, [[right, WALL_Y[0]]]])


def wall_front():
    """Brickwork around the arch: two flanks and the spandrel strips up to the top."""
    parts = []

    def panel(x0, x1, y0, y1):
        xy = np.array([[x0, y0], [x1, y0], [x1, y1], [x0, y1]])
        parts.append(flat(xy, np.array([[0, 1, 2], [0, 2, 3]])))

    def flat(xy, triangles):
        positions = np.concatenate([xy, np.full((len(xy), 1), WALL)], axis=1)
        return mesh.Mesh(
            positions,
            np.tile([0.0, 0.0, 1.0], (len(xy), 1)),
            brick_uv(xy[:, 0], xy[:, 1]),
            triangles,
        )

    outer = arch_edge()
    panel(WALL_X[0], outer[0, 0], *WALL_Y)
    panel(outer[-1, 0], WALL_X[1], *WALL_Y)
    crown = outer[1:-1]
    top = np.stack([crown[:, 0], np.full(len(crown), WALL_Y[1])], -1)
    k = np.arange(len(crown) - 1)
    n = len(crown)
    triangles = np.concatenate(
        [np.stack([k, k + 1, k + n + 1], -1), np.stack([k, k + n + 1, k + n], -1)]
    )
    parts.append(flat(np.concatenate([crown, top]), triangles))
    return merged(parts)


def arch_soffit():
    """Inside of the opening, and a ring of voussoirs standing 12 mm proud of the wall."""
    edge = arch_edge()
    length = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(edge, axis=0), axis=1))])
    back = WALL - ARCH["depth"]
    positions = np.concatenate(
        [np.c_[edge, np.full(len(edge), WALL)], np.c_[edge, np.full(len(edge), back)]]
    )
    inward = np.stack(
        [
            np.r_[1.0, ARCH["centre"] - edge[1:-1, 0], -1.0],
            np.r_[0.0, (ARCH["spring"] - edge[1:-1, 1]).clip(max=0), 0.0],
            np.zeros(len(edge)),
        ],
        -1,
    )
    normals = mesh.unit(np.concatenate([inward, inward]))
    uv = np.concatenate(
        [
            np.stack([np.zeros(len(edge)), length / 0.6], -1),
            np.stack([np.full(len(edge), ARCH["depth"] / 0.6), length / 0.6], -1),
        ]
    )
    n, k = len(edge), np.arange(len(edge) - 1)
    triangles = np.concatenate(
        [np.stack([k, k + n, k + n + 1], -1), np.stack([k, k + n + 1, k + 1], -1)]
    )
    soffit = mesh.Mesh(positions, normals, uv, triangles)
    stones = []
    random = np.random.RandomState(4)
    count = 13
    for j in range(count):
        angle = 180.0 * (j + 0.5) / count
        keystone = j == count // 2
        size = (
            np.pi * (ARCH["half"] + 0.035) / count - 0.005,
            0.075 if not keystone else 0.105,
            0.05,
        )
        stone = rounded_box(size, 0.004, 0.35).mapped_uv(offset=tuple(random.uniform(0, 1, 2)))
        stone = stone.moved(y=ARCH["half"] + (0.042 if not keystone else 0.052)).rotated(
            "z", 90.0 - angle
        )
        stones.append(
            stone.moved(ARCH["centre"], ARCH["spring"], WALL - 0.008 + (0.006 if keystone else 0.0))
        )
    for side in (-1, 1):
        for j in range(5):
            block = rounded_box((0.072 if j % 2 else 0.092, 0.078, 0.05), 0.004, 0.35).mapped_uv(
                offset=tuple(random.uniform(0, 1, 2))
            )
            stones.append(
                block.moved(
                    ARCH["centre"] + side * (ARCH["half"] + (0.036 if j % 2 else 0.046)),
                    ARCH["spring"] - 0.042 - 0.083 * j,
                    WALL - 0.008,
                )
            )
    return merged([soffit] + stones)


def ledge_and_coping():
    parts = []
    for k in range(5):
        parts.append(
            rounded_box((0.44, 0.07, 0.30), 0.008, 0.5)
            .mapped_uv(offset=(0.37 * k, 0.2 * k))
            .moved(-0.90 + 0.446 * k, LEDGE - 0.035, WALL + 0.15)
        )
    for k in range(5):
        parts.append(
            rounded_box((0.44, 0.6, 0.26), 0.006, 0.5)
            .mapped_uv(offset=(0.21 * k, 0.6))
            .moved(-0.90 + 0.446 * k, LEDGE - 0.38, WALL + 0.15)
        )
    return merged(parts)


def climbing_ivy():
    """Runners that climb the wall and branch; leaves turn to the light. Returns leaves, stems."""
    random = np.random.RandomState(8)
    leaves, stems = [], []

    def runner(start, heading, length, thickness, depth):
        points = [np.array(start)]
        direction = np.array(heading, dtype=float)
        steps = max(4, int(length / 0.045))
        for _ in range(steps):
            direction = mesh.unit(direction + random.normal(0, 0.22, 2) + [0.0, 0.05])
            step = points[-1] + 0.045 * direction
            in_arch = abs(step[0] - ARCH["centre"]) < ARCH["half"] + 0.01 and step[1] < ARCH[
                "spring"
            ] + np.sqrt(max(0.0, (ARCH["half"] + 0.01) ** 2 - (step[0] - ARCH["centre"]) ** 2))
            if in_arch:
                direction = np.array(
                    [step[0] - ARCH["centre"], abs(step[1] - ARCH["spring"]) + 0.2]
                )
                continue
            points.append(step)
        if len(points) < 3:
            return
        path = np.array([[p[0], p[1], WALL + 0.008 + 0.004 * random.uniform()] for p in points])
        stems.append(plants.stem(path, lambda s: thickness * (1.1 - 0.7 * s), 4, len(points)))
        for p in path[1:]:
            for _ in range(2 if depth else 3):
                size = random.uniform(0.026, 0.056) * (1.0 if depth < 2 else 0.8)
                away = np.array(
                    [random.normal(0, 0.028), random.normal(0, 0.028), random.uniform(0.010, 0.042)]
                )
                hang = mesh.unit(
                    np.array([random.normal(0, 0.55), -0.9 + random.normal(0, 0.45), 0.35])
                )
                leaves.append(
                    facing_leaf(
                        plants.ivy_leaf(size, 0.22, random.uniform(15, 55)), p + away, hang, random
                    )
                )
        if depth < 2:
            for p in path[2::3]:
                turn = random.choice([-1, 1]) * random.uniform(0.6, 1.3)
                c, s = np.cos(turn), np.sin(turn)
                way = np.array([[c, -s], [s, c]]) @ direction
                runner(p[:2], way, length * random.uniform(0.25, 0.45), thickness * 0.6, depth + 1)

    runner((-0.98, -0.30), (0.15, 1.0), 1.15, 0.0070, 0)
    runner((-0.62, -0.30), (-0.1, 1.0), 0.80, 0.0060, 0)
    runner((-0.80, 0.30), (1.0, 0.25), 1.10, 0.0050, 0)
    runner((0.92, -0.30), (-0.05, 1.0), 0.85, 0.0060, 0)
    return merged(leaves), merged(stems)


def facing_leaf(leaf, place, along, random):
    """Leaf whose tip points along `along` and whose upper side looks out of the wall."""
    outward = mesh.unit(np.array([-0.25, 0.35, 1.0]) + random.normal(0, 0.25, 3))
    y = mesh.unit(np.asarray(along, dtype=float))
    z = mesh.unit(outward - y * np.dot(outward, y))
    turn = np.stack([np.cross(y, z), y, z], -1)
    return mesh.Mesh(
        leaf.positions @ turn.T + place, leaf.normals @ turn.T, leaf.uv, leaf.triangles
    )


def rambler():
    """A climbing rose by the arch: canes, leaves, flowers in two colours of opening."""
    random = np.random.RandomState(14)
    parts = {"rose": [], "leaf": [], "stem": []}
    canes = [
        [(0.70, -0.31), (0.69, -0.05), (0.66, 0.18), (0.58, 0.34), (0.42, 0.44), (0.24, 0.46)],
        [(0.72, -0.31), (0.74, 0.0), (0.72, 0.24), (0.66, 0.42), (0.56, 0.56)],
        [(0.69, -0.31), (0.66, -0.12), (0.68, 0.06), (0.76, 0.20), (0.84, 0.38)],
        [(0.66, 0.18), (0.56, 0.40), (0.34, 0.53), (0.10, 0.50), (-0.06, 0.42)],
    ]
    for cane in canes:
        path = mesh.curve(
            np.array([[x, y, WALL + 0.03 + 0.015 * np.sin(9 * y + 5 * x)] for x, y in cane])
        )
        parts["stem"].append(
            plants.stem(path(np.linspace(0, 1, 15)), lambda s: 0.0050 - 0.0028 * s, 6, 40)
        )
        for s in np.linspace(0.06, 1.0, int(26 * len(cane) / 5)):
            here = path(np.array([s]))[0]
            for _ in range(3):
                out = np.array(
                    [random.normal(0, 0.9), random.normal(-0.1, 0.8), random.uniform(0.1, 0.7)]
                )
                leaf = plants.oval_leaf(
                    random.uniform(0.034, 0.056), 0.026, 0.3, random.uniform(15, 60), 4, 6
                )
                parts["leaf"].append(facing_leaf(leaf, here + 0.012 * mesh.unit(out), out, random))
        for s in np.linspace(0.18, 0.98, 8):
            here = path(np.array([s]))[0]
            out = mesh.unit([random.normal(-0.1, 0.45), random.normal(0.15, 0.4), 1.0])
            radius = random.uniform(0.020, 0.036)
            flower = plants.rose(radius, random.randint(1000), 14, random.uniform(0.75, 1.1), 5, 5)
            place = (
                here
                + 0.020 * out
                + np.array([random.normal(0, 0.025), random.normal(0, 0.025), 0.018])
            )
            parts["rose"].append(plants.placed(flower, place, out, random.uniform(0, 360)))
    return {name: merged(items) for name, items in parts.items()}


def pot(height):
    """Flower pot with a rolled rim, and its soil."""
    h, r = height, 0.44 * height
    profile = [
        (0.62 * r, 0.0),
        (0.66 * r, 0.02 * h),
        (0.92 * r, 0.80 * h),
        (0.93 * r, 0.81 * h),
        (1.03 * r, 0.83 * h),
        (1.06 * r, 0.90 * h),
        (1.04 * r, 0.98 * h),
        (1.0 * r, 1.0 * h),
        (0.95 * r, 0.98 * h),
        (0.90 * r, 0.80 * h),
    ]
    return revolution(profile, 48, 36), mesh.disc((0, 0.88 * h, 0), (0, 1, 0), 0.93 * r, 32)


def potted(kind, place, height, seed):
    """Leaves and flowers growing from a pot at `place`: lists by material."""
    random = np.random.RandomState(seed)
    base = np.array([place[0], LEDGE + 0.88 * height, place[1]])
    r = 0.40 * height
    parts = {"leaf": [], "stem": [], "flower": [], "heart": []}
    if kind == "daisies":
        for _ in range(22):
            lean = np.array([random.normal(0, 0.45), 1.0, random.normal(0.12, 0.4)])
            foot = base + np.array(
                [random.uniform(-0.6, 0.6) * r, 0, random.uniform(-0.6, 0.6) * r]
            )
            tip = foot + mesh.unit(lean) * random.uniform(0.09, 0.21)
            parts["stem"].append(
                plants.stem([foot, 0.5 * (foot + tip) + [0, 0.02, 0], tip], 0.0012, 5, 8)
            )
            facing = mesh.unit(lean * [1.0, 0.5, 1.0] + [0, 0, 0.75])
            size, roll = random.uniform(0.019, 0.027), random.uniform(0, 360)
            parts["flower"].append(
                plants.placed(plants.daisy(size, random.randint(1000), 14, 2, 4), tip, facing, roll)
            )
            parts["heart"].append(plants.placed(plants.daisy_heart(size, 10, 4), tip, facing, roll))
    if kind == "geranium":
        for _ in range(9):
            lean = np.array([random.normal(0, 0.5), 1.0, random.normal(0.15, 0.4)])
            top = base + mesh.unit(lean) * random.uniform(0.12, 0.22)
            parts["stem"].append(
                plants.stem([base, 0.5 * (base + top) + [0, 0.02, 0], top], 0.0020, 5, 8)
            )
            for way in plants.on_sphere(15, random.randint(1000), -0.35):
                floret = plants.five_petals(0.0125, random.randint(1000), 2, 4)
                parts["flower"].append(
                    plants.placed(floret, top + 0.024 * way, way, random.uniform(0, 360))
                )
    if kind == "lavender":
        for _ in range(34):
            lean = np.array([random.normal(0, 0.38), 1.0, random.normal(0.05, 0.32)])
            foot = base + np.array(
                [random.uniform(-0.5, 0.5) * r, 0, random.uniform(-0.5, 0.5) * r]
            )
            way = mesh.unit(lean)
            tip = foot + way * random.uniform(0.15, 0.26)
            parts["stem"].append(
                plants.stem([foot, 0.5 * (foot + tip) + [0, 0.01, 0], tip], 0.0011, 4, 5)
            )
            for j in range(9):
                for _ in range(4):
                    out = mesh.unit(way * 0.6 + random.normal(0, 0.6, 3))
                    bud = plants.oval_leaf(0.009, 0.0055, 0.5, 20, 2, 3)
                    parts["flower"].append(
                        plants.placed(bud, tip - way * (0.006 * j), out, random.uniform(0, 360))
                    )
    for _ in range({"daisies": 46, "geranium": 60, "lavender": 70}[kind]):
        angle, rise = random.uniform(0, 2 * np.pi), random.uniform(0.02, 0.9)
        way = mesh.unit([np.cos(angle), rise, np.sin(angle)])
        length = random.uniform(0.045, 0.085)
        width = {"daisies": 0.014, "geranium": 0.052, "lavender": 0.006}[kind]
        leaf = plants.oval_leaf(
            length, width, 0.3, random.uniform(30, 80), 4, 6, 0.25 if kind == "geranium" else 0.0
        )
        foot = (
            base
            + random.uniform(0.1, 0.9) * r * np.array([np.cos(angle), 0.0, np.sin(angle)])
            + [0, random.uniform(0, 0.08), 0]
        )
        parts["leaf"].append(facing_leaf(leaf, foot, way, random))
    return parts


def tree(place, height, crown, leaves, seed):
    """A garden tree seen through the arch: trunk and a cloud of leaves in clusters."""
    random = np.random.RandomState(seed)
    place = np.array(place)
    top = place + [0, height, 0]
    trunk = plants.stem(
        [place, place + [0.03 * height, 0.5 * height, 0], top],
        lambda s: 0.045 * height * (1 - 0.6 * s),
        8,
        8,
    )
    parts = []
    for _ in range(leaves):
        way = mesh.unit(random.normal(0, 1, 3))
        centre = top + crown * way * random.uniform(0.25, 1.0) ** 0.4 * [1.0, 0.8, 1.0]
        leaf = plants.oval_leaf(0.16 * crown, 0.11 * crown, 0.2, 30, 2, 2)
        parts.append(
            plants.placed(
                leaf, centre, mesh.unit(way + random.normal(0, 0.7, 3)), random.uniform(0, 360)
            )
        )
    return merged(parts), trunk
