"""What is compared: scenes and cameras, laid out so that every program can render them.

A case's folder holds scene.json (matched, see scene_model), its assets, request.json, and
`textures`, linear EXR copies in the order of scene.json.
"""

import copy
import json
import math
import os
import shutil

from coincidence import STEP, separated, write_obj
from mesh_files import read_mesh
from pictures import read_texture, write_picture
from scene_model import files_of, matched

DEFAULT_LENS = {"focal_length_mm": 50, "f_number": 1.4, "focus_distance_m": 2.0}

# The converged pictures that come with the peer scenes, and the relMSE of their own noise.
PEER_REFERENCES = {
    "slats": ("slats_cycles_4096.exr", 7e-7),
    "spheres": ("spheres_cycles_2x1024.exr", 3.7e-5 / 2),
}


class Case:
    def __init__(self, name, folder, notes, given_reference=None):
        self.name = name
        self.folder = folder
        self.notes = notes
        self.given_reference = given_reference  # (file, relMSE of its noise)
        self.scene_file = os.path.join(folder, "scene.json")
        self.request_file = os.path.join(folder, "request.json")

    def request(self):
        with open(self.request_file, encoding="utf-8") as file:
            return json.load(file)

    def write_request(self, name, quality, seed, scene="scene.json"):
        """A request file like the case's, but with this quality and seed."""
        request = self.request()
        request.update(scene=scene, quality=quality, seed=seed)
        path = os.path.join(self.folder, name)
        write_json(path, request)
        return path


def write_json(path, value):
    with open(path, "w", encoding="utf-8") as file:
        json.dump(value, file, indent=1)
        file.write("\n")


def read_json(path):
    with open(path, encoding="utf-8") as file:
        return json.load(file)


def prepare(name, out, root, peers, pixels=None):
    """Case `name`: a scene of the peers' folder, a bundled scene, or a scene or request file."""
    peer_file = os.path.join(peers, "scenes", name + ".json")
    bundled = os.path.join(root, "core", "scenes", name, "scene.json")
    reference = None
    if os.sep not in name and os.path.exists(peer_file):
        scene, request = converted_peer_scene(read_json(peer_file))
        assets = os.path.dirname(peer_file)
        if name in PEER_REFERENCES and pixels is None:
            file, noise = PEER_REFERENCES[name]
            reference = (os.path.join(peers, "ref", file), noise)
    else:
        file = bundled if os.sep not in name and os.path.exists(bundled) else name
        scene, request, assets = read_scene_or_request(file, root)
        if file == name:  # called by its file, or by the folder of a scene.json
            stem, _ = os.path.splitext(os.path.abspath(file))
            parts = stem.split(os.sep)[-2:]
            name = parts[0] + "-file" if parts[1] == "scene" else parts[1]
    scene, notes = matched(scene)
    request = matched_request(request, notes)
    if pixels is not None:
        request["image"].update(width=pixels[0], height=pixels[1])
    folder = os.path.join(out, name)
    lay_out(folder, scene, request, assets, notes)
    return Case(name, folder, notes, reference)


def read_scene_or_request(file, root):
    """A scene file stands for itself through the default camera; a request names its scene."""
    value = read_json(file)
    folder = os.path.dirname(os.path.abspath(file))
    if str(value.get("format", "")).startswith("fstop-scene"):
        return value, {"camera": {"lens": DEFAULT_LENS}}, folder
    scene = value["scene"]
    if isinstance(scene, dict):
        return scene, value, folder
    if "/" not in scene and not scene.endswith(".json"):
        path = os.path.join(root, "core", "scenes", scene, "scene.json")
    else:
        path = os.path.join(folder, scene)
    return read_json(path), value, os.path.dirname(os.path.abspath(path))


def matched_request(request, notes):
    """Relative exposure, no diffraction, no falloff, nothing moves: what all programs render."""
    camera = copy.deepcopy(request["camera"])
    if camera.pop("exposure", "relative") != "relative":
        notes.append("exposure made relative")
    if camera.pop("shutter_s", 0) != 0:
        notes.append("shutter made instantaneous")
    if camera.get("lens", {}).get("focus_distance_m") == "infinity":
        notes.append("focus at infinity told to others as 1e6 m")
    image = request.get("image", {})
    size = {"width": image.get("width", 960), "height": image.get("height", 640)}
    return {
        "scene": "scene.json",
        "camera": camera,
        "image": {**size, "format": "exr"},
        "effects": {"diffraction": "off", "motion": "off", "falloff": "off"},
    }


def lay_out(folder, scene, request, assets, notes):
    os.makedirs(os.path.join(folder, "textures"), exist_ok=True)
    for name in files_of(scene):
        target = os.path.join(folder, name)
        os.makedirs(os.path.dirname(target), exist_ok=True)
        shutil.copyfile(os.path.join(assets, name), target)
    for thing in scene["objects"]:
        part_coincident(thing, folder, notes)
    write_json(os.path.join(folder, "scene.json"), scene)
    write_json(os.path.join(folder, "request.json"), request)
    exact = copy.deepcopy(scene)
    for texture in exact.get("textures", {}).values():
        texture["filter"] = "bilinear"  # the full model's: every sample reads the finest texels
    write_json(os.path.join(folder, "exact.json"), exact)
    for number, texture in enumerate(scene.get("textures", {}).values()):
        source = os.path.join(folder, texture["file"])
        texels = read_texture(source, texture.get("color_space", "srgb"))
        write_picture(os.path.join(folder, "textures", f"{number}.exr"), texels)


def part_coincident(thing, folder, notes):
    if thing["type"] != "mesh":
        return
    mesh = separated(read_mesh(os.path.join(folder, thing["file"])))
    if mesh is None:
        return
    notes.append(f"coincident parts of {thing['file']} moved {STEP * 1e6:g} um apart")
    thing["file"] = os.path.splitext(thing["file"])[0] + "-parted.obj"
    write_obj(os.path.join(folder, thing["file"]), mesh)


# ---- The peers' own scene format


def converted_peer_scene(peer):
    """A scene of the peers' folder as fstop's: emissive or Lambertian meshes, parallel light."""
    scene = {"format": "fstop-scene/1", "textures": {}, "materials": {}, "objects": []}
    for number, mesh in enumerate(peer["meshes"]):
        name = f"{number}"
        scene["materials"][name] = peer_material(name, mesh["material"], scene["textures"])
        thing = {"type": "mesh", "file": mesh["obj"], "material": name, "interpolation": "flat"}
        scene["objects"].append(thing)
    scene["lights"] = [
        {
            "type": "directional",
            "direction": [-x for x in light["to_light"]],
            "intensity": [light["irradiance"] / math.pi] * 3,
        }
        for light in peer["lights"]
    ]
    scene["background"] = peer["background"]
    return scene, peer_request(peer["camera"])


def peer_material(name, material, textures):
    emissive = material["type"] == "emissive"
    value = material.get("radiance" if emissive else "albedo")
    if "texture" in material:
        textures[name] = {
            "file": material["texture"],
            "color_space": "linear",
            "filter": "bilinear",
            "wrap": "clamp",
        }
        value = {"texture": name}
    if emissive:
        return {"model": "unlit", "emission": value}
    return {"model": "phong", "diffuse": value}


def peer_request(camera):
    width, height = camera["resolution"]
    return {
        "camera": {
            "position_m": camera["position"],
            "look_at_m": camera["look_at"],
            "up": camera["up"],
            "sensor_mm": camera["sensor_mm"],
            "lens": {
                "focal_length_mm": camera["focal_length_mm"],
                "f_number": camera["fstop"],
                "focus_distance_m": camera["focus_distance_m"],
            },
            "breathing": False,
        },
        "image": {"width": width, "height": height},
    }
