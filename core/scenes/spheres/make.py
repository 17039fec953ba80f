#!/usr/bin/python3
"""Makes the scene "spheres": Phong materials and interpolations over a checker to the horizon.

Needs python3-numpy and python3-openimageio. Writes beside itself.
"""

import os
import sys

import numpy as np

sys.dont_write_bytecode = True
HERE = os.path.dirname(os.path.abspath(__file__))
sys.path.insert(0, os.path.join(HERE, ".."))
import mesh
import pattern
from pattern import fbm, ink, mix, smoothstep, uv_grid
from scene_file import Stage, plain, quad, sphere, write_scene

GROUND = -0.26
FAR = 400.0


def sky_picture(width=1024, height=512):
    """Late afternoon over the plain; the horizon is the lower edge."""
    u, v = uv_grid(width, height)
    sky = pattern.ramp(
        v,
        (0.0, (0.98, 0.86, 0.70)),
        (0.10, (0.88, 0.86, 0.80)),
        (0.35, (0.55, 0.72, 0.86)),
        (1.0, (0.20, 0.42, 0.70)),
    )
    cloud = fbm(u * 6, v * 13 + 0.4, 6, 0.55, seed=3) - 0.25 * (v - 0.5)
    lit = mix((0.80, 0.74, 0.72), (1.0, 0.97, 0.92), smoothstep(0.1, 0.5, cloud))
    picture = mix(sky, lit, 0.9 * smoothstep(0.02, 0.30, cloud) * smoothstep(0.02, 0.15, v))
    crest = 0.018 + 0.022 * fbm(u * 9, u * 0, 5, 0.5, seed=4)
    return mix(picture, (0.47, 0.50, 0.58), smoothstep(0.003, -0.003, v - crest))


def ground_picture(size=1024):
    """Four stones of the pavement: two pale, two dark, with veins and worn edges."""
    u, v = uv_grid(size, size)
    dark = ((np.floor(2 * u) + np.floor(2 * v)) % 2).astype(bool)
    cloud = fbm(u * 6, v * 6, 6, 0.6, (6, 6), seed=11)
    vein = ink(np.abs(fbm(u * 4, v * 4, 5, 0.55, (4, 4), seed=12)), 0.012, 0.03)
    pale = mix((0.80, 0.77, 0.71), (0.90, 0.88, 0.83), 0.5 + 0.5 * cloud)
    pale = mix(pale, (0.66, 0.62, 0.57), 0.7 * vein)
    slate = mix((0.17, 0.20, 0.23), (0.27, 0.30, 0.33), 0.5 + 0.5 * cloud)
    slate = mix(slate, (0.50, 0.52, 0.53), 0.6 * vein)
    stone = np.where(dark[..., None], slate, pale)
    seam = np.minimum(np.abs(2 * u - np.rint(2 * u)), np.abs(2 * v - np.rint(2 * v)))
    return stone * (0.55 + 0.45 * smoothstep(0.004, 0.012, seam))[..., None]


def globe_picture(width=1024, height=512):
    """A made-up planet: seas, shores, forests, ice; drawn on the sphere so that poles are clean."""
    u, v = uv_grid(width, height)
    longitude, latitude = 2 * np.pi * u, np.pi * (v - 0.5)
    x, y, z = (
        np.cos(latitude) * np.sin(longitude),
        np.sin(latitude),
        np.cos(latitude) * np.cos(longitude),
    )
    land = (
        fbm(1.9 * x + 7, 1.9 * y + 3, 6, 0.55, seed=21)
        + fbm(1.9 * y + 5, 1.9 * z + 11, 6, 0.55, seed=22)
        + fbm(1.9 * z + 2, 1.9 * x + 9, 6, 0.55, seed=23)
    )
    sea = mix((0.05, 0.14, 0.33), (0.12, 0.36, 0.52), smoothstep(-0.8, 0.05, land))
    soil = pattern.ramp(
        np.clip(land, 0, 0.9),
        (0.0, (0.80, 0.74, 0.52)),
        (0.08, (0.42, 0.56, 0.26)),
        (0.35, (0.24, 0.40, 0.18)),
        (0.6, (0.55, 0.46, 0.34)),
        (0.9, (0.93, 0.92, 0.90)),
    )
    picture = np.where((land > 0.05)[..., None], soil, sea)
    return mix(picture, (0.95, 0.96, 0.97), smoothstep(0.80, 0.90, np.abs(y) + 0.12 * land))


def marble_picture(width=1024, height=512):
    u, v = uv_grid(width, height)
    longitude, latitude = 2 * np.pi * u, np.pi * (v - 0.5)
    x, y, z = (
        np.cos(latitude) * np.sin(longitude),
        np.sin(latitude),
        np.cos(latitude) * np.cos(longitude),
    )
    warp = fbm(2.6 * x + 4, 2.6 * y + 8, 6, 0.55, seed=31) + fbm(
        2.6 * z + 6, 2.6 * y + 2, 6, 0.55, seed=32
    )
    line = np.abs(np.sin(3.0 * (x + 0.6 * y) + 4.0 * warp))
    white = mix((0.87, 0.86, 0.84), (0.95, 0.945, 0.93), 0.5 + 0.5 * warp)
    return mix(white, (0.34, 0.35, 0.38), 0.85 * (1 - smoothstep(0.0, 0.30, line)) ** 1.5)


def coarse_ball(radius, nu=22, nv=13):
    """A ball of few facets, so that the three interpolations differ to the eye."""

    def point(u, v):
        a, b = 2 * np.pi * u, np.pi * (np.clip(v, 0, 1) - 0.5)
        return radius * np.stack([np.cos(b) * np.sin(a), np.sin(b), np.cos(b) * np.cos(a)], -1)

    return mesh.surface(point, nu, nv)


def torus_knot(radius, thickness, nu=28, nv=360):
    t = np.linspace(0.0, 1.0, nv + 1)
    a = 2 * np.pi * t
    r = radius * (1.0 + 0.42 * np.cos(3 * a))
    path = np.stack([r * np.cos(2 * a), r * np.sin(2 * a), 0.46 * radius * np.sin(3 * a)], -1)
    centres = mesh.curve(path, 4000)
    return mesh.tube(lambda s: centres(s), thickness, nu, nv, closed=True)


BALLS = (
    ((-0.185, -1.05), 0.058, "red glaze"),
    ((0.125, -1.26), 0.052, "marble"),
    ((0.435, -1.52), 0.090, "chrome"),
    ((-0.475, -1.60), 0.070, "blue lacquer"),
    ((-0.80, -3.0), 0.22, "globe"),
    ((0.42, -3.6), 0.20, "teal satin"),
    ((-0.32, -4.4), 0.27, "marble"),
    ((1.75, -5.2), 0.36, "globe"),
    ((-1.75, -6.2), 0.42, "chalk"),
    ((0.60, -7.5), 0.48, "red glaze"),
    ((-1.1, -11.0), 0.70, "blue lacquer"),
    ((2.9, -12.0), 0.80, "chalk"),
    ((-5.2, -19.0), 1.3, "teal satin"),
)  # (x, z), radius, material: all on the ground


def fill_materials(materials):
    materials["terracotta"] = plain((0.50, 0.19, 0.10), (0.35, 0.30, 0.26), 18)
    materials["gold"] = plain((0.42, 0.26, 0.06), (0.85, 0.66, 0.28), 36)
    materials["chalk"] = plain((0.66, 0.65, 0.62))
    materials["red glaze"] = {
        "model": "blinn-phong",
        "ambient": [0.45, 0.03, 0.03],
        "diffuse": [0.45, 0.03, 0.03],
        "specular": [0.7, 0.7, 0.7],
        "shininess": 400,
    }
    materials["teal satin"] = {
        "model": "blinn-phong",
        "ambient": [0.03, 0.24, 0.26],
        "diffuse": [0.03, 0.24, 0.26],
        "specular": [0.30, 0.34, 0.34],
        "shininess": 30,
    }
    materials["chrome"] = dict(plain((0.03, 0.03, 0.035), (0.8, 0.8, 0.8), 250), reflection=0.75)
    materials["blue lacquer"] = dict(
        plain((0.03, 0.06, 0.30), (0.6, 0.6, 0.6), 120), reflection=0.14
    )


def lay_pavement(stage):
    """Stones of 0.24 m: strips that widen with distance, to the horizon."""
    parts = []
    for near, far, half in ((-0.5, -12.0, 9.0), (-12.0, -60.0, 45.0), (-60.0, -FAR, 300.0)):
        x, z = np.array([-half, half, half, -half]), np.array([near, near, far, far])
        corners = np.stack([x, np.full(4, GROUND), z], -1)
        up = np.tile([0.0, 1.0, 0.0], (4, 1))
        triangles = np.array([[0, 1, 2], [0, 2, 3]])
        parts.append(mesh.Mesh(corners, up, np.stack([x, -z], -1) / 0.48, triangles))
    stage.add("pavement.obj", mesh.merged(parts), "pavement")


def main():
    os.chdir(HERE)
    stage = Stage()
    stage.paint("pavement", ground_picture(), specular=(0.06, 0.06, 0.06), shininess=20)
    stage.paint("globe", globe_picture(), specular=(0.25, 0.25, 0.25), shininess=40)
    stage.paint("marble", marble_picture(), specular=(0.45, 0.45, 0.45), shininess=90)
    stage.glow("sky", sky_picture(), "jpg")
    fill_materials(stage.materials)
    lay_pavement(stage)
    stage.objects.append(quad((-220.0, GROUND - 0.2, -FAR), (440.0, 0, 0), (0, 150.0, 0), "sky"))
    for x, name in ((-0.31, "flat"), (0.0, "gouraud"), (0.31, "phong")):
        ball = coarse_ball(0.135).rotated("x", 12).rotated("y", 8).moved(x, GROUND + 0.135, -2.0)
        stage.add(f"ball-{name}.obj", ball, "terracotta", name)
    knot = torus_knot(0.150, 0.046).rotated("y", -24).moved(0.79, GROUND + 0.256, -2.95)
    stage.add("knot.glb", knot, "gold")
    for (x, z), radius, material in BALLS:
        stage.objects.append(sphere((x, GROUND + radius, z), radius, material))
    lights = [
        {"type": "directional", "direction": [0.62, -0.62, -0.52], "intensity": [0.82, 0.74, 0.60]},
        {"type": "directional", "direction": [-0.7, -0.35, -0.5], "intensity": [0.10, 0.12, 0.16]},
    ]
    write_scene(
        "scene.json",
        "Spheres on a plain",
        "Spheres of many materials from 1 m to 19 m over a checkered pavement that runs to the "
        "horizon; at 2 m one coarse ball three times: flat, Gouraud and Phong interpolation.",
        stage,
        lights,
        (0.28, 0.31, 0.37),
        (0.62, 0.76, 0.88),
    )


if __name__ == "__main__":
    main()
