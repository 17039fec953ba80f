"""Made things on the table: books, bowl, candlestick, candle."""

import numpy as np

import pattern
from mesh import merged, revolution, rounded_box, tube
from objects import BOOKS, TABLE


def books():
    """Two closed books: boards with a rounded spine, and the block of pages."""
    covers, blocks, base = [], [], TABLE
    for k, thickness in enumerate(BOOKS["thickness"]):
        length, width = BOOKS["size"][0] - 0.012 * k, BOOKS["size"][1] - 0.010 * k
        board = 0.003
        parts = [
            rounded_box((length, board, width), 0.0012).moved(y=board / 2),
            rounded_box((length, board, width), 0.0012).moved(y=thickness - board / 2),
            revolution([(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)], 24, 24)
            .moved(y=-0.5)
            .rotated("z", 90)
            .scaled(length, thickness / 2, 0.007)
            .moved(y=thickness / 2, z=-width / 2)
            .mapped_uv((0.1, 0.1), (0.2, 0.3)),
        ]
        block = rounded_box((length - 0.008, thickness - 2 * board, width - 0.004), 0.0005).moved(
            y=thickness / 2
        )
        turn = BOOKS["turn"] - 14.0 * k
        place = lambda part: part.rotated("y", turn + 180).moved(
            BOOKS["centre"][0], base, BOOKS["centre"][1]
        )
        covers.append(place(merged(parts)))
        blocks.append(place(block))
        base += thickness
    return covers, merged(blocks), base


def bowl():
    profile = [
        (0.0006, 0.004),
        (0.040, 0.003),
        (0.045, 0.0),
        (0.048, 0.004),
        (0.046, 0.012),
        (0.075, 0.026),
        (0.110, 0.055),
        (0.132, 0.091),
        (0.1345, 0.0975),
        (0.1295, 0.0985),
        (0.107, 0.062),
        (0.072, 0.032),
        (0.030, 0.021),
        (0.0006, 0.020),
    ]
    return revolution(profile, 64, 56)


def candlestick():
    profile = [
        (0.058, 0.0),
        (0.060, 0.004),
        (0.056, 0.009),
        (0.040, 0.013),
        (0.020, 0.022),
        (0.012, 0.034),
        (0.017, 0.044),
        (0.012, 0.054),
        (0.010, 0.085),
        (0.013, 0.120),
        (0.022, 0.134),
        (0.013, 0.147),
        (0.012, 0.160),
        (0.020, 0.172),
        (0.034, 0.178),
        (0.036, 0.181),
        (0.030, 0.182),
        (0.016, 0.180),
        (0.0145, 0.183),
        (0.0150, 0.205),
        (0.0130, 0.206),
        (0.0125, 0.195),
    ]
    return revolution(profile, 32, 72)


def candle():
    def wax(p, u, v):
        drip = 0.0016 * pattern.smoothstep(
            0.2, 0.7, pattern.noise(u * 9, v * 2.2, (9, 256), seed=3)
        )
        return p * np.stack([1 + drip / 0.0105, np.ones_like(u), 1 + drip / 0.0105], -1)

    body = revolution(
        [
            (0.0105, 0.0),
            (0.0105, 0.05),
            (0.0105, 0.105),
            (0.0100, 0.112),
            (0.0085, 0.113),
            (0.0030, 0.109),
            (0.0005, 0.108),
        ],
        28,
        30,
        wax,
    )
    flame = revolution(
        [
            (0.0004, 0.0),
            (0.0035, 0.003),
            (0.0052, 0.009),
            (0.0040, 0.018),
            (0.0016, 0.027),
            (0.0003, 0.033),
        ],
        16,
        20,
    )
    wick = tube(np.array([[0, 0.105, 0], [0, 0.112, 0], [0.001, 0.119, 0]]), 0.0009, 6, 3)
    return body, wick, flame.moved(y=0.116)
