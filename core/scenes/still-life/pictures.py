"""Painted surfaces of the still life."""

import numpy as np

import pattern
from pattern import fbm, ink, mix, noise, ramp, smoothstep, uv_grid


def planks(width, height, boards, seed, dark, light):
    """Boards along v: rings of growth drawn out, pores, a thin gap between boards."""
    random = np.random.RandomState(seed)
    u, v = uv_grid(width, height)
    board = np.floor(u * boards).astype(int)
    shift = random.uniform(0, 40, boards)[board]
    tone = random.uniform(-0.10, 0.10, boards)[board]
    across = u * boards + shift
    warp = fbm(across * 0.7, v * 1.6 + shift, 4, 0.5, seed=seed + 1)
    rings = 0.5 + 0.5 * np.sin(2 * np.pi * (across * 3.2 + 2.6 * warp))
    grain = fbm(across * 55, v * 5 + shift, 4, 0.6, seed=seed + 2)
    pores = smoothstep(0.25, 0.6, noise(across * 95, v * 11 + shift, seed=seed + 3))
    wood = mix(dark, light, np.clip(0.30 + 0.42 * rings**1.5 + 0.22 * grain + tone, 0, 1))
    wood = wood * (1.0 - 0.28 * pores)[..., None]
    edge = np.abs(u * boards - np.rint(u * boards)) / boards
    return mix(wood, np.array(dark) * 0.35, (1 - smoothstep(0.0008, 0.0022, edge)) * (edge > 0))


def porcelain(size=1024):
    """Cobalt on white glaze: bands, lotus lappets, medallions between scrolling stems."""
    u, v = uv_grid(size, size)
    blue = np.zeros_like(u)

    def rosette(x, y, radius, petals):
        r, angle = np.hypot(x, y) / radius, np.arctan2(y, x)
        outline = 0.62 + 0.38 * np.abs(np.cos(0.5 * petals * angle)) ** 0.7
        petal = smoothstep(0.03, -0.03, r - outline) * (
            0.55 + 0.45 * smoothstep(0.2, 0.9, r / outline)
        )
        vein = ink(np.abs(np.sin(0.5 * petals * angle)) * r, 0.04, 0.05) * (r > 0.3)
        eye = smoothstep(0.26, 0.22, r) - smoothstep(0.16, 0.12, r) + smoothstep(0.08, 0.04, r)
        return np.clip(np.where(r < 0.30, eye, petal * (1 - 0.8 * vein)), 0, 1)

    # Medallions round the belly; a texel is about twice as wide as high there.
    repeat = 5
    x = (u * repeat) % 1.0 - 0.5
    y = (v - 0.36) * 3.1
    blue = np.maximum(blue, rosette(x, y, 0.27, 8))
    ring = np.abs(np.hypot(x, y) - 0.335)
    blue = np.maximum(blue, ink(ring, 0.008, 0.006))
    blue = np.maximum(blue, ink(np.abs(ring - 0.022), 0.004, 0.005))
    half = (u * repeat + 0.5) % 1.0 - 0.5
    blue = np.maximum(blue, rosette(half, (v - 0.475) * 3.1, 0.10, 6))
    blue = np.maximum(blue, rosette(half, (v - 0.245) * 3.1, 0.10, 6))
    outside = smoothstep(0.35, 0.37, np.hypot(x, y))
    for sign in (1, -1):
        wave = 0.36 + sign * 0.052 * np.cos(2 * np.pi * u * repeat)
        blue = np.maximum(blue, outside * ink(np.abs(v - wave), 0.0022, 0.002))
    belly = (v > 0.20) & (v < 0.52)
    sprig = smoothstep(
        0.30,
        0.45,
        np.sin(2 * np.pi * u * repeat * 5) * np.sin(2 * np.pi * v * 27)
        + 0.5 * noise(u * 40, v * 36, (40, 36), seed=4),
    )
    blue = np.maximum(
        blue,
        0.55
        * sprig
        * outside
        * belly
        * (np.hypot(half, (v - 0.475) * 3.1) > 0.14)
        * (np.hypot(half, (v - 0.245) * 3.1) > 0.14),
    )
    blue = np.where(belly, blue, 0.0)
    # Lappets at foot and shoulder.
    for base, height, count, up in ((0.06, 0.125, 14, 1), (0.535, 0.10, 18, -1)):
        t = (v - base) / height if up > 0 else 1.0 - (v - base) / height
        s = np.abs((u * count) % 1.0 - 0.5) * 2.0
        edge = np.sqrt(1.0 - np.clip(t, 0, 1) ** 2.2) * 0.92
        lappet = smoothstep(0.05, -0.05, s - edge) * (t > 0) * (t < 1)
        inner = smoothstep(0.05, -0.05, s - (edge - 0.28)) * (t < 0.72)
        blue = np.maximum(blue, lappet * (1 - 0.75 * inner) * 0.95)
    # Neck: key pattern and rings.
    key = (
        ((np.floor(u * 72) + np.floor((v - 0.70) * 96)).astype(int) % 3 == 0)
        & (v > 0.70)
        & (v < 0.775)
    )
    blue = np.maximum(blue, 0.8 * key)
    for line, width in (
        (0.045, 0.006),
        (0.195, 0.003),
        (0.205, 0.0015),
        (0.522, 0.003),
        (0.645, 0.005),
        (0.69, 0.003),
        (0.785, 0.003),
        (0.84, 0.010),
    ):
        blue = np.maximum(blue, ink(np.abs(v - line), width, 0.002))
    # The brush: pools and dry strokes; the glaze: a cool white with a little iron.
    pool = 0.80 + 0.20 * fbm(u * 30, v * 30, 4, 0.6, (30, 30), seed=11)
    glaze = mix(
        (0.90, 0.915, 0.915),
        (0.84, 0.87, 0.885),
        0.5 + 0.5 * fbm(u * 6, v * 6, 4, 0.5, (6, 6), seed=5),
    )
    return mix(glaze, mix((0.30, 0.42, 0.72), (0.07, 0.14, 0.42), pool), blue * pool)


def shell(width=2048, height=512):
    """u: round the tube (0.5 at the back), written along rows' height; v: along the spiral."""
    v, u = uv_grid(width, height)
    back = np.abs(2.0 * u - 1.0)  # 0 at the back, 1 at the inner seam
    warp = fbm(u * 5, v * 26, 4, 0.55, seed=21)
    flame = np.sin(2 * np.pi * (v * 23 + 0.35 * back + 0.30 * warp))
    reach = 0.72 + 0.35 * noise(v * 23, u * 0 + 3.3, seed=6) - 0.45 * smoothstep(0.80, 0.96, v)
    stripe = smoothstep(-0.05, 0.25, flame) * smoothstep(0.12, -0.10, back - reach)
    stripe = stripe * smoothstep(0.99, 0.86, v)
    cream = mix(
        (0.93, 0.885, 0.79), (0.87, 0.80, 0.68), 0.5 + 0.5 * fbm(u * 9, v * 60, 4, 0.5, seed=22)
    )
    lines = 0.5 + 0.5 * np.sin(2 * np.pi * (v * 170 + 0.8 * warp))
    cream = cream * (1 - 0.05 * lines)[..., None]
    rust = mix(
        (0.62, 0.28, 0.12), (0.38, 0.13, 0.06), 0.5 + 0.5 * fbm(u * 14, v * 70, 4, 0.5, seed=23)
    )
    return np.transpose(mix(cream, rust, 0.93 * stripe), (1, 0, 2))[::-1, ::-1]


def apple(size=512):
    u, v = uv_grid(size, size)
    streak = fbm(u * 46, v * 2.5, 4, 0.6, (46, 256), seed=31)
    blush = (
        0.52
        + 0.45 * np.sin(2 * np.pi * (u + 0.05))
        + 0.5 * streak
        + 0.35 * fbm(u * 4, v * 3, 3, 0.5, (4, 256), seed=32)
    )
    skin = ramp(
        np.clip(blush, 0, 1),
        (0.0, (0.80, 0.72, 0.30)),
        (0.35, (0.85, 0.50, 0.22)),
        (0.65, (0.74, 0.17, 0.12)),
        (1.0, (0.48, 0.04, 0.07)),
    )
    near, _, number = pattern.cells(u * 34, v * 26, (34, 26), seed=33)
    dots = smoothstep(0.13, 0.05, near) * (number > 0.3)
    skin = mix(skin, (0.90, 0.78, 0.52), 0.5 * dots)
    return mix(skin, (0.58, 0.52, 0.20), smoothstep(0.86, 0.97, v + 0.05 * streak))


def pear(size=512):
    u, v = uv_grid(size, size)
    mottling = fbm(u * 10, v * 10, 5, 0.6, (10, 256), seed=41)
    skin = ramp(
        np.clip(0.45 + 0.35 * mottling + 0.15 * v, 0, 1),
        (0.0, (0.56, 0.56, 0.16)),
        (1.0, (0.84, 0.76, 0.28)),
    )
    blush = smoothstep(0.25, 1.0, np.sin(2 * np.pi * (u + 0.1)) + 0.5 * mottling) * smoothstep(
        0.05, 0.4, v
    )
    skin = mix(skin, (0.78, 0.33, 0.16), 0.75 * blush)
    near, _, number = pattern.cells(u * 60, v * 50, (60, 50), seed=42)
    skin = mix(skin, (0.42, 0.30, 0.12), 0.55 * smoothstep(0.22, 0.08, near) * (number > 0.35))
    return mix(skin, (0.47, 0.33, 0.15), smoothstep(0.90, 1.0, v + 0.06 * mottling))


def citrus(light, deep, size=256):
    u, v = uv_grid(size, size)
    near, _, _ = pattern.cells(u * 44, v * 30, (44, 30), seed=51)
    skin = mix(light, deep, 0.5 + 0.5 * fbm(u * 4, v * 4, 3, 0.5, (4, 256), seed=52))
    return skin * (1.0 - 0.22 * smoothstep(0.30, 0.12, near))[..., None]


def linen(width=1536, height=1024):
    """Runner: plain weave, a field of cream with bands of madder and indigo near its ends."""
    u, v = uv_grid(width, height)
    threads_u, threads_v = 250, 170
    x, y = u * threads_u, v * threads_v
    over = (np.floor(x) + np.floor(y)).astype(int) % 2 == 0
    warp_thread = np.abs(np.sin(np.pi * x)) ** 0.6
    weft_thread = np.abs(np.sin(np.pi * y)) ** 0.6
    relief = np.where(
        over, warp_thread * (0.75 + 0.25 * weft_thread), weft_thread * (0.75 + 0.25 * warp_thread)
    )
    slub = 0.5 + 0.5 * np.where(
        over,
        fbm(np.floor(x) * 0.77, y * 0.08, 3, seed=61),
        fbm(x * 0.08, np.floor(y) * 0.77, 3, seed=62),
    )
    cream = mix((0.83, 0.78, 0.68), (0.93, 0.90, 0.82), slub)
    madder, indigo = np.array((0.60, 0.16, 0.14)), np.array((0.16, 0.23, 0.42))
    to_end = np.minimum(u, 1 - u)
    cloth = cream
    for low, high, colour in (
        (0.055, 0.062, indigo),
        (0.070, 0.105, madder),
        (0.113, 0.120, indigo),
        (0.150, 0.155, madder),
        (0.162, 0.167, madder),
    ):
        cloth = mix(
            cloth,
            colour * (0.85 + 0.3 * slub[..., None]),
            ((to_end > low) & (to_end < high)) * 0.92,
        )
    diamond = np.abs(np.abs((v * 28) % 1 - 0.5) * 2 - np.abs((to_end - 0.0875) / 0.0175))
    cloth = mix(cloth, cream, ink(diamond, 0.16, 0.1) * (np.abs(to_end - 0.0875) < 0.0175))
    return cloth * (0.70 + 0.30 * relief)[..., None]


def leather(size=512):
    """Cover: tooled frame and a sun in gold on dark green."""
    u, v = uv_grid(size, size)
    first, second, _ = pattern.cells(u * 60, v * 60, (60, 60), seed=71)
    hide = mix((0.10, 0.22, 0.17), (0.16, 0.31, 0.23), 0.5 + 0.5 * fbm(u * 5, v * 5, 4, seed=72))
    hide = hide * (0.80 + 0.20 * smoothstep(0.0, 0.25, second - first))[..., None]
    edge = np.minimum(np.minimum(u, 1 - u), np.minimum(v, 1 - v))
    gold = np.maximum(
        ink(np.abs(edge - 0.07), 0.006, 0.004), ink(np.abs(edge - 0.095), 0.003, 0.004)
    )
    r, angle = np.hypot(u - 0.5, v - 0.5), np.arctan2(v - 0.5, u - 0.5)
    sun = smoothstep(0.01, -0.01, r - (0.10 + 0.07 * np.abs(np.cos(6 * angle)) ** 3)) - smoothstep(
        0.01, -0.01, r - 0.07
    )
    gold = np.maximum(gold, np.clip(sun, 0, 1))
    return mix(hide, (0.80, 0.63, 0.28), gold * (0.75 + 0.25 * noise(u * 90, v * 90, seed=73)))


def pages(size=256):
    u, v = uv_grid(size, size)
    sheet = 0.5 + 0.5 * noise(u * 2, v * 90, seed=81)
    return mix((0.72, 0.65, 0.50), (0.90, 0.86, 0.74), sheet)


def petals(inner, outer, tip, size=128):
    """u: inner to outer petals, v: base to tip; shade gathers in the heart of the flower."""
    u, v = uv_grid(size, size)
    colour = mix(
        mix(inner, outer, smoothstep(0.1, 0.9, u)), tip, smoothstep(0.55, 1.0, v) * (0.3 + 0.6 * u)
    )
    shade = 0.42 + 0.58 * np.clip(0.15 + 0.55 * u + 0.75 * v**1.5, 0, 1)
    return colour * shade[..., None]


def foliage(size=256):
    """One leaf: u across (midrib at 0.5), v from base to tip."""
    u, v = uv_grid(size, size)
    side = np.abs(u - 0.5)
    vein = np.minimum(
        ink(np.abs(np.sin(np.pi * (9 * v - 7 * side))), 0.10, 0.14), 1.0
    ) * smoothstep(0.5, 0.1, side)
    vein = np.maximum(0.6 * vein, ink(side, 0.018, 0.02))
    green = mix((0.17, 0.31, 0.12), (0.30, 0.45, 0.18), 0.5 + 0.5 * fbm(u * 5, v * 5, 4, seed=91))
    return mix(green, (0.52, 0.62, 0.34), 0.6 * vein)


def wall(width=1024, height=512):
    """Upper part of a room's wall: grey green paper in broad stripes with a fine pale line."""
    u, v = uv_grid(width, height)
    cloud = fbm(u * 5, v * 2.5, 6, 0.6, seed=101)
    x = (u * 22) % 1.0
    stripe = smoothstep(0.02, 0.06, x) * smoothstep(0.54, 0.50, x)
    paper = mix((0.40, 0.445, 0.41), (0.335, 0.385, 0.365), stripe)
    paper = mix(paper, (0.60, 0.58, 0.46), 0.6 * ink(np.abs(x - 0.77), 0.018, 0.02))
    return paper * (1.0 + 0.10 * cloud)[..., None]


def landscape(width=512, height=384):
    """The painting: evening sky, hills in haze, a river, two poplars."""
    u, v = uv_grid(width, height)
    cloud = fbm(u * 3.5, v * 7, 5, 0.55, seed=111)
    sky = ramp(v, (0.45, (0.95, 0.78, 0.50)), (0.65, (0.80, 0.72, 0.62)), (1.0, (0.38, 0.50, 0.62)))
    picture = mix(sky, (0.97, 0.90, 0.78), smoothstep(0.05, 0.6, cloud) * 0.8)
    for height_of, colour, seed in (
        (0.50, (0.52, 0.58, 0.62), 1),
        (0.44, (0.40, 0.48, 0.45), 2),
        (0.37, (0.30, 0.37, 0.24), 3),
    ):
        ridge = height_of + 0.06 * fbm(u * 2.3 + seed, u * 0 + seed, 4, 0.5, seed=112 + seed)
        picture = mix(picture, colour, smoothstep(0.008, -0.008, v - ridge))
    field = mix((0.36, 0.36, 0.16), (0.58, 0.50, 0.22), 0.5 + 0.5 * fbm(u * 6, v * 20, 4, seed=118))
    picture = mix(picture, field, smoothstep(0.30, 0.27, v + 0.02 * np.sin(9 * u)))
    bend = 0.55 + 0.18 * np.sin(9.0 * v + 0.6)
    river = smoothstep(0.01, -0.01, np.abs(u - bend) - 0.16 * (0.30 - v)) * (v < 0.30)
    picture = mix(picture, (0.84, 0.74, 0.58), river)
    for x, top, half in ((0.20, 0.74, 0.045), (0.29, 0.66, 0.038)):
        t = np.clip((v - 0.22) / (top - 0.22), 0, 1)
        crown = (
            half * np.sin(np.pi * t**0.7) ** 0.6 * (1 + 0.35 * noise(u * 60, v * 60, seed=119))
        )
        picture = mix(
            picture,
            (0.16, 0.21, 0.11),
            smoothstep(0.006, -0.006, np.abs(u - x) - crown) * (t > 0) * (t < 1),
        )
    return picture


def garden(width=256, height=384):
    """What the window shows: a bright sky, trees in the sun, a hedge in shade."""
    u, v = uv_grid(width, height)
    picture = ramp(v, (0.3, (0.96, 0.97, 0.95)), (1.0, (0.66, 0.81, 0.95)))
    for k, (x, y, radius) in enumerate(
        ((0.12, 0.52, 0.20), (0.86, 0.62, 0.26), (0.50, 0.40, 0.17), (0.30, 0.36, 0.15))
    ):
        rough = 0.35 * fbm(u * 7 + k, v * 9, 5, 0.6, seed=121 + k)
        crown = smoothstep(
            0.10, -0.10, np.hypot((u - x) / 0.9, (v - y) * 1.1) / radius - 1.0 + rough
        )
        lit = np.clip(0.5 + 0.9 * fbm(u * 12, v * 14, 5, 0.65, seed=131 + k) + 1.2 * (v - y), 0, 1)
        picture = mix(picture, mix((0.22, 0.33, 0.13), (0.74, 0.80, 0.42), lit), crown)
    hedge = mix(
        (0.17, 0.27, 0.12), (0.42, 0.52, 0.22), 0.5 + 0.7 * fbm(u * 16, v * 20, 4, 0.6, seed=141)
    )
    picture = mix(
        picture,
        hedge,
        smoothstep(0.02, -0.02, v - 0.27 - 0.03 * fbm(u * 5, u * 0 + 1, 4, seed=142)),
    )
    return mix(picture, (0.70, 0.74, 0.38), smoothstep(0.01, -0.01, v - 0.11))


def lampshade(size=128):
    u, v = uv_grid(size, size)
    glow = np.exp(-(((v - 0.42) / 0.42) ** 2))
    pleats = 0.94 + 0.06 * np.sin(2 * np.pi * 48 * u)
    return (
        ramp(glow, (0.0, (0.72, 0.42, 0.18)), (0.6, (0.98, 0.75, 0.42)), (1.0, (1.0, 0.90, 0.66)))
        * pleats[..., None]
    )


def walnut(size=512):
    return planks(size, size, 3, 131, (0.17, 0.09, 0.05), (0.36, 0.21, 0.12))
