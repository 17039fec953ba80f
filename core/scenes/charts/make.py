#!/usr/bin/python3
"""Makes the scene "charts": six test cards at staggered distances (README.md has the numbers).

Needs python3-numpy and python3-openimageio. Writes beside itself.
"""

import os
import sys

import numpy as np

sys.dont_write_bytecode = True
sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), ".."))
import mesh
import pattern
from scene_file import Stage, plain, quad, texture, write_scene

# One default pixel covers PIXEL * d at distance d: pitch 36 mm / 960 over the image distance
# 1 / (1/50 mm - 1/2 m) = 2/39 m.
PIXEL = 0.036 / 960 * 19.5
DISTANCES = (1.0, 1.4, 2.0, 3.0, 4.5, 7.0)
CARD = (272.0, 264.0)
COLUMN_CENTRES = (-308.0, 0.0, 308.0)
ROW_CENTRES = (-151.0, 151.0)  # near cards below, far cards above
STAR = {"cycles": 24, "diameter": 138.0, "side": 142.0, "mean": 0.5, "amplitude": 0.45}
FACE, DARK, BRIGHT, SLANT_DEGREES = 0.55, 0.1, 0.8, 5.0
GREYS = (0.02, 0.05, 0.1, 0.2, 0.4, 0.8)
HUES = (
    (0.5, 0.05, 0.05),
    (0.5, 0.3, 0.03),
    (0.05, 0.4, 0.08),
    (0.03, 0.35, 0.45),
    (0.05, 0.1, 0.5),
    (0.4, 0.06, 0.4),
)
POINT_COLUMNS = (40.0, 88.0, 136.0, 184.0, 232.0)
FALLING = ((2.0, 128.0), (2.0, 64.0), (2.0, 32.0), (2.0, 16.0), (2.0, 8.0))  # side px, radiance
GROWING = ((1.0, 256.0), (1.5, 113.7778), (2.0, 64.0), (3.0, 28.4444), (4.0, 16.0))
FLOOR = -0.9
WALL = -9.5


def star_picture(size=1024):
    """Linear radiance of the sinusoidal star; outside its circle the card's face."""
    u, v = pattern.uv_grid(size, size)
    x, y = (u - 0.5) * STAR["side"], (v - 0.5) * STAR["side"]
    radiance = STAR["mean"] + STAR["amplitude"] * np.cos(STAR["cycles"] * np.arctan2(y, x))
    radiance = np.where(np.hypot(x, y) <= 0.5 * STAR["diameter"], radiance, FACE)
    return radiance[..., None]


def label_picture(text, width=512, height=128):
    """Distance in black on the code value nearest to the face's radiance."""
    u, v = pattern.uv_grid(width, height)
    distance = pattern.text_distance(u * width, v * height, text, 14.0, 16.0, 96.0)
    shade = 1.0 - pattern.ink(distance, 8.0, 2.0)
    paper = np.rint(255.0 * pattern.srgb_from_linear(FACE)) / 255.0
    return np.repeat((shade * paper)[..., None], 3, axis=2)


def backdrop_picture(size=512):
    """Painted wall: a soft pool of light on slate, with the grain of a roller."""
    u, v = pattern.uv_grid(size, size)
    glow = np.exp(-(((u - 0.5) / 0.30) ** 2) - ((v - 0.56) / 0.26) ** 2)
    grain = pattern.fbm(u * 24, v * 24, 5, 0.7, (24, 24), seed=3)
    return pattern.mix((0.10, 0.11, 0.13), (0.27, 0.30, 0.34), glow) * (1 + 0.10 * grain)[..., None]


def floor_picture(size=512):
    """One square metre of floor: a dark slab with a pale joint and decimetre ticks."""
    u, v = pattern.uv_grid(size, size)
    grain = pattern.fbm(u * 12, v * 12, 5, 0.6, (12, 12), seed=8)
    slab = pattern.mix((0.15, 0.155, 0.165), (0.20, 0.205, 0.22), 0.5 + 0.5 * grain)
    to_joint = np.minimum(np.minimum(u, 1 - u), np.minimum(v, 1 - v))
    return pattern.mix(slab, (0.42, 0.44, 0.47), 1 - pattern.smoothstep(0.006, 0.012, to_joint))


def stand(distance, x, bottom):
    """Post, foot and clamp of one card, in metres."""
    post = mesh.tube(
        np.array(
            [
                [x, FLOOR + 0.01, -distance],
                [x, 0.5 * (FLOOR + bottom), -distance],
                [x, bottom + 0.012, -distance],
            ]
        ),
        0.008,
        16,
        2,
    )
    foot = mesh.revolution(
        [(0.0005, 0.034), (0.02, 0.03), (0.03, 0.02), (0.16, 0.012), (0.17, 0.008), (0.17, 0.0)][
            ::-1
        ],
        32,
        14,
    ).moved(x, FLOOR, -distance)
    clamp = mesh.rounded_box((0.05, 0.03, 0.02), 0.004).moved(x, bottom, -distance)
    return mesh.merged([post, foot, clamp]).moved(z=-0.012 - 0.001 * distance)


def card(distance, column, row, label):
    """Quads of one card; features that are measured lie exactly at `distance`."""
    left = column - CARD[0] / 2
    base = row - CARD[1] / 2
    scale = PIXEL * distance

    def patch(x, y, width, height, material, layer, turn_degrees=0.0):
        """A rectangle by its centre in card pixels; `layer` steps of 0.03 % behind the feature."""
        depth = distance * (1.0 + 0.0003 * layer)
        across = mesh.rotation("z", turn_degrees) @ np.array([width * scale, 0.0, 0.0])
        up = mesh.rotation("z", turn_degrees) @ np.array([0.0, height * scale, 0.0])
        centre = np.array([(left + x) * scale, (base + y) * scale, -depth])
        return quad(centre - across / 2 - up / 2, across, up, material)

    quads = [
        patch(136, 132, 280, 272, "frame", 3),
        patch(136, 132, *CARD, "face", 2),
        patch(79, 151, STAR["side"], STAR["side"], "star", 0),
        patch(208, 151, 112, 142, "dark", 1),
        patch(208, 151, 46, 46, "bright", 0, SLANT_DEGREES),
        patch(136, 40, 256, 64, "black", 1),
        patch(64, 243, 112, 28, label, 0),
    ]
    for k in range(6):
        quads.append(patch(149 + 20 * k, 250, 20, 14, f"grey {GREYS[k]:g}", 0))
        quads.append(patch(149 + 20 * k, 236, 20, 14, f"hue {k + 1}", 0))
    for height, row_of_points in ((54.0, FALLING), (26.0, GROWING)):
        for x, (side, radiance) in zip(POINT_COLUMNS, row_of_points):
            quads.append(patch(x, height, side, side, f"point {radiance:g}", 0))
    return quads


def unlit(*color):
    return {"model": "unlit", "emission": list(color) if len(color) == 3 else [color[0]] * 3}


def fill_materials(stage):
    stage.textures["star"] = dict(texture("star.exr", "linear", "clamp"), filter="bilinear")
    stage.materials["star"] = {"model": "unlit", "emission": {"texture": "star"}}
    stage.glow("backdrop", backdrop_picture())
    stage.paint("floor", floor_picture(), "png", specular=(0.10, 0.10, 0.11), shininess=24)
    stage.materials["steel"] = plain((0.10, 0.105, 0.11), (0.5, 0.5, 0.5), 40)
    levels = {"face": FACE, "frame": 0.02, "dark": DARK, "bright": BRIGHT, "black": 0.0}
    levels.update({f"grey {value:g}": value for value in GREYS})
    levels.update({f"point {radiance:g}": radiance for _, radiance in FALLING + GROWING})
    stage.materials.update({name: unlit(value) for name, value in levels.items()})
    stage.materials.update({f"hue {k + 1}": unlit(*hue) for k, hue in enumerate(HUES)})


def main():
    os.chdir(os.path.dirname(os.path.abspath(__file__)))
    stage = Stage()
    pattern.write_linear("star.exr", star_picture())
    fill_materials(stage)
    stands = []
    for k, distance in enumerate(DISTANCES):
        label = f"label-{distance:.1f}"
        stage.glow(label, label_picture(f"{distance:.1f} m"))
        column, row = COLUMN_CENTRES[k % 3], ROW_CENTRES[k // 3]
        stage.objects += card(distance, column, row, label)
        scale = PIXEL * distance
        stands.append(stand(distance, column * scale, (row - CARD[1] / 2) * scale))
    stage.add("stands.obj", mesh.merged(stands), "steel")
    floor = mesh.Mesh(
        np.array([[-5, FLOOR, 0], [5, FLOOR, 0], [5, FLOOR, WALL], [-5, FLOOR, WALL]], float),
        np.tile([0.0, 1.0, 0.0], (4, 1)),
        np.array([[-5, 0], [5, 0], [5, -WALL], [-5, -WALL]], float) + [0.5, 0.0],
        np.array([[0, 1, 2], [0, 2, 3]]),
    )
    stage.add("floor.obj", floor, "floor")
    stage.objects.append(quad((-5, FLOOR, WALL), (10, 0, 0), (0, 5, 0), "backdrop"))
    lights = [
        {"type": "directional", "direction": [0.4, -1.0, -0.5], "intensity": [0.55, 0.56, 0.6]},
        {
            "type": "spot",
            "position_m": [0.0, 3.2, -3.0],
            "direction": [0.0, -0.75, -1.0],
            "exponent": 6,
            "intensity": [5.0, 4.6, 4.0],
            "attenuation": [0.0, 0.0, 1.0],
        },
    ]
    write_scene(
        "scene.json",
        "Test charts",
        "Six cards at 1, 1.4, 2, 3, 4.5 and 7 m, each as large in the image as the next: "
        "sinusoidal star, slanted square, bright points, grey steps. Unlit, radiances stated.",
        stage,
        lights,
        (0.45, 0.45, 0.5),
        (0.01, 0.011, 0.013),
    )


if __name__ == "__main__":
    main()
