"""The fence in the foreground: bars, rails, curls, and a vine that winds up one bar."""

import numpy as np

import plants
from garden import facing_leaf
from mesh import merged, tube


def fence():
    """Wrought-iron bars 6 to 12 mm thick at about 0.8 m, no two alike, between two flat rails."""
    random = np.random.RandomState(23)
    parts = []
    for k, x in enumerate(np.arange(-0.385, 0.39, 0.070)):
        radius = 0.5 * (0.0060, 0.0100, 0.0120, 0.0110, 0.0080)[(k * 3) % 5]
        x = x + random.uniform(-0.007, 0.007)
        lean, bow = random.uniform(-0.014, 0.014), random.uniform(-0.005, 0.005)
        z = -0.80 + random.uniform(-0.006, 0.006)
        y = np.linspace(-0.32, 0.25, 12)
        path = np.stack(
            [
                x + lean * y / 0.3 + bow * np.cos(6 * y) + random.normal(0, 0.0006, 12),
                y,
                z + 0.003 * np.sin(7 * y + k),
            ],
            -1,
        )
        thickness = radius * (1 + random.normal(0, 0.03, 12))
        bar = tube(
            path, lambda s, t=thickness: np.interp(s, np.linspace(0, 1, 12), t), 12, 36, closed=True
        )
        parts.append(bar.mapped_uv((1.0, 6.0), (0.37 * k, 0.23 * k)))
    for y, tall in ((0.152, 0.012), (-0.158, 0.012)):
        rail = tube(
            np.array(
                [
                    [-0.45, y + 0.003, -0.812],
                    [-0.15, y - 0.002, -0.812],
                    [0.2, y + 0.002, -0.813],
                    [0.45, y - 0.001, -0.812],
                ]
            ),
            0.5 * tall,
            12,
            30,
        )
        parts.append(rail.mapped_uv((1.0, 9.0), (0.5, 0.1)))
    parts.append(scroll((-0.100, 0.152), 1.0))
    parts.append(scroll((0.175, 0.152), -1.0))
    return merged(parts)


def scroll(place, hand):
    """Iron curl hanging from the upper rail."""
    t = np.linspace(0, 1, 40)
    angle = 2 * np.pi * 1.35 * t
    r = 0.026 * (1 - 0.80 * t)
    path = np.stack(
        [
            place[0] + hand * (r * np.cos(angle) - 0.026),
            place[1] - 0.006 - 0.022 * np.sin(np.pi * np.minimum(2 * t, 1) / 2) - r * np.sin(angle),
            np.full(40, -0.81),
        ],
        -1,
    )
    return tube(path, lambda s: 0.0036 - 0.0014 * s, 10, 50)


def tendril():
    """A vine that winds up one bar, with a few young leaves. Returns leaves, stem."""
    random = np.random.RandomState(31)
    t = np.linspace(0, 1, 60)
    y = -0.30 + 0.44 * t
    x = -0.236 + 0.010 * np.cos(22 * t) + 0.05 * t**3
    path = np.stack([x, y, -0.80 + 0.010 * np.sin(22 * t)], -1)
    leaves = []
    for s in np.linspace(0.12, 1.0, 9):
        here = path[int(s * 59)]
        out = np.array(
            [random.choice([-1, 1]) * random.uniform(0.5, 1.0), random.uniform(0.1, 0.9), 0.3]
        )
        leaves.append(
            facing_leaf(
                plants.oval_leaf(random.uniform(0.020, 0.034), 0.020, 0.3, 45, 6, 8),
                here,
                out,
                random,
            )
        )
    return merged(leaves), plants.stem(path, lambda s: 0.0016 - 0.0008 * s, 7, 120)
