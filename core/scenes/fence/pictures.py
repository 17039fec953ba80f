"""Painted surfaces of the garden."""

import numpy as np

import pattern
from pattern import fbm, ink, mix, noise, ramp, smoothstep, uv_grid


def bricks(width=2048, height=1536, columns=8, courses=20, seed=1):
    """Weathered stretcher bond with lime mortar; also returns how far each texel stands out."""
    random = np.random.RandomState(seed)
    u, v = uv_grid(width, height)
    wander = 0.018 * fbm(u * 9, v * 12, 3, seed=seed + 1)
    row_place = v * courses + wander
    row = np.floor(row_place).astype(int)
    column_place = u * columns + 0.5 * (row % 2) + 0.6 * wander
    column = np.floor(column_place).astype(int)
    number = (row * 37 + column * 11) % 400
    fx = np.minimum(column_place - column, 1 - (column_place - column)) * (1.0 / columns)
    fy = np.minimum(row_place - row, 1 - (row_place - row)) * (height / width) / courses
    ragged = 0.0016 * fbm(u * 60, v * 45, 3, seed=seed + 2)
    edge = np.minimum(fx, fy) + ragged
    solid = smoothstep(0.0036, 0.0058, edge)
    hue = random.uniform(size=400)[number]
    tone = random.uniform(-0.09, 0.09, 400)[number]
    clay = ramp(
        hue,
        (0.0, (0.50, 0.22, 0.15)),
        (0.35, (0.62, 0.30, 0.20)),
        (0.65, (0.70, 0.41, 0.28)),
        (0.85, (0.58, 0.40, 0.31)),
        (1.0, (0.34, 0.19, 0.17)),
    )
    rough = fbm(u * 70, v * 52, 5, 0.65, seed=seed + 3)
    blotch = fbm(u * 16, v * 12, 4, 0.6, seed=seed + 4)
    clay = clay * (1.0 + tone + 0.24 * rough + 0.16 * blotch)[..., None]
    clay = mix(clay, (0.72, 0.66, 0.60), 0.55 * smoothstep(0.30, 0.65, blotch + 0.3 * rough))
    mortar = mix(
        (0.56, 0.53, 0.47),
        (0.70, 0.67, 0.60),
        0.5 + 0.5 * fbm(u * 120, v * 90, 3, 0.7, seed=seed + 5),
    )
    picture = mix(mortar * 0.88, clay, solid)
    # Light from the upper left catches upper edges and leaves lower joints in shade.
    down = np.roll(solid, 3, axis=0) - np.roll(solid, -3, axis=0)
    across = np.roll(solid, 3, axis=1) - np.roll(solid, -3, axis=1)
    picture = picture * (1.0 - 0.22 * down - 0.12 * across)[..., None]
    moss = smoothstep(0.25, 0.6, fbm(u * 6, v * 5, 5, 0.6, seed=seed + 6) + 0.55 * (0.35 - v)) * (
        1 - 0.6 * solid
    )
    return mix(1.13 * picture, (0.38, 0.45, 0.19), 0.75 * moss)


def stone(size=512, seed=5):
    u, v = uv_grid(size, size)
    grey = mix(
        (0.60, 0.57, 0.50),
        (0.78, 0.75, 0.68),
        0.5 + 0.6 * fbm(u * 6, v * 6, 6, 0.62, (6, 6), seed=seed),
    )
    lichen = smoothstep(0.30, 0.55, fbm(u * 9, v * 9, 4, 0.6, (9, 9), seed=seed + 1))
    return mix(grey, (0.66, 0.64, 0.36), 0.5 * lichen)


def ivy(size=256, seed=11):
    """Leaf over its bounding square: palmate pale veins on green, a lighter rim."""
    u, v = uv_grid(size, size)
    x, y = (u - 0.5) * 1.3, v * 1.1 - 0.1
    veins = np.zeros_like(u)
    for tip in (
        (0.0, 1.0),
        (-0.60, 0.43),
        (0.60, 0.43),
        (-0.45, 0.03),
        (0.45, 0.03),
        (-0.27, 0.65),
        (0.27, 0.65),
    ):
        distance = pattern.segment_distance(x, y, (0.0, 0.02), tip)
        veins = np.maximum(veins, ink(distance, 0.014, 0.022))
    green = mix((0.16, 0.32, 0.12), (0.34, 0.52, 0.20), 0.5 + 0.6 * fbm(u * 5, v * 5, 4, seed=seed))
    return mix(green, (0.62, 0.70, 0.42), 0.65 * veins)


def young_leaf(size=128, seed=15):
    u, v = uv_grid(size, size)
    side = np.abs(u - 0.5)
    vein = np.maximum(
        0.5 * ink(np.abs(np.sin(np.pi * (8 * v - 6 * side))), 0.12, 0.2), ink(side, 0.02, 0.03)
    )
    green = mix((0.36, 0.50, 0.14), (0.52, 0.66, 0.24), 0.5 + 0.5 * fbm(u * 4, v * 4, 4, seed=seed))
    return mix(green, (0.74, 0.82, 0.48), 0.55 * vein)


def petals(base, middle, tip, streaks, size=128, seed=21):
    """v from the flower's heart outwards; fine streaks along it."""
    u, v = uv_grid(size, size)
    colour = ramp(v, (0.0, base), (0.40, middle), (1.0, tip))
    line = 0.5 + 0.5 * noise(u * 30, v * 1.5, seed=seed)
    return colour * (1.0 - streaks * line * (1 - 0.5 * v))[..., None]


def rose_petals(inner, outer, tip, size=128):
    """u: inner to outer petals, v: base to tip; shade gathers in the heart of the flower."""
    u, v = uv_grid(size, size)
    colour = mix(
        mix(inner, outer, smoothstep(0.1, 0.9, u)), tip, smoothstep(0.55, 1.0, v) * (0.3 + 0.6 * u)
    )
    return colour * (0.58 + 0.42 * np.clip(0.15 + 0.55 * u + 0.75 * v**1.5, 0, 1))[..., None]


def terracotta(size=512, seed=31):
    u, v = uv_grid(size, size)
    clay = mix(
        (0.64, 0.34, 0.21),
        (0.78, 0.48, 0.32),
        0.5 + 0.6 * fbm(u * 8, v * 4, 5, 0.6, (8, 256), seed=seed),
    )
    bloom = smoothstep(
        0.15, 0.6, fbm(u * 5, v * 5, 5, 0.6, (5, 256), seed=seed + 1) + 0.3 * (0.5 - v)
    )
    clay = mix(clay, (0.84, 0.74, 0.64), 0.5 * bloom)
    band = ((v * 40) % 1.0 < 0.5) & (np.abs(v - 0.55) < 0.03)
    return clay * (1 - 0.08 * band)[..., None]


def meadow(width=512, height=512, seed=41):
    """Lawn with mown stripes and clover."""
    u, v = uv_grid(width, height)
    grass = mix(
        (0.28, 0.42, 0.12),
        (0.50, 0.64, 0.24),
        0.5 + 0.6 * fbm(u * 40, v * 20, 5, 0.65, (40, 20), seed=seed),
    )
    stripe = smoothstep(-0.2, 0.2, np.sin(2 * np.pi * 5 * v))
    grass = grass * (0.88 + 0.16 * stripe)[..., None]
    near, _, number = pattern.cells(u * 50, v * 50, (50, 50), seed=seed + 1)
    return mix(grass, (0.93, 0.93, 0.86), smoothstep(0.16, 0.10, near) * (number > 0.72))


def distance_view(width=1024, height=512, seed=51):
    """Beyond the lawn: summer sky, woods in haze."""
    u, v = uv_grid(width, height)
    sky = ramp(v, (0.30, (0.90, 0.94, 0.96)), (0.6, (0.62, 0.79, 0.94)), (1.0, (0.33, 0.58, 0.86)))
    cloud = fbm(u * 5, v * 9, 6, 0.55, seed=seed)
    picture = mix(sky, (1.0, 0.99, 0.97), smoothstep(0.02, 0.45, cloud) * smoothstep(0.25, 0.5, v))
    for k, (level, colour) in enumerate(
        ((0.42, (0.55, 0.67, 0.66)), (0.36, (0.40, 0.54, 0.40)), (0.29, (0.27, 0.40, 0.20)))
    ):
        crest = level + 0.05 * fbm(u * (4 + 5 * k) + 3 * k, u * 0 + k, 5, 0.6, seed=seed + 1 + k)
        leaves = 0.5 + 0.8 * fbm(u * 40, v * 26, 5, 0.65, seed=seed + 5 + k)
        woods = mix(np.array(colour) * 0.72, np.array(colour) * 1.25, leaves)
        picture = mix(picture, woods, smoothstep(0.006, -0.006, v - crest))
    return picture


def rust(size=512, seed=61):
    """Wrought iron whose dark green paint flakes off."""
    u, v = uv_grid(size, size)
    flake = fbm(u * 10, v * 24, 6, 0.62, (10, 24), seed=seed)
    paint = mix(
        (0.07, 0.15, 0.12),
        (0.12, 0.22, 0.18),
        0.5 + 0.5 * fbm(u * 30, v * 60, 3, 0.6, (30, 60), seed=seed + 1),
    )
    iron = mix(
        (0.30, 0.13, 0.06),
        (0.55, 0.30, 0.14),
        0.5 + 0.7 * fbm(u * 40, v * 80, 4, 0.65, (40, 80), seed=seed + 2),
    )
    return mix(paint, iron, smoothstep(0.16, 0.22, flake))
