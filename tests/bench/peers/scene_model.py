"""An fstop scene and request as plain values that other renderers can be told.

`matched` takes out of a scene what the others have no equal for, and says what; the scene that is
left is rendered by all of them, fstop too. Symbols and rules: core/README.md.
"""

import copy
import json
import math
import os
from dataclasses import dataclass, field

import numpy as np

from mesh_files import Mesh, read_mesh


@dataclass
class Colour:
    scale: tuple = (0.0, 0.0, 0.0)
    texture: str | None = None  # a name in Model.textures

    def is_black(self):
        return max(self.scale) == 0.0

    def times(self, factor):
        return Colour(tuple(a * b for a, b in zip(self.scale, factor)), self.texture)


@dataclass
class Material:
    name: str
    glow: list = field(default_factory=list)  # Colours that add up: emission, ambient * its light
    diffuse: Colour = field(default_factory=Colour)
    reflection: float = 0.0
    transmission: float = 0.0  # of a thin sheet


@dataclass
class Sphere:
    center: tuple
    radius: float


@dataclass
class Camera:
    """A thin lens without aberrations; the picture plane `image_distance` from its centre."""

    position: np.ndarray
    right: np.ndarray
    up: np.ndarray
    forward: np.ndarray
    sensor: tuple  # metres
    image_distance: float
    aperture_diameter: float
    focus_distance: float
    pixels: tuple
    blades: int = 0
    blade_rotation_deg: float = 0.0


@dataclass
class Model:
    folder: str
    textures: dict  # name -> {"file", "color_space", "wrap"}
    materials: dict
    objects: list  # (Mesh or Sphere, material's name)
    lights: list
    background: tuple
    camera: Camera


def unit(vector):
    vector = np.array(vector, float)
    return vector / np.linalg.norm(vector)


def camera_of(request):
    camera = request["camera"]
    if "lens" not in camera:
        raise ValueError("the comparison is of lenses: the camera needs a lens")
    lens = camera["lens"]
    size = request.get("image", {})
    position = np.array(camera.get("position_m", (0, 0, 0)), float)
    forward = unit(np.array(camera.get("look_at_m", (0, 0, -1)), float) - position)
    right = unit(np.cross(forward, camera.get("up", (0, 1, 0))))
    focal_length = lens["focal_length_mm"] / 1e3
    focus = lens["focus_distance_m"]
    focus = math.inf if focus == "infinity" else focus
    breathing = camera.get("breathing", True)
    return Camera(
        position=position,
        right=right,
        up=np.cross(right, forward),
        forward=forward,
        sensor=tuple(side / 1e3 for side in camera.get("sensor_mm", (36, 24))),
        image_distance=1 / (1 / focal_length - 1 / focus) if breathing else focal_length,
        aperture_diameter=focal_length / lens["f_number"],
        focus_distance=min(focus, 1e6),  # the others take no infinity; 1e6 m is one at any lens
        pixels=(size.get("width", 960), size.get("height", 640)),
        blades=lens.get("blades", 0),
        blade_rotation_deg=lens.get("blade_rotation_deg", 0.0),
    )


def matched(scene):
    """`scene` (parsed JSON) without what has no equal elsewhere, and what was changed, in words."""
    scene = copy.deepcopy(scene)
    notes = []

    def change(holder, key, value, note):
        if holder.get(key, value) == value:
            return
        holder[key] = value
        if note not in notes:
            notes.append(note)

    for material in scene.get("materials", {}).values():
        change(material, "specular", [0, 0, 0], "specular reflection of lights set to 0")
        if "ior" in material:
            change(material, "transmission", 0, "refracting materials made opaque")
            del material["ior"]
    for thing in scene.get("objects", []):
        change(thing, "velocity_m_s", [0, 0, 0], "moving objects held still")
        if thing.get("interpolation") == "gouraud":
            change(thing, "interpolation", "phong", "Gouraud interpolation made Phong's")
    return scene, notes


def colour_of(material, key):
    value = material.get(key, (0, 0, 0))
    if isinstance(value, dict):
        return Colour(tuple(value.get("scale", (1, 1, 1))), value["texture"])
    return Colour(tuple(value))


def material_of(name, material, ambient_light):
    result = Material(
        name,
        reflection=material.get("reflection", 0.0),
        transmission=material.get("transmission", 0.0),
    )
    glow = [colour_of(material, "emission")]
    if material["model"] != "unlit":
        glow.append(colour_of(material, "ambient").times(ambient_light))
        result.diffuse = colour_of(material, "diffuse")
    result.glow = [colour for colour in glow if not colour.is_black()]
    return result


def quad_mesh(quad):
    corner, u, v = (np.array(quad[key], float) for key in ("corner_m", "edge_u_m", "edge_v_m"))
    return Mesh(
        np.array([corner, corner + u, corner + u + v, corner + v]),
        np.array([[0, 1, 2], [0, 2, 3]]),
        None,
        np.array([[0, 0], [1, 0], [1, 1], [0, 1]], float),
    )


def shape_of(thing, folder):
    if thing["type"] == "sphere":
        return Sphere(tuple(thing["center_m"]), thing["radius_m"])
    if thing["type"] == "quad":
        return quad_mesh(thing)
    mesh = read_mesh(os.path.join(folder, thing["file"]))
    if thing.get("interpolation", "phong") == "flat":
        mesh.normals = None
    return mesh


def read_model(scene_file, request):
    """The matched scene in `scene_file` and the camera of `request`."""
    with open(scene_file, encoding="utf-8") as file:
        scene = json.load(file)
    folder = os.path.dirname(os.path.abspath(scene_file))
    ambient_light = scene.get("ambient_light", (0, 0, 0))
    return Model(
        folder=folder,
        textures=scene.get("textures", {}),
        materials={
            name: material_of(name, material, ambient_light)
            for name, material in scene.get("materials", {}).items()
        },
        objects=[(shape_of(thing, folder), thing["material"]) for thing in scene["objects"]],
        lights=scene.get("lights", []),
        background=tuple(scene.get("background", (0, 0, 0))),
        camera=camera_of(request),
    )


def files_of(scene):
    """The assets that a scene names."""
    files = [texture["file"] for texture in scene.get("textures", {}).values()]
    return sorted({*files, *(t["file"] for t in scene["objects"] if t["type"] == "mesh")})
