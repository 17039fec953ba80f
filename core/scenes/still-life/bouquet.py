"""The bouquet in the vase and the petals it has lost."""

import numpy as np

import mesh
import plants
from mesh import merged
from objects import TABLE, standing

BLOOMS = [  # kind, place over the vase's mouth, radius
    ("rose", (-0.062, 0.085, 0.080), 0.062),
    ("cream", (0.078, 0.062, 0.080), 0.057),
    ("rose", (0.034, 0.160, 0.045), 0.058),
    ("cream", (-0.110, 0.150, 0.010), 0.050),
    ("rose", (0.145, 0.135, -0.010), 0.050),
    ("cream", (-0.036, 0.222, -0.005), 0.047),
    ("rose", (-0.150, 0.062, 0.020), 0.044),
    ("cream", (0.105, 0.215, -0.030), 0.043),
    ("rose", (0.010, 0.035, 0.120), 0.044),
    ("rose", (-0.118, 0.235, -0.040), 0.036),
    ("cream", (0.170, 0.045, 0.020), 0.040),
    ("rose", (0.045, 0.268, -0.045), 0.036),
]
DAISIES = [
    (-0.175, 0.190, 0.010),
    (-0.060, 0.020, 0.125),
    (-0.010, 0.295, 0.0),
    (0.185, 0.205, 0.010),
    (0.140, 0.010, 0.090),
    (-0.012, 0.140, 0.100),
    (0.100, 0.300, -0.02),
    (-0.210, 0.110, 0.030),
    (0.215, 0.110, 0.0),
    (-0.075, 0.290, -0.03),
    (0.115, 0.125, 0.070),
]


def bouquet(x, z, mouth):
    """Roses, daisies and leaves on a dome over the vase's mouth."""
    random = np.random.RandomState(12)
    bunch = {"rose": [], "cream": [], "petal": [], "heart": [], "leaf": [], "stem": []}
    over = np.array([x, mouth, z])
    start = over - [0, 0.06, 0]
    for k, (kind, offset, radius) in enumerate(BLOOMS):
        facing = mesh.unit(np.array(offset) * [1.0, 0.75, 1.0] + [0.0, 0.03, 0.055])
        foot = over + offset - 0.6 * radius * facing
        flower = plants.rose(radius, 40 + k, 20, 0.80 + 0.25 * random.uniform(), 6, 5)
        bunch[kind].append(plants.placed(flower, foot, facing, random.uniform(0, 360)))
        bunch["stem"].append(
            plants.stem([start, 0.5 * (start + foot) + [0, 0.02, 0], foot], 0.0022, 6, 10)
        )
        for _ in range(5):
            leaf = plants.oval_leaf(0.062, 0.036, 0.3, random.uniform(20, 60), 4, 6)
            angle = random.uniform(0, 2 * np.pi)
            way = mesh.unit(0.8 * facing + np.array([np.cos(angle), np.sin(angle), 0.1]))
            bunch["leaf"].append(
                plants.placed(leaf, foot - 0.25 * radius * facing, way, random.uniform(0, 360))
            )
    for k, offset in enumerate(DAISIES):
        facing = mesh.unit(np.array(offset) * [0.8, 0.5, 1.0] + [0.0, 0.02, 0.12])
        roll = random.uniform(0, 360)
        bunch["petal"].append(
            plants.placed(plants.daisy(0.030, 70 + k), over + offset, facing, roll)
        )
        bunch["heart"].append(
            plants.placed(plants.daisy_heart(0.030, 12, 5), over + offset, facing, roll)
        )
        bunch["stem"].append(
            plants.stem(
                [start, start + 0.5 * np.array(offset) + [0, 0.06, 0.01], over + offset],
                0.0014,
                5,
                10,
            )
        )
    for k in range(12):
        sprig(bunch, random, over, 2 * np.pi * k / 12 + random.uniform(-0.2, 0.2))
    return {name: merged(parts) for name, parts in bunch.items()}


def sprig(bunch, random, over, angle):
    """A thin twig that leans out of the vase, leaves in pairs."""
    reach = random.uniform(0.13, 0.22)
    out = np.array([np.cos(angle), 0.0, 0.7 * np.sin(angle)])
    tip = over + reach * out + [0, random.uniform(0.0, 0.22), 0]
    course = mesh.curve(
        np.array([over - [0, 0.06, 0], over + 0.3 * reach * out + [0, 0.06, 0], tip])
    )
    bunch["stem"].append(plants.stem(course(np.linspace(0, 1, 9)), 0.0013, 5, 10))
    for s in np.linspace(0.45, 1.0, 6):
        here, way = (
            course(np.array([s]))[0],
            course(np.array([s]))[0] - course(np.array([s - 0.03]))[0],
        )
        for side in (-1, 1):
            aside = mesh.unit(
                mesh.unit(way) + 0.9 * side * np.array([-np.sin(angle), 0.25, np.cos(angle)])
            )
            leaf = plants.oval_leaf(random.uniform(0.032, 0.048), 0.022, 0.3, 45, 4, 5)
            bunch["leaf"].append(plants.placed(leaf, here, aside, random.uniform(-40, 40)))


def fallen_petals():
    """Rose petals on table and runner, before the vase."""
    random = np.random.RandomState(3)
    parts = []
    for x, z in ((0.19, -1.74), (0.245, -1.66), (0.06, -1.55), (-0.02, -1.36), (0.135, -1.47)):
        petal = plants.rose_petal(0.040, 0.9, 0.55, random, 6, 6).rotated(
            "x", random.uniform(60, 85)
        )
        petal = petal.rotated("y", random.uniform(0, 360))
        parts.append(standing(petal, x, z, TABLE + (0.003 if z < -1.62 else 0.0005)))
    return merged(parts)
