"""Near things of the night: lantern, bottle, camera, table, railing, boats, strings of bulbs."""

import numpy as np

import mesh
import pattern
from mesh import merged, revolution, rounded_box, tube
from pattern import fbm, ink, mix, smoothstep, uv_grid

TABLE, TABLE_CENTRE, TABLE_RADIUS = -0.285, (0.02, -2.06), 0.60


def lantern():
    """Square iron lantern, 26 cm high with its ring: posts, sills, a pierced roof."""
    half, height = 0.056, 0.150
    parts = [
        rounded_box((0.140, 0.012, 0.140), 0.003).moved(y=0.012),
        rounded_box((0.122, 0.008, 0.122), 0.002).moved(y=0.021),
    ]
    for x in (-1, 1):
        for z in (-1, 1):
            parts.append(
                rounded_box((0.009, height, 0.009), 0.0015).moved(
                    x * half, 0.025 + height / 2, z * half
                )
            )
            parts.append(mesh_sphere(0.008).moved(x * 0.058, 0.003, z * 0.058))
    for y in (0.028, 0.172):
        for s in (-1, 1):
            parts.append(rounded_box((0.112, 0.007, 0.007), 0.0015).moved(0, y, s * half))
            parts.append(rounded_box((0.007, 0.007, 0.112), 0.0015).moved(s * half, y, 0))
    for s in (-1, 1):  # a thin cross bar on each side
        parts.append(rounded_box((0.112, 0.003, 0.003), 0.0008).moved(0, 0.105, s * half))
        parts.append(rounded_box((0.003, 0.003, 0.112), 0.0008).moved(s * half, 0.105, 0))
    parts.append(rounded_box((0.140, 0.007, 0.140), 0.002).moved(y=0.179))

    def roof(u, v):
        side = 0.066 * (1 - v) ** 0.8 + 0.015
        a = 4 * (u % 1.0)
        k, t = np.floor(a).astype(int), 2 * (a % 1.0) - 1
        x = np.choose(k, [t, np.ones_like(t), -t, -np.ones_like(t)]) * side
        z = np.choose(k, [np.ones_like(t), -t, -np.ones_like(t), t]) * side
        return np.stack([x, 0.182 + 0.042 * v, z], -1)

    for k in range(4):
        parts.append(mesh.surface(roof, 8, 12, u_range=(k / 4 + 1e-6, (k + 1) / 4 - 1e-6)))
    parts.append(
        revolution(
            [
                (0.016, 0.222),
                (0.018, 0.226),
                (0.012, 0.232),
                (0.012, 0.240),
                (0.015, 0.243),
                (0.0005, 0.250),
            ],
            20,
            20,
        )
    )
    ring = np.linspace(0, 2 * np.pi, 33)
    parts.append(
        tube(
            np.stack([0.019 * np.sin(ring), 0.266 - 0.019 * np.cos(ring), 0 * ring], -1),
            0.0025,
            10,
            40,
            closed=True,
        )
    )
    return merged(parts)


def mesh_sphere(radius, nu=14, nv=9):
    def point(u, v):
        a, b = 2 * np.pi * u, np.pi * (v - 0.5)
        return radius * np.stack([np.cos(b) * np.sin(a), np.sin(b), np.cos(b) * np.cos(a)], -1)

    return mesh.surface(point, nu, nv)


def candle():
    body = revolution(
        [
            (0.026, 0.025),
            (0.026, 0.05),
            (0.026, 0.078),
            (0.024, 0.083),
            (0.018, 0.081),
            (0.008, 0.077),
            (0.0005, 0.076),
        ],
        36,
        24,
    )
    flame = revolution(
        [
            (0.0004, 0.082),
            (0.0042, 0.086),
            (0.0062, 0.094),
            (0.0046, 0.105),
            (0.0018, 0.116),
            (0.0003, 0.123),
        ],
        16,
        20,
    )
    return body, flame


def bottle():
    """Bordeaux bottle, 30 cm, with its label and capsule apart."""
    glass = [
        (0.0005, 0.006),
        (0.030, 0.003),
        (0.0365, 0.004),
        (0.0375, 0.012),
        (0.0375, 0.06),
        (0.0375, 0.12),
        (0.0375, 0.178),
        (0.034, 0.198),
        (0.020, 0.214),
        (0.0150, 0.228),
        (0.0142, 0.262),
    ]
    capsule = [
        (0.0148, 0.240),
        (0.0148, 0.286),
        (0.0162, 0.288),
        (0.0162, 0.297),
        (0.0148, 0.299),
        (0.0005, 0.299),
    ]

    def paper(u, v):
        a = (u - 0.5) * 2.5
        return np.stack([0.0379 * np.sin(a), 0.052 + 0.095 * v, 0.0379 * np.cos(a)], -1)

    return revolution(glass, 64, 70), revolution(capsule, 40, 30), mesh.surface(paper, 40, 6)


def label(size=512):
    u, v = uv_grid(size, size)
    paper = mix(
        (0.90, 0.86, 0.74), (0.96, 0.93, 0.85), 0.5 + 0.5 * fbm(u * 30, v * 30, 4, 0.6, seed=41)
    )
    edge = np.minimum(np.minimum(u, 1 - u) * 1.05, np.minimum(v, 1 - v))
    mark = np.maximum(
        ink(np.abs(edge - 0.045), 0.006, 0.004), ink(np.abs(edge - 0.065), 0.0025, 0.004)
    )
    words = pattern.text_distance(
        u, v, "FSTOP", 0.5 - 0.5 * pattern.text_width("FSTOP", 0.125), 0.60, 0.125
    )
    mark = np.maximum(mark, ink(words, 0.011, 0.004))
    words = pattern.text_distance(
        u, v, "NUIT AU PORT", 0.5 - 0.5 * pattern.text_width("NUIT AU PORT", 0.058), 0.47, 0.058
    )
    mark = np.maximum(mark, ink(words, 0.0055, 0.004))
    picture = mix(paper, (0.22, 0.06, 0.07), mark)
    r, angle = np.hypot(u - 0.5, v - 0.27), np.arctan2(v - 0.27, u - 0.5)
    blades = np.abs(np.sin(3.5 * (angle + 2.2 * r))) < 0.14
    iris = (
        ink(np.abs(r - 0.135), 0.008, 0.004)
        + blades * (r < 0.13) * (r > 0.055)
        + ink(np.abs(r - 0.052), 0.005, 0.004)
    )
    return mix(picture, (0.63, 0.44, 0.15), np.clip(iris, 0, 1))


def camera():
    """Rangefinder camera, 13.5 cm wide: leather body, chrome cap and lens, glass of the lens."""
    body = [rounded_box((0.135, 0.056, 0.033), 0.012).moved(y=0.030)]
    chrome = [
        rounded_box((0.132, 0.016, 0.031), 0.006).moved(y=0.064),
        rounded_box((0.133, 0.007, 0.0325), 0.003).moved(y=0.0035),
        rounded_box((0.060, 0.010, 0.029), 0.004).moved(0.012, 0.074),
    ]
    for x, r, h in ((-0.050, 0.010, 0.007), (0.052, 0.0095, 0.008), (-0.030, 0.006, 0.006)):
        chrome.append(
            revolution([(r, 0.0), (r, h - 0.001), (r - 0.001, h), (0.0005, h)], 28, 14).moved(
                x, 0.071
            )
        )
    barrel = [
        (0.025, 0.0),
        (0.025, 0.005),
        (0.0235, 0.006),
        (0.0235, 0.014),
        (0.0245, 0.0145),
        (0.0245, 0.022),
        (0.022, 0.023),
        (0.0215, 0.032),
        (0.0225, 0.033),
        (0.0225, 0.038),
        (0.0205, 0.0385),
        (0.0165, 0.034),
    ]
    chrome.append(revolution(barrel, 56, 70).rotated("x", 90).moved(0.004, 0.034, 0.016))
    glass = [
        revolution([(0.0165, 0.0), (0.012, 0.0028), (0.006, 0.0042), (0.0005, 0.0047)], 36, 14)
        .rotated("x", 90)
        .moved(0.004, 0.034, 0.0495),
        rounded_box((0.015, 0.009, 0.002), 0.0008).moved(0.030, 0.0745, 0.0145),
        rounded_box((0.008, 0.007, 0.002), 0.0008).moved(-0.008, 0.0745, 0.0145),
    ]
    return merged(body).mapped_uv((2.0, 2.0)), merged(chrome), merged(glass)


def leather(size=256):
    u, v = uv_grid(size, size)
    near, second, _ = pattern.cells(u * 26, v * 26, (26, 26), seed=51)
    return mix((0.06, 0.055, 0.05), (0.17, 0.155, 0.14), smoothstep(0.0, 0.3, second - near))


def table():
    """Round top of oiled slats with a brass edge."""
    top = mesh.disc((TABLE_CENTRE[0], TABLE, TABLE_CENTRE[1]), (0, 1, 0), TABLE_RADIUS, 96)
    edge = revolution(
        [
            (TABLE_RADIUS - 0.002, -0.026),
            (TABLE_RADIUS + 0.002, -0.024),
            (TABLE_RADIUS + 0.002, -0.002),
            (TABLE_RADIUS - 0.003, 0.0008),
        ],
        96,
        8,
    )
    uv = (
        np.stack([top.positions[:, 0] - TABLE_CENTRE[0], TABLE_CENTRE[1] - top.positions[:, 2]], -1)
        / (2 * TABLE_RADIUS)
        + 0.5
    )
    return mesh.Mesh(top.positions, top.normals, uv, top.triangles), edge.moved(
        TABLE_CENTRE[0], TABLE, TABLE_CENTRE[1]
    )


def slats(size=1024):
    u, v = uv_grid(size, size)
    count = 11
    x = v * count
    board = np.floor(x).astype(int)
    random = np.random.RandomState(61)
    shift, tone = random.uniform(0, 30, count)[board], random.uniform(-0.12, 0.12, count)[board]
    warp = fbm(u * 2 + shift, x * 0.8, 4, seed=62)
    rings = 0.5 + 0.5 * np.sin(2 * np.pi * (2.4 * x + 2.5 * warp + shift))
    grain = fbm(u * 7 + shift, x * 30, 4, 0.6, seed=63)
    wood = mix(
        (0.30, 0.19, 0.12),
        (0.60, 0.43, 0.28),
        np.clip(0.4 + 0.35 * rings + 0.25 * grain + tone, 0, 1),
    )
    gap = np.abs(x - np.rint(x)) / count
    return wood * smoothstep(0.0015, 0.0035, gap)[..., None]


def railing():
    """Iron railing of the quay's edge at 3.4 m."""
    parts = [
        tube(np.array([[-2.0, y, -3.4], [0.0, y, -3.4], [2.0, y, -3.4]]), r, 10, 4)
        for y, r in ((-0.36, 0.021), (-0.60, 0.010), (-0.84, 0.010))
    ]
    for x in np.arange(-1.75, 2.0, 0.70):
        parts.append(
            revolution(
                [
                    (0.016, -1.2),
                    (0.016, -0.50),
                    (0.022, -0.47),
                    (0.016, -0.44),
                    (0.016, -0.36),
                    (0.024, -0.345),
                    (0.028, -0.318),
                    (0.020, -0.296),
                    (0.0005, -0.288),
                ],
                14,
                30,
            ).moved(x, 0.0, -3.4)
        )
    return merged(parts)


def boat(length, place, turn):
    """Sailing boat: hull, cabin, mast and boom with its furled sail, stays."""

    def hull(u, v):
        s = 2 * v - 1
        beam = 0.17 * length * (1 - np.abs(0.97 * s - 0.03) ** 2.6)
        sheer = 0.10 * length * (1 + 0.45 * s**2 + 0.15 * s)
        a = (u - 0.5) * np.pi
        depth = -0.02 * length
        x = beam * np.sin(a)
        y = depth + (sheer - depth) * (1 - np.maximum(np.cos(a), 0.0) ** 0.7)
        return np.stack([x, y, -0.5 * length * s], -1)

    def deck(u, v):
        port, starboard = hull(np.zeros_like(u), v), hull(np.ones_like(u), v)
        return port + (starboard - port) * u[..., None] - np.array([0, 0.012 * length, 0])

    white = [
        mesh.surface(hull, 20, 36, flip=True),
        mesh.surface(deck, 4, 36, flip=True),
        rounded_box((0.16 * length, 0.055 * length, 0.34 * length), 0.02 * length).moved(
            0, 0.125 * length, 0.02 * length
        ),
    ]
    mast_top = 1.25 * length
    dark = [
        tube(
            np.array(
                [
                    [0, 0.1 * length, -0.10 * length],
                    [0, 0.6 * length, -0.10 * length],
                    [0, mast_top, -0.10 * length],
                ]
            ),
            0.009 * length,
            8,
            6,
        ),
        tube(
            np.array(
                [
                    [0, 0.24 * length, -0.10 * length],
                    [0, 0.24 * length, 0.15 * length],
                    [0, 0.25 * length, 0.40 * length],
                ]
            ),
            0.017 * length,
            10,
            6,
        ),
    ]
    for end in (
        (0, 0.13 * length, -0.50 * length),
        (0, 0.12 * length, 0.49 * length),
        (0.15 * length, 0.1 * length, 0),
        (-0.15 * length, 0.1 * length, 0),
    ):
        top = np.array([0, mast_top * 0.98, -0.10 * length])
        dark.append(tube(np.array([end, 0.5 * (np.array(end) + top), top]), 0.0022 * length, 5, 2))
    put = lambda part: part.rotated("y", turn).moved(*place)
    return put(merged(white)), put(merged(dark))


def garland(start, end, sag, bulbs, swing=0.0):
    """Hanging wire and the places of its bulbs."""
    t = np.linspace(0, 1, 41)
    start, end = np.array(start), np.array(end)

    def wire(s):
        s = np.asarray(s)[..., None]
        return (
            start
            + (end - start) * s
            - np.array([0, 4 * sag, 0]) * s * (1 - s)
            + np.array([swing, 0, 0]) * np.sin(np.pi * s)
        )

    places = wire((np.arange(bulbs) + 0.5) / bulbs)
    sockets = [
        tube(np.array([p + [0, 0.0, 0], p - [0, 0.010, 0], p - [0, 0.020, 0]]), 0.006, 8, 2)
        for p in places
    ]
    return merged([tube(wire(t), 0.0028, 6, 60)] + sockets), places - [0, 0.030, 0]
