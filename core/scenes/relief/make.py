#!/usr/bin/python3
"""Makes the scene "relief": one brickwork as heights, as normals, and laid around shapes.

Needs python3-numpy and python3-openimageio. Writes beside itself.
"""

import os
import sys

import numpy as np

sys.dont_write_bytecode = True
HERE = os.path.dirname(os.path.abspath(__file__))
sys.path.insert(0, os.path.join(HERE, ".."))
import pattern
from pattern import fbm, mix, smoothstep, uv_grid
from scene_file import Stage, painted, plain, quad, sphere, texture, write_scene

SIZE = 512
ROWS, COLUMNS = 8, 4
PERIOD = 0.6  # metres that one picture of the bricks spans on the walls
DEPTH = 0.008  # metres from the joints to the bricks


def bricks():
    """Heights from 0, the joints, to 1, and each brick's own random number."""
    u, v = uv_grid(SIZE, SIZE)
    row = np.floor(ROWS * v)
    column = COLUMNS * u + 0.5 * (row % 2)
    across, down = column % 1.0, (ROWS * v) % 1.0
    # Distance from the joint, in heights of a row.
    edge = np.minimum(np.minimum(across, 1 - across) * ROWS / COLUMNS, np.minimum(down, 1 - down))
    grain = fbm(16 * u, 16 * v, 4, 0.6, (16, 16), seed=2)
    heights = smoothstep(0.04, 0.14, edge) * (0.85 + 0.12 * grain) + 0.03 * (1 + grain)
    tint = np.random.RandomState(7).uniform(size=(ROWS, COLUMNS))
    return heights, tint[row.astype(int), (column % COLUMNS).astype(int)], edge


def normals(heights):
    """Tangent-space normals of the heights as a wall of PERIOD has them: (n + 1)/2."""
    step = 2 * PERIOD / SIZE
    across = DEPTH * (np.roll(heights, -1, 1) - np.roll(heights, 1, 1)) / step
    up = DEPTH * (np.roll(heights, 1, 0) - np.roll(heights, -1, 0)) / step  # row 0 is the top
    n = np.stack([-across, -up, np.ones_like(heights)], -1)
    n /= np.linalg.norm(n, axis=-1, keepdims=True)
    return 0.5 + 0.5 * n


def main():
    os.chdir(HERE)
    heights, tint, edge = bricks()
    stage = Stage()
    clay = mix((0.62, 0.30, 0.22), (0.74, 0.42, 0.30), tint)
    colour = mix((0.66, 0.63, 0.58), clay, smoothstep(0.05, 0.10, edge))
    pattern.write_picture("bricks.jpg", colour)
    pattern.write_picture("heights.png", np.repeat(heights[..., None], 3, -1))
    pattern.write_picture("normals.png", normals(heights))
    stage.textures["bricks"] = texture("bricks.jpg")
    stage.textures["heights"] = texture("heights.png", "linear")
    stage.textures["normals"] = texture("normals.png", "linear")
    clay = painted("bricks", specular=(0.05, 0.05, 0.05), shininess=12)
    bump = {"texture": "heights", "scale_m": DEPTH}
    stage.materials["heights"] = dict(clay, bump=bump)
    stage.materials["normals"] = dict(clay, normal_map={"texture": "normals"})
    stage.materials["smooth"] = clay
    stage.materials["pewter"] = dict(plain((0.22, 0.22, 0.24), (0.5, 0.5, 0.5), 60), bump=bump)
    stage.materials["ground"] = plain((0.45, 0.43, 0.40))

    def wall(x, material):
        mapping = {
            "type": "planar",
            "origin_m": [x, -0.45, -2.3],
            "edge_u_m": [PERIOD, 0, 0],
            "edge_v_m": [0, PERIOD, 0],
        }
        part = quad((x, -0.45, -2.3), (0.58, 0, 0), (0, 1.1, 0), material)
        stage.objects.append(dict(part, mapping=mapping))

    for x, material in ((-0.89, "heights"), (-0.29, "normals"), (0.31, "smooth")):
        wall(x, material)
    stage.objects.append(quad((-4, -0.45, 0), (8, 0, 0), (0, 0, -8), "ground"))
    for x, kind in ((-0.42, "spherical"), (0.42, "cylindrical")):
        mapping = {"type": kind, "origin_m": [x, -0.43, -1.9], "around": 3}
        if kind == "cylindrical":
            mapping["height_m"] = PERIOD / 2
        else:
            mapping["origin_m"][1] = -0.27
        ball = sphere((x, -0.27, -1.9), 0.16, "pewter" if kind == "spherical" else "heights")
        stage.objects.append(dict(ball, mapping=mapping))
    lights = [
        {"type": "directional", "direction": [0.8, -0.5, -0.6], "intensity": [0.75, 0.72, 0.66]},
        {"type": "directional", "direction": [-0.4, -0.3, -0.9], "intensity": [0.10, 0.11, 0.13]},
    ]
    write_scene(
        "scene.json",
        "Brickwork in relief",
        "One brickwork three times on walls at 2.3 m: as a bump map, as a normal map of the same "
        "heights, and smooth; before them two balls with bricks laid round by spherical and "
        "cylindrical mapping.",
        stage,
        lights,
        (0.18, 0.19, 0.22),
        (0.55, 0.65, 0.78),
    )


if __name__ == "__main__":
    main()
