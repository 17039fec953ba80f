#!/usr/bin/python3
"""Makes the scene "fence": thin iron bars at 0.8 m before a garden wall in focus at 2 m.

Needs python3-numpy and python3-openimageio. Writes beside itself.
"""

import os
import sys

import numpy as np

sys.dont_write_bytecode = True
HERE = os.path.dirname(os.path.abspath(__file__))
sys.path[:0] = [HERE, os.path.join(HERE, "..")]
import bars
import garden
import mesh
import pictures
from garden import LEDGE, WALL
from mesh import merged
from scene_file import Stage, plain, quad, write_scene

POTS = (
    ("geranium", (-0.50, WALL + 0.15), 0.150, 3),
    ("daisies", (-0.235, WALL + 0.17), 0.125, 4),
    ("lavender", (0.005, WALL + 0.14), 0.140, 5),
    ("geranium", (0.80, WALL + 0.15), 0.135, 6),
)
LAWN = -0.62


def paint_all(stage):
    stage.paint("bricks", pictures.bricks(), "jpg")
    stage.paint("stone", pictures.stone(), "jpg", "repeat")
    stage.paint("ivy", pictures.ivy(), "png", "clamp", specular=(0.10, 0.11, 0.09), shininess=16)
    stage.paint(
        "leaf", pictures.young_leaf(), "png", "clamp", specular=(0.07, 0.08, 0.05), shininess=14
    )
    stage.paint("terracotta", pictures.terracotta(), "jpg", "repeat")
    stage.paint(
        "rambler",
        pictures.rose_petals((0.96, 0.50, 0.36), (0.99, 0.76, 0.58), (1.0, 0.90, 0.80)),
        "png",
        "clamp",
    )
    stage.paint(
        "geranium",
        pictures.petals((0.45, 0.03, 0.06), (0.86, 0.07, 0.12), (0.95, 0.20, 0.20), 0.18),
        "png",
        "clamp",
    )
    stage.paint(
        "lavender",
        pictures.petals((0.26, 0.18, 0.42), (0.42, 0.30, 0.68), (0.62, 0.50, 0.86), 0.2),
        "png",
        "clamp",
    )
    stage.paint("meadow", pictures.meadow(), "jpg", "repeat")
    stage.paint("rust", pictures.rust(), "jpg", "repeat", specular=(0.16, 0.15, 0.14), shininess=12)
    stage.glow("view", pictures.distance_view(), "jpg", 0.95)
    stage.materials["daisy"] = plain((0.68, 0.68, 0.64))
    stage.materials["heart"] = plain((0.72, 0.42, 0.03))
    stage.materials["soil"] = plain((0.05, 0.035, 0.025))
    stage.materials["stem"] = plain((0.12, 0.20, 0.06))
    stage.materials["bark"] = plain((0.13, 0.09, 0.06))


def plant_pots(stage):
    pots, soils, leaves, stems = [], [], [], []
    flowers = {"geranium": [], "daisies": [], "lavender": []}
    hearts = []
    for kind, place, height, seed in POTS:
        clay, soil = garden.pot(height)
        turn = 61.0 * seed
        pots.append(clay.rotated("y", turn).moved(place[0], LEDGE, place[1]))
        soils.append(soil.moved(place[0], LEDGE, place[1]))
        parts = garden.potted(kind, place, height, seed)
        leaves += parts["leaf"]
        stems += parts["stem"]
        flowers[kind] += parts["flower"]
        hearts += parts["heart"]
    stage.add("pots.ply", merged(pots), "terracotta")
    stage.add("soil.obj", merged(soils), "soil")
    stage.add("pot-leaves.ply", merged(leaves), "leaf")
    stage.add("pot-stems.ply", merged(stems), "stem")
    stage.add("geraniums.ply", merged(flowers["geranium"]), "geranium")
    stage.add("daisies.ply", merged(flowers["daisies"]), "daisy")
    stage.add("daisy-hearts.ply", merged(hearts), "heart")
    stage.add("lavender.ply", merged(flowers["lavender"]), "lavender")


def main():
    os.chdir(HERE)
    stage = Stage()
    paint_all(stage)
    stage.add("wall.obj", garden.wall_front(), "bricks")
    stage.add("arch.glb", garden.arch_soffit(), "stone")
    stage.add("ledge.glb", garden.ledge_and_coping(), "stone")
    leaves, stems = garden.climbing_ivy()
    stage.add("ivy.ply", leaves, "ivy")
    stage.add("ivy-stems.ply", stems, "bark")
    rose = garden.rambler()
    stage.add("rambler.ply", rose["rose"], "rambler")
    stage.add("rambler-leaves.ply", rose["leaf"], "leaf")
    stage.add("rambler-stems.ply", rose["stem"], "bark")
    plant_pots(stage)
    crowns, trunks = zip(
        *(
            garden.tree(*spec)
            for spec in (
                ((0.62, LAWN, -5.2), 1.15, 0.62, 700, 1),
                ((1.9, LAWN, -7.5), 1.5, 0.85, 700, 2),
                ((0.75, LAWN, -9.5), 1.3, 0.80, 600, 3),
            )
        )
    )
    stage.add("tree-leaves.ply", merged(crowns), "leaf")
    stage.add("trunks.ply", merged(trunks), "bark")
    lawn = mesh.Mesh(
        np.array([[-6, LAWN, -2.2], [8, LAWN, -2.2], [8, LAWN, -24], [-6, LAWN, -24]], float),
        np.tile([0.0, 1.0, 0.0], (4, 1)),
        np.array([[-2, 0], [2.67, 0], [2.67, 7.27], [-2, 7.27]]),
        np.array([[0, 1, 2], [0, 2, 3]]),
    )
    stage.add("lawn.obj", lawn, "meadow")
    stage.objects.append(quad((-4, -2.0, -30), (18, 0, 0), (0, 8, 0), "view"))
    stage.add("bars.ply", bars.fence(), "rust")
    leaves, stems = bars.tendril()
    stage.add("tendril-leaves.ply", leaves, "leaf")
    stage.add("tendril.ply", stems, "stem")
    lights = [
        {"type": "directional", "direction": [0.62, -0.72, -0.62], "intensity": [1.18, 1.10, 0.94]},
        {"type": "directional", "direction": [-0.5, -0.3, -0.9], "intensity": [0.14, 0.16, 0.20]},
    ]
    write_scene(
        "scene.json",
        "Fence and garden wall",
        "Iron bars of 6 to 12 mm at 0.8 m, seen through when the lens is wide open; behind them a "
        "brick wall with ivy, roses and pots in focus at 2 m, and through its arch trees and sky.",
        stage,
        lights,
        (0.36, 0.39, 0.44),
        (0.45, 0.62, 0.85),
    )
    print(stage.triangles, "triangles")


if __name__ == "__main__":
    main()
