#!/usr/bin/python3
"""Makes the scene "pinhole-series": one flat test target at 2 m (README.md has the numbers).

Needs python3-numpy and python3-openimageio. Writes beside itself.
"""

import os
import sys

import numpy as np

sys.dont_write_bytecode = True
sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), ".."))
import mesh
import pattern
from scene_file import Stage, quad, texture, write_scene

# Lengths are millimetres on the screen of a pinhole camera with f' = 50 mm: 1 mm is 40 mm here.
DISTANCE = 2.0
METRES = DISTANCE / 50.0
PAPER, INK = 0.8, 0.05
PAGE = (52.0, 38.0)
STAR = {"centre": (-7.2, -1.2), "cycles": 16, "diameter": 12.4}
STAR_MEAN, STAR_AMPLITUDE = 0.425, 0.375
SQUARE = {"centre": (9.0, -1.2), "side": 9.6, "slant_degrees": 5.0}
BAR_FREQUENCIES = (0.5, 1.0, 1.5, 2.0, 3.0, 4.0, 5.0, 6.0, 8.0, 10.0)
BARS, BAR_HEIGHT, BAR_BASE = 4, 1.9, -11.3
GREYS = (0.7, 0.5, 0.3, 0.15, 0.05)
TEXT = {"centre": (0.0, 9.1), "size": (34.0, 4.4)}
LINES = (  # text, left, base and height in millimetres from the text's lower left corner
    ("PINHOLE CAMERA", 0.3, 2.1, 1.7),
    ("WHAT DIAMETER IS SHARPEST", 0.3, 0.5, 0.95),
    ("NEITHER THE LARGEST", 24.6, 3.05, 0.50),
    ("NOR THE SMALLEST HOLE", 24.6, 2.30, 0.40),
    ("BUT ONE OF A QUARTER", 24.6, 1.65, 0.32),
    ("OF A MILLIMETRE", 24.6, 1.10, 0.26),
    ("0123456789", 24.6, 0.62, 0.20),
    ("ABCDEFGHIJKLMNOPQRSTUVWXYZ", 24.6, 0.25, 0.16),
)
TEXELS_PER_MM = 60


def star_mesh():
    """A fan whose u runs through `cycles` periods in a turn: exact at any distance from its centre,
    but for steps of 1/32 period there."""
    count = STAR["cycles"] * 32
    turns = np.arange(count + 1) / count
    radius = 0.5 * STAR["diameter"] / np.cos(np.pi / count)  # chords touch the circle
    rim = np.stack([np.cos(2 * np.pi * turns), np.sin(2 * np.pi * turns), 0 * turns], 1) * radius
    centre = np.array([*STAR["centre"], 0.0])
    corners = np.stack([np.tile(centre, (count, 1)), centre + rim[:-1], centre + rim[1:]], 1)
    u = STAR["cycles"] * np.stack([(turns[:-1] + turns[1:]) / 2, turns[:-1], turns[1:]], 1)
    scale = METRES * (1.0 - 0.0001)
    positions = corners.reshape(-1, 3) * scale + [0.0, 0.0, -DISTANCE * (1.0 - 0.0001)]
    uvs = np.stack([u.reshape(-1), np.full(u.size, 0.5)], 1)
    return mesh.Mesh(
        positions,
        np.tile([0.0, 0.0, 1.0], (len(positions), 1)),
        uvs,
        np.arange(len(positions)).reshape(-1, 3),
    )


def wave_picture(size=256):
    """Linear radiance of one period along u."""
    u, _ = pattern.uv_grid(size, 1)
    return (STAR_MEAN + STAR_AMPLITUDE * np.cos(2 * np.pi * u))[..., None]


def text_picture():
    """Lines of falling size, code values; strokes a seventh of their letters' height."""
    width, height = (round(side * TEXELS_PER_MM) for side in TEXT["size"])
    u, v = pattern.uv_grid(width, height)
    x, y = u * TEXT["size"][0], v * TEXT["size"][1]
    coverage = np.zeros(u.shape)
    for text, left, base, letters in LINES:
        rows = np.nonzero(np.abs(v[:, 0] * TEXT["size"][1] - base - letters / 2) <= letters)[0]
        part = slice(rows[0], rows[-1] + 1)
        distance = pattern.text_distance(x[part], y[part], text, left, base, letters)
        stroke = pattern.ink(distance, letters / 14.0, 1.0 / TEXELS_PER_MM)
        coverage[part] = np.maximum(coverage[part], stroke)
    radiance = PAPER + (INK - PAPER) * coverage
    return np.repeat(pattern.srgb_from_linear(radiance)[..., None], 3, axis=2)


def patch(centre, size, material, layer=0, turn_degrees=0.0):
    """A rectangle on the target; `layer` steps of 0.01 % in front of the paper."""
    scale = METRES * (1.0 - 0.0001 * layer)
    turn = mesh.rotation("z", turn_degrees)
    across = turn @ np.array([size[0] * scale, 0.0, 0.0])
    up = turn @ np.array([0.0, size[1] * scale, 0.0])
    place = np.array([centre[0] * scale, centre[1] * scale, -DISTANCE * (1.0 - 0.0001 * layer)])
    return quad(place - across / 2 - up / 2, across, up, material)


def bars():
    """Groups of bars, frequencies in cycles per millimetre from left to right."""
    quads, left = [], -17.2
    for frequency in BAR_FREQUENCIES:
        period = 1.0 / frequency
        for k in range(BARS):
            x = left + (k + 0.25) * period
            y = BAR_BASE + BAR_HEIGHT / 2
            quads.append(patch((x, y), (period / 2, BAR_HEIGHT), "ink", 1))
        left += (BARS - 0.5) * period + 1.4
    return quads


def greys():
    return [
        patch((15.9, 2.6 - 1.9 * k), (2.2, 1.9), f"grey {value:g}", 1)
        for k, value in enumerate(GREYS)
    ]


def unlit(value):
    return {"model": "unlit", "emission": [value] * 3}


def main():
    os.chdir(os.path.dirname(os.path.abspath(__file__)))
    stage = Stage()
    pattern.write_linear("wave.exr", wave_picture())
    stage.textures["star"] = dict(texture("wave.exr", "linear"), filter="bilinear")
    stage.materials["star"] = {"model": "unlit", "emission": {"texture": "star"}}
    stage.glow("text", text_picture())
    stage.textures["text"]["filter"] = "bilinear"
    stage.materials["paper"], stage.materials["ink"] = unlit(PAPER), unlit(INK)
    stage.materials.update({f"grey {value:g}": unlit(value) for value in GREYS})
    square = (SQUARE["side"], SQUARE["side"])
    stage.objects = [
        patch((0.0, 0.0), PAGE, "paper"),
        patch(SQUARE["centre"], square, "ink", 1, SQUARE["slant_degrees"]),
        patch(TEXT["centre"], TEXT["size"], "text", 1),
    ]
    stage.objects += bars() + greys()
    stage.add("star.ply", star_mesh(), "star", "flat")
    write_scene(
        "scene.json",
        "Pinhole series",
        "A flat target at 2 m for pinholes of 2 to 0.05 mm at 50 mm: sinusoidal star, slanted "
        "square, bars, letters of 1.7 to 0.16 mm on the screen. Unlit, radiances stated.",
        stage,
        [],
        (0.0, 0.0, 0.0),
        (PAPER, PAPER, PAPER),
    )


if __name__ == "__main__":
    main()
