#!/usr/bin/python3
"""Makes the scene "night": a lantern on a quay at 2 m, strings of bulbs, a harbour town to 45 m.

Needs python3-numpy and python3-openimageio. Writes beside itself.
"""

import os
import sys

import numpy as np

sys.dont_write_bytecode = True
HERE = os.path.dirname(os.path.abspath(__file__))
sys.path[:0] = [HERE, os.path.join(HERE, "..")]
import harbour
import mesh
import pattern
import quay
from harbour import SCREEN_X, SCREEN_Y, SCREEN_Z, TUNGSTEN, Emitter, emitter
from mesh import merged
from quay import TABLE
from scene_file import Stage, plain, quad, sphere, texture, write_scene

LANTERN, BOTTLE, CAMERA = (-0.235, -2.02), (0.150, -2.14), (0.300, -1.88)
BULB = (1.0, 0.60, 0.23)
BOATS = (
    (5.2, (3.1, harbour.WATER, -14.5), 118.0),
    (4.6, (-4.9, harbour.WATER, -17.5), 62.0),
    (4.2, (8.6, harbour.WATER, -24.0), 100.0),
)
GARLANDS = (
    ((-1.15, 0.52, -1.75), (2.10, 0.86, -5.2), 0.20, 17),
    ((-2.9, 0.95, -5.4), (2.3, 1.22, -4.6), 0.34, 19),
)


def boat_lamps():
    lamps = []
    for length, (x, y, z), turn in BOATS:
        mast = mesh.rotation("y", turn) @ np.array([0.0, 1.27 * length, -0.10 * length])
        lamps.append(emitter((x + mast[0], y + mast[1], z + mast[2]), 3.0, harbour.NEUTRAL, 0.8))
        for along, colour in (
            (-0.48, harbour.RED if turn > 90 else harbour.GREEN),
            (0.10, TUNGSTEN),
            (0.02, TUNGSTEN),
            (-0.06, TUNGSTEN),
        ):
            side = 0.086 if along > -0.4 else 0.0
            spot = mesh.rotation("y", turn) @ np.array(
                [-side * length if turn < 90 else side * length, 0.135 * length, along * length]
            )
            if spot[2] < -0.1 * length and side:
                spot[2] = -spot[2]
            lamps.append(emitter((x + spot[0], y + spot[1], z + spot[2]), 2.6, colour, 0.40))
    return lamps


def near_bulbs():
    """Bulbs of the garlands, 2.6 cm across; brightest where they lie out of focus."""
    wires, lamps = [], []
    for start, end, sag, count in GARLANDS:
        wire, places = quay.garland(start, end, sag, count)
        wires.append(wire)
        for place in places:
            lamp = emitter(place, 1.0, TUNGSTEN, 1.0)
            size_px = 0.026 / (harbour.PIXEL * -place[2])
            spread = (harbour.blur_disc_px(-place[2]) / size_px) ** 2 + 1.0
            level = max(5.0, 0.62 * spread)
            lamps.append(Emitter(lamp.place, 0.026, tuple(level * c for c in BULB)))
    return merged(wires), lamps


def near(stage):
    stage.paint("slats", quay.slats(), "jpg", "clamp", specular=(0.16, 0.15, 0.13), shininess=26)
    stage.paint("label", quay.label(), "png", "clamp")
    stage.paint("leather", quay.leather(), "png", specular=(0.2, 0.2, 0.2), shininess=14)
    materials, add = stage.materials, stage.add
    materials["iron"] = plain((0.055, 0.052, 0.05), (0.30, 0.28, 0.25), 24)
    materials["brass"] = plain((0.26, 0.16, 0.05), (0.7, 0.55, 0.25), 40)
    materials["chrome"] = plain((0.24, 0.24, 0.25), (0.85, 0.85, 0.85), 60)
    materials["lens glass"] = plain((0.010, 0.010, 0.022), (0.6, 0.5, 0.9), 120)
    materials["bottle glass"] = plain((0.018, 0.042, 0.022), (0.75, 0.75, 0.70), 160)
    materials["capsule"] = plain((0.16, 0.025, 0.03), (0.4, 0.3, 0.3), 30)
    materials["wax"] = {
        "model": "phong",
        "emission": [0.30, 0.17, 0.06],
        "ambient": [0.5, 0.45, 0.35],
        "diffuse": [0.5, 0.45, 0.35],
    }
    materials["flame"] = {"model": "unlit", "emission": [14.0, 7.0, 1.9]}
    materials["hull"] = plain((0.42, 0.42, 0.44), (0.2, 0.2, 0.2), 20, ambient=3.0)
    materials["spar"] = plain((0.16, 0.13, 0.10))
    materials["wire"] = plain((0.02, 0.02, 0.02))
    turn = lambda part, angle, place: part.rotated("y", angle).moved(place[0], TABLE, place[1])
    top, edge = quay.table()
    add("table.obj", top, "slats")
    add("table-edge.ply", edge, "brass")
    add("lantern.glb", turn(quay.lantern(), 24, LANTERN), "iron")
    body, flame = quay.candle()
    add("candle.ply", turn(body, 0, LANTERN), "wax")
    add("flame.ply", turn(flame, 0, LANTERN), "flame")
    glass, capsule, paper = quay.bottle()
    add("bottle.ply", turn(glass, 0, BOTTLE), "bottle glass")
    add("bottle-capsule.ply", turn(capsule, 0, BOTTLE), "capsule")
    add("bottle-label.ply", turn(paper, -12, BOTTLE), "label")
    for part, name, material in zip(
        quay.camera(), ("body", "chrome", "glass"), ("leather", "chrome", "lens glass")
    ):
        add(f"camera-{name}.ply", turn(part, -14, CAMERA), material)
    add("railing.ply", quay.railing(), "iron")
    hulls, spars = zip(*(quay.boat(*boat) for boat in BOATS))
    add("boats.ply", merged(hulls), "hull")
    add("spars.ply", merged(spars), "spar")


def main():
    os.chdir(HERE)
    stage = Stage()
    near(stage)
    wires, bulbs = near_bulbs()
    stage.add("garlands.ply", wires, "wire")
    lamps = harbour.far_lamps() + boat_lamps()
    screen = harbour.skyline()
    hulls = []
    for length, (x, y, z), turn in BOATS:
        half = 0.5 * length * abs(np.sin(np.radians(turn))) + 0.17 * length
        hulls.append(((x - half) / -z, (x + half) / -z, z))
    pattern.write_linear("town.exr", screen)
    pattern.write_linear("water.exr", harbour.water(lamps, screen, hulls))
    for name in ("town", "water"):
        stage.textures[name] = texture(f"{name}.exr", "linear", "clamp")
        stage.materials[name] = {"model": "unlit", "emission": {"texture": name}}
    stage.add("water.ply", harbour.water_mesh(), "water")
    stage.objects.append(
        quad(
            (SCREEN_X[0], SCREEN_Y[0], SCREEN_Z),
            (SCREEN_X[1] - SCREEN_X[0], 0, 0),
            (0, SCREEN_Y[1] - SCREEN_Y[0], 0),
            "town",
        )
    )
    names = {}
    for lamp in lamps + bulbs:
        colour = tuple(float(f"{c:.3g}") for c in lamp.radiance)
        if colour not in names:
            names[colour] = f"lamp {len(names) + 1}"
            stage.materials[names[colour]] = {"model": "unlit", "emission": list(colour)}
        stage.objects.append(sphere(lamp.place, 0.5 * lamp.diameter, names[colour]))
    lights = [
        {
            "type": "point",
            "position_m": [LANTERN[0], TABLE + 0.150, LANTERN[1]],
            "intensity": [0.085, 0.048, 0.018],
            "attenuation": [0.012, 0, 1],
        },
        {
            "type": "point",
            "position_m": [0.25, 0.75, -1.20],
            "intensity": [0.55, 0.37, 0.19],
            "attenuation": [0, 0, 1],
        },
        {
            "type": "directional",
            "direction": [0.60, -0.60, -0.55],
            "intensity": [0.045, 0.062, 0.105],
        },
        {
            "type": "point",
            "position_m": [1.1, 0.35, -2.9],
            "intensity": [0.16, 0.10, 0.05],
            "attenuation": [0, 0, 1],
        },
    ]
    write_scene(
        "scene.json",
        "Harbour at night",
        "A lantern, a bottle and a camera in focus at 2 m; strings of bulbs, boats and a town "
        "whose lamps turn into discs. A hundred small emitters from 1.8 m to 44 m.",
        stage,
        lights,
        (0.018, 0.020, 0.030),
        (0.002, 0.003, 0.006),
    )
    levels = [max(lamp.radiance) for lamp in lamps + bulbs]
    sizes = [lamp.diameter for lamp in lamps + bulbs]
    print(
        len(levels),
        "emitters, radiance",
        min(levels),
        max(levels),
        "diameter",
        min(sizes),
        max(sizes),
    )


if __name__ == "__main__":
    main()
