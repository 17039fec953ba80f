"""Writes a scene for POV-Ray 3.7:

    pov_export.py scene.json request.json out.pov
    povray +Iout.pov +OFILE.exr +FE +W960 +H640 -D -A -V Dither=off Declare=Samples=64

Samples is the number of points on the lens for each pixel, all of them always taken. What POV-Ray
cannot be told exactly raises ValueError.
"""

import json
import math
import os
import sys

import numpy as np

sys.dont_write_bytecode = True
sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
from pictures import read_picture, write_picture
from scene_model import Sphere, read_model, unit

# POV-Ray's shadow rays overlook what is nearer than 1e-3 units: 10 um if a unit is 1 cm.
UNITS = 100.0

# TraceRayWithFocalBlur adds (rand - 0.5)/16 px where rand is centred on 0 already: the picture
# stands off by this much, in pixels. Measured on "slats" against Cycles.
JITTER_OFFSET = (0.038, 0.042)

AREA_LIGHT_SIDE = 2  # an area light is that many squared points, moved about at random


def vector(values):
    return "<" + ",".join(f"{float(value):.9g}" for value in values) + ">"


def place(values):
    return vector(UNITS * np.asarray(values, float))


def rows(name, values, kind):
    if kind == "index":
        lines = "\n".join(f",<{a},{b},{c}>" for a, b, c in values)
    elif values.shape[1] == 3:
        lines = "\n".join(f",<{a:.9g},{b:.9g},{c:.9g}>" for a, b, c in values)
    else:
        lines = "\n".join(f",<{a:.9g},{b:.9g}>" for a, b in values)
    return f" {name} {{ {len(values)}\n{lines} }}\n"


class PovWriter:
    def __init__(self, model):
        self.model = model
        self.parts = []
        self.baked = {}

    def text(self):
        materials = self.model.materials.values()
        depth = 16 if any(m.reflection or m.transmission for m in materials) else 1
        self.parts.append("#version 3.7;\n#ifndef (Samples) #declare Samples = 16; #end\n")
        self.parts.append(f"global_settings {{ assumed_gamma 1.0 max_trace_level {depth} }}\n")
        self.parts.append(f"background {{ color rgb {vector(self.model.background)} }}\n")
        self.camera(self.model.camera)
        for light in self.model.lights:
            self.light(light)
        uses = {(name, isinstance(shape, Sphere)) for shape, name in self.model.objects}
        for key in sorted(uses):
            texture = self.texture(self.model.materials[key[0]], of_sphere=key[1])
            self.parts.append(f"#declare {self.texture_name(*key)} = {texture};\n")
        for shape, name in self.model.objects:
            texture = self.texture_name(name, isinstance(shape, Sphere))
            if isinstance(shape, Sphere):
                self.sphere(shape, texture)
            else:
                self.mesh(shape, texture)
        return "".join(self.parts)

    def texture_name(self, material, of_sphere):
        number = list(self.model.materials).index(material)
        return f"{'Sphere' if of_sphere else 'Mesh'}{number}"

    def camera(self, camera):
        if camera.blades:
            raise ValueError("POV-Ray's lens is round")
        pixel = np.array(camera.sensor) / np.array(camera.pixels)
        direction = camera.forward * camera.image_distance
        direction = direction + camera.right * (JITTER_OFFSET[0] * pixel[0])
        direction = direction - camera.up * (JITTER_OFFSET[1] * pixel[1])
        focus = camera.position + camera.forward * camera.focus_distance
        # The lens's radius is a quarter of `aperture`: a grid of radius 1/2, times aperture/2.
        self.parts.append(
            f"camera {{ perspective location {place(camera.position)}\n"
            f" direction {place(direction)} right {place(camera.right * camera.sensor[0])}\n"
            f" up {place(camera.up * camera.sensor[1])}\n"
            f" aperture {2 * UNITS * camera.aperture_diameter:.9g} focal_point {place(focus)}\n"
            " blur_samples Samples variance 0 confidence 0.9 }\n"
        )

    # ---- Lights. POV-Ray lights a facing surface of albedo a to a times the light's colour.

    def light(self, light):
        kind = light["type"]
        if kind == "directional":
            towards = -1e4 * unit(light["direction"])
            colour = vector(light["intensity"])
            self.parts.append(
                f"light_source {{ {place(towards)} color rgb {colour}"
                " parallel point_at <0,0,0> }\n"
            )
            return
        colour, fade = self.attenuated(light)
        if kind == "area":
            u, v = (np.array(light[key], float) for key in ("edge_u_m", "edge_v_m"))
            centre = np.array(light["corner_m"], float) + (u + v) / 2
            n = AREA_LIGHT_SIDE
            # n points from edge to edge, each moved by up to half their distance: over the
            # whole parallelogram if the edges are (n-1)/n as long.
            u, v = u * (n - 1) / n, v * (n - 1) / n
            self.parts.append(
                f"light_source {{ {place(centre)} color rgb {colour} area_light {place(u)},"
                f" {place(v)}, {n}, {n} jitter area_illumination on {fade} }}\n"
            )
            return
        position = np.array(light["position_m"], float)
        spot = ""
        if kind == "spot":
            aim = place(position + unit(light["direction"]))
            exponent = light.get("exponent", 1.0)
            spot = f"spotlight point_at {aim} radius 90 falloff 90 tightness {exponent:.9g}"
        where = place(position)
        self.parts.append(f"light_source {{ {where} color rgb {colour} {spot} {fade} }}\n")

    def attenuated(self, light):
        """POV-Ray's 2/(1 + (d/fade_distance)^2) for 1/(a0 + a2 d^2); a0 at least 1e-8 m^2 a2."""
        a0, a1, a2 = light.get("attenuation", (1, 0, 0))
        if a1 != 0:
            raise ValueError("POV-Ray has no attenuation with a linear and another term")
        if a2 == 0:
            return vector(np.array(light["intensity"]) / a0), ""
        a0 = max(a0, 1e-8 * a2)
        colour = vector(np.array(light["intensity"]) / (2 * a0))
        return colour, f"fade_distance {UNITS * math.sqrt(a0 / a2):.9g} fade_power 2"

    # ---- Materials

    def texture(self, material, of_sphere=False):
        glow, diffuse = material.glow, material.diffuse
        parts = [(colour, "emission") for colour in glow]
        if not diffuse.is_black():
            parts.append((diffuse, "diffuse"))
        mirror = ""
        if material.reflection:
            kept = 1 - material.transmission
            mirror = f" reflection {{ {material.reflection * kept:.9g} }}"
        if not parts:
            parts = [(diffuse, "emission")]
        shared = self.shared_pigment(parts, of_sphere)
        if shared is None and (mirror or material.transmission):
            raise ValueError(f"{material.name}: two textures on a mirror or a sheet")
        if shared is not None:
            pigment, finish = shared
            clear = f" transmit {material.transmission:.9g}" if material.transmission else ""
            if clear and "image_map" in pigment:
                raise ValueError(f"{material.name}: a textured sheet")
            finish = f"finish {{ ambient 0 {finish}{mirror} }}"
            return f"texture {{ pigment {{ {pigment}{clear} }} {finish} }}"
        # The mean of n textures, each n times as strong.
        n = len(parts)
        entries = []
        for colour, kind in parts:
            other = "diffuse 0" if kind == "emission" else "emission 0"
            finish = f"ambient 0 {other} {kind} {n}"
            pigment = self.pigment(colour, of_sphere)
            entries.append(f"[1 pigment {{ {pigment} }} finish {{ {finish} }}]")
        return "texture { average texture_map { " + " ".join(entries) + " } }"

    def shared_pigment(self, parts, of_sphere):
        """One pigment for all parts, if their colours are multiples of the last one's."""
        base = parts[-1][0]
        factors = {"emission": np.zeros(3), "diffuse": np.zeros(3)}
        for colour, kind in parts:
            if colour.texture != base.texture:
                return None
            if any(b == 0 and c != 0 for b, c in zip(base.scale, colour.scale)):
                return None
            factors[kind] += [c / b if b else 0 for c, b in zip(colour.scale, base.scale)]
        diffuse = max(factors["diffuse"])
        finish = f"diffuse {diffuse:.9g} emission rgb {vector(factors['emission'])}"
        return self.pigment(base, of_sphere), finish

    def pigment(self, colour, of_sphere):
        if colour.texture is None:
            return f"color rgb {vector(colour.scale)}"
        texture = self.model.textures[colour.texture]
        once = "once" if texture.get("wrap", "repeat") == "clamp" else ""
        file = self.baked_file(colour)
        if of_sphere:
            return f'image_map {{ exr "{file}" gamma 1.0 map_type 1 interpolate 2 }}'
        return f'uv_mapping image_map {{ exr "{file}" gamma 1.0 {once} interpolate 2 }}'

    def baked_file(self, colour):
        """The texture with its scale in it, since a finish's diffuse has no colour."""
        number = list(self.model.textures).index(colour.texture)
        if tuple(colour.scale) == (1, 1, 1):
            return f"textures/{number}.exr"
        key = (number, tuple(colour.scale))
        if key not in self.baked:
            self.baked[key] = f"textures/{number}-{len(self.baked)}.exr"
            texels = read_picture(os.path.join(self.model.folder, "textures", f"{number}.exr"))
            scaled = texels * np.array(colour.scale)
            write_picture(os.path.join(self.model.folder, self.baked[key]), scaled)
        return self.baked[key]

    # ---- Objects

    def sphere(self, sphere, texture):
        """Spherical maps run from +x to +z, fstop's u from -z to -x: z, x for -x, -z."""
        centre, radius = place(sphere.center), f"{UNITS * sphere.radius:.9g}"
        turn = "matrix <0,0,-1, 0,1,0, -1,0,0, 0,0,0>"
        self.parts.append(
            f"sphere {{ {centre}, {radius} texture {{ {texture} {turn} translate {centre} }} }}\n"
        )

    def mesh(self, mesh, texture):
        self.parts.append("mesh2 {\n" + rows("vertex_vectors", UNITS * mesh.positions, "vector"))
        if mesh.normals is not None:
            self.parts.append(rows("normal_vectors", mesh.normals, "vector"))
        if mesh.uvs is not None:
            self.parts.append(rows("uv_vectors", mesh.uvs, "vector"))
        self.parts.append(rows("face_indices", mesh.triangles, "index"))
        if mesh.normals is not None:
            self.parts.append(rows("normal_indices", mesh.triangles, "index"))
        if mesh.uvs is not None:
            self.parts.append(rows("uv_indices", mesh.triangles, "index"))
        self.parts.append(f" texture {{ {texture} }} }}\n")


def main():
    scene_file, request_file, out = sys.argv[1:]
    with open(request_file, encoding="utf-8") as file:
        model = read_model(scene_file, json.load(file))
    with open(out, "w", encoding="utf-8") as file:
        file.write(PovWriter(model).text())


if __name__ == "__main__":
    main()
