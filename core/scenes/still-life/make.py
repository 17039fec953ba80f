#!/usr/bin/python3
"""Makes the scene "still-life": a table from 0.9 m to 2.9 m, a room behind it to 6 m.

Needs python3-numpy and python3-openimageio. Writes beside itself.
"""

import os
import sys

import numpy as np

sys.dont_write_bytecode = True
HERE = os.path.dirname(os.path.abspath(__file__))
sys.path[:0] = [HERE, os.path.join(HERE, "..")]
import bouquet
import objects as things
import pattern
import pictures
import wares
from mesh import merged, tube
from objects import TABLE, TABLE_X, TABLE_Z, standing
from room import room
from scene_file import Stage, painted, plain, quad, sphere, texture, write_scene

VASE, SHELL, BOWL, CANDLE = (0.08, -2.06), (-0.34, -1.92), (-0.66, -2.58), (0.50, -2.56)
GRAPES = (-0.105, -1.80)


def table(stage):
    wood = pictures.planks(2048, 2048, 7, 1, (0.27, 0.15, 0.08), (0.55, 0.36, 0.21))
    linen = pictures.linen()
    for name, picture, shaded, specular, shininess in (
        ("table", wood, things.shaded_table(wood), 0.14, 30),
        ("linen", linen, things.shaded_cloth(linen), 0.0, 1),
    ):
        pattern.write_picture(f"{name}.jpg", picture)
        pattern.write_picture(f"{name}-shade.jpg", shaded)
        stage.textures[name] = texture(f"{name}.jpg", wrap="clamp")
        stage.textures[f"{name} shade"] = texture(f"{name}-shade.jpg", wrap="clamp")
        stage.materials[name] = dict(
            painted(name, specular=(specular,) * 3, shininess=shininess),
            ambient={"texture": f"{name} shade"},
        )
    width, depth = TABLE_X[1] - TABLE_X[0], TABLE_Z[1] - TABLE_Z[0]
    stage.objects.append(
        quad((TABLE_X[0], TABLE, TABLE_Z[1]), (width, 0, 0), (0, 0, -depth), "table")
    )
    stage.add("runner.ply", things.runner(), "linen")


def hero(stage):
    stage.paint("porcelain", pictures.porcelain(), specular=(0.55, 0.55, 0.55), shininess=140)
    foot, size = TABLE + 0.003, 1.12
    stage.add(
        "vase.ply",
        merged([things.vase(), things.vase_handles().rotated("y", 12)])
        .scaled(size)
        .rotated("y", 14)
        .moved(VASE[0], foot, VASE[1]),
        "porcelain",
    )
    bunch = bouquet.bouquet(VASE[0], VASE[1], foot + 0.288 * size)
    bunch["rose"] = merged([bunch["rose"], bouquet.fallen_petals()])
    stage.paint(
        "rose",
        pictures.petals((0.60, 0.09, 0.19), (0.86, 0.34, 0.41), (0.97, 0.68, 0.66)),
        "png",
        "clamp",
    )
    stage.paint(
        "cream",
        pictures.petals((0.88, 0.60, 0.34), (0.96, 0.85, 0.64), (0.99, 0.95, 0.84)),
        "png",
        "clamp",
    )
    stage.paint("leaf", pictures.foliage(), "jpg", specular=(0.10, 0.12, 0.08), shininess=20)
    stage.materials["daisy"] = plain((0.80, 0.80, 0.76))
    stage.materials["heart"] = plain((0.75, 0.42, 0.03))
    stage.materials["stem"] = plain((0.10, 0.19, 0.06))
    for name, material in (
        ("rose", "rose"),
        ("cream", "cream"),
        ("petal", "daisy"),
        ("heart", "heart"),
        ("leaf", "leaf"),
        ("stem", "stem"),
    ):
        stage.add(f"bouquet-{name}.ply", bunch[name], material)


def fruit_and_shell(stage):
    stage.paint(
        "nautilus", pictures.shell(), wrap="clamp", specular=(0.22, 0.21, 0.20), shininess=45
    )
    stage.materials["pearl"] = plain((0.72, 0.66, 0.62), (0.35, 0.36, 0.40), 25)
    outside, lining = things.nautilus()
    drop = TABLE + 0.003 - outside.positions[:, 1].min()
    stage.add("nautilus.glb", outside.moved(SHELL[0], drop, SHELL[1]), "nautilus")
    stage.add("nautilus-lining.ply", lining.moved(SHELL[0], drop, SHELL[1]), "pearl")
    stage.paint("apple", pictures.apple(), "png", specular=(0.32, 0.32, 0.30), shininess=50)
    stage.paint("pear", pictures.pear(), "png", specular=(0.16, 0.16, 0.13), shininess=24)
    stage.paint(
        "lemon",
        pictures.citrus((0.96, 0.80, 0.16), (0.90, 0.70, 0.08)),
        "png",
        specular=(0.2, 0.2, 0.15),
        shininess=24,
    )
    stage.materials["bark"] = plain((0.09, 0.055, 0.03))
    stems = []

    def fruits(body, stem, places):
        parts = []
        for x, z, turn, tilt, size in places:

            def pose(part):
                return (
                    part.scaled(size).rotated("y", turn).rotated("z", tilt).rotated("x", 0.6 * tilt)
                )

            drop = TABLE + (0.002 if z < -1.62 else 0.0) - pose(body).positions[:, 1].min()
            parts.append(pose(body).moved(x, drop, z))
            stems.append(pose(stem).moved(x, drop, z))
        return merged(parts)

    pear_stem = things.fruit_stem(0.104, 0.024, 0.010).moved(0.011, 0.0, 0.004)
    stage.add(
        "apples.ply",
        fruits(
            things.apple_body(),
            things.fruit_stem(0.056, 0.026, 0.008),
            ((0.345, -1.93, 40, -12, 1.02), (0.435, -2.08, 160, 10, 1.05)),
        ),
        "apple",
    )
    stage.add(
        "pears.ply",
        fruits(
            things.pear_body(),
            pear_stem,
            ((-0.235, -0.98, 200, 4, 1.0), (0.285, -2.13, 60, -5, 1.10)),
        ),
        "pear",
    )
    stage.add("stems.ply", merged(stems), "bark")
    stage.add("lemon.ply", standing(things.lemon().rotated("y", 28), -0.155, -1.16), "lemon")
    grapes(stage)


def grapes(stage):
    """A bunch lying on the runner: three layers of berries, each in the dips of the one below."""
    stage.materials["grape"] = {
        "model": "blinn-phong",
        "ambient": [0.075, 0.022, 0.075],
        "diffuse": [0.085, 0.022, 0.075],
        "specular": [0.5, 0.48, 0.55],
        "shininess": 120,
    }
    stage.materials["green grape"] = {
        "model": "blinn-phong",
        "ambient": [0.20, 0.26, 0.07],
        "diffuse": [0.22, 0.30, 0.07],
        "specular": [0.45, 0.46, 0.42],
        "shininess": 120,
    }
    stalk = tube(
        np.array(
            [
                [0.03, 0.030, 0.0],
                [0.085, 0.028, 0.006],
                [0.118, 0.022, 0.004],
                [0.142, 0.030, -0.006],
            ]
        ),
        lambda s: 0.0019 + 0.0009 * s**4,
        8,
        20,
    ).rotated("y", -16)
    stage.add("stalk.obj", stalk.moved(GRAPES[0], TABLE, GRAPES[1]), "bark")
    random = np.random.RandomState(5)
    turn, radius = np.radians(16.0), 0.0118
    for layer, (length, width) in enumerate(((0.100, 0.050), (0.082, 0.040), (0.055, 0.024))):
        for row in range(-5, 6):
            for column in range(-9, 10):
                a = (2 * column + (row + layer) % 2) * 0.97 * radius
                b = (row * 1.732 + 0.577 * 2 * layer) * 0.97 * radius
                if (a / length) ** 2 + (b / (width * (1.0 - 0.45 * a / length))) ** 2 > 1.0:
                    continue
                a, b, r = (
                    a + random.uniform(-2.6e-3, 2.6e-3),
                    b + random.uniform(-2.6e-3, 2.6e-3),
                    radius * random.uniform(0.92, 1.04),
                )
                x = GRAPES[0] + np.cos(turn) * a - np.sin(turn) * b
                z = GRAPES[1] + np.sin(turn) * a + np.cos(turn) * b
                if random.uniform() < 0.06 * (layer + 1):
                    continue
                rise = layer * 1.55 * radius + random.uniform(0.0, 2e-3)
                stage.objects.append(
                    sphere(
                        (x, TABLE + 0.002 + r + rise, z),
                        r,
                        "grape" if random.uniform() < 0.86 else "green grape",
                    )
                )


def far_table(stage):
    covers, block, _ = wares.books()
    stage.paint(
        "leather", pictures.leather(), "png", "clamp", specular=(0.18, 0.17, 0.13), shininess=18
    )
    stage.paint("pages", pictures.pages(), "png")
    stage.materials["calf"] = plain((0.21, 0.055, 0.03), (0.14, 0.11, 0.09), 16)
    stage.add("book-lower.obj", covers[0], "calf")
    stage.add("book-upper.obj", covers[1], "leather")
    stage.add("book-pages.obj", block, "pages")
    stage.materials["celadon"] = plain((0.10, 0.30, 0.29), (0.45, 0.45, 0.45), 70)
    stage.add("bowl.ply", wares.bowl().moved(BOWL[0], TABLE, BOWL[1]), "celadon")
    stage.paint(
        "citrus",
        pictures.citrus((0.93, 0.53, 0.10), (0.86, 0.40, 0.05)),
        "png",
        specular=(0.20, 0.19, 0.16),
        shininess=22,
    )
    for x, y, z, r in (
        (-0.060, 0.062, 0.030, 0.038),
        (0.030, 0.060, 0.045, 0.037),
        (0.045, 0.064, -0.035, 0.038),
        (-0.035, 0.064, -0.050, 0.039),
        (0.0, 0.112, 0.0, 0.038),
    ):
        stage.objects.append(sphere((BOWL[0] + x, TABLE + y, BOWL[1] + z), r, "citrus"))
    stage.materials["brass"] = plain((0.28, 0.17, 0.05), (0.75, 0.58, 0.26), 45)
    stage.materials["wax"] = plain((0.74, 0.68, 0.54), (0.12, 0.12, 0.10), 12, ambient=1.35)
    stage.materials["flame"] = {"model": "unlit", "emission": [9.0, 4.6, 1.3]}
    body, wick, flame = wares.candle()
    place = lambda part: part.moved(CANDLE[0], TABLE + 0.205, CANDLE[1])
    stage.add("candlestick.ply", wares.candlestick().moved(CANDLE[0], TABLE, CANDLE[1]), "brass")
    stage.add("candle.ply", place(body), "wax")
    stage.add("wick.ply", place(wick), "bark")
    stage.add("flame.ply", place(flame), "flame")


def main():
    os.chdir(HERE)
    stage = Stage()
    for part in (table, hero, fruit_and_shell, far_table, room):
        part(stage)
    lights = [
        {
            "type": "area",
            "corner_m": [-1.9, 0.55, -0.35],
            "edge_u_m": [0.0, 0.9, 0.0],
            "edge_v_m": [0.25, 0.0, -0.9],
            "intensity": [7.5, 7.0, 6.1],
            "attenuation": [0.0, 0.0, 1.0],
        },
        {
            "type": "directional",
            "direction": [-0.75, -0.55, -0.65],
            "intensity": [0.13, 0.14, 0.17],
        },
        {
            "type": "point",
            "position_m": [CANDLE[0], TABLE + 0.385, CANDLE[1]],
            "intensity": [0.16, 0.10, 0.04],
            "attenuation": [0.02, 0.0, 1.0],
        },
        {
            "type": "point",
            "position_m": [1.62, 0.62, -5.70],
            "intensity": [0.17, 0.11, 0.05],
            "attenuation": [0.04, 0.0, 1.0],
        },
    ]
    write_scene(
        "scene.json",
        "Still life",
        "A porcelain vase of roses, a nautilus and fruit in focus at 2 m; a pear at 1 m, books, "
        "a bowl of oranges, a candle, a chair, and a room to 6 m.",
        stage,
        lights,
        (0.20, 0.205, 0.22),
        (0.02, 0.02, 0.022),
    )
    print(stage.triangles, "triangles")


if __name__ == "__main__":
    main()
