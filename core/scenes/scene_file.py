"""Writes scene.json: one object to a line, numbers to seven decimals."""

import json

import mesh as meshes
import pattern


def rounded(value):
    if isinstance(value, dict):
        return {key: rounded(item) for key, item in value.items()}
    if isinstance(value, (list, tuple)):
        return [rounded(item) for item in value]
    if isinstance(value, str) or isinstance(value, int):
        return value
    number = round(float(value), 7)
    return int(number) if number == int(number) else number


def texture(file, color_space="srgb", wrap="repeat"):
    return {"file": file, "color_space": color_space, "filter": "mipmap", "wrap": wrap}


def painted(name, ambient=1.0, diffuse=1.0, specular=(0.0, 0.0, 0.0), shininess=1):
    """Phong material whose ambient and diffuse colours are a texture."""
    return {
        "model": "phong",
        "ambient": {"texture": name, "scale": [ambient] * 3},
        "diffuse": {"texture": name, "scale": [diffuse] * 3},
        "specular": list(specular),
        "shininess": shininess,
    }


def plain(color, specular=(0.0, 0.0, 0.0), shininess=1, ambient=1.0):
    """Phong material of one linear colour."""
    return {
        "model": "phong",
        "ambient": [ambient * c for c in color],
        "diffuse": list(color),
        "specular": list(specular),
        "shininess": shininess,
    }


def mesh(file, material, interpolation="phong"):
    return {"type": "mesh", "file": file, "material": material, "interpolation": interpolation}


def quad(corner, edge_u, edge_v, material):
    return {
        "type": "quad",
        "corner_m": list(corner),
        "edge_u_m": list(edge_u),
        "edge_v_m": list(edge_v),
        "material": material,
    }


def sphere(center, radius, material):
    return {"type": "sphere", "center_m": list(center), "radius_m": radius, "material": material}


class Stage:
    """Collects what scene.json names while meshes and textures are written."""

    def __init__(self):
        self.textures, self.materials, self.objects, self.triangles = {}, {}, [], 0

    def paint(self, name, picture, ending="jpg", wrap="repeat", **finish):
        """A texture and the Phong material painted with it."""
        pattern.write_picture(f"{name}.{ending}", picture)
        self.textures[name] = texture(f"{name}.{ending}", wrap=wrap)
        self.materials[name] = painted(name, **finish)

    def glow(self, name, picture, ending="png", scale=1.0):
        """A texture and the unlit material that emits it."""
        pattern.write_picture(f"{name}.{ending}", picture)
        self.textures[name] = texture(f"{name}.{ending}", wrap="clamp")
        emission = {"texture": name, "scale": [scale] * 3}
        self.materials[name] = {"model": "unlit", "emission": emission}

    def add(self, file, part, material, interpolation="phong"):
        meshes.write(file, part)
        self.objects.append(mesh(file, material, interpolation))
        self.triangles += len(part.triangles)


def write_scene(
    path,
    title,
    description,
    stage,
    lights,
    ambient_light=(0.0, 0.0, 0.0),
    background=(0.0, 0.0, 0.0),
):
    def line(value):
        return json.dumps(rounded(value))

    def members(values):
        return ",\n".join(f"    {json.dumps(key)}: {line(value)}" for key, value in values.items())

    def items(values):
        return ",\n".join(f"    {line(value)}" for value in values)

    parts = [
        '  "format": "fstop-scene/1"',
        f'  "title": {json.dumps(title)}',
        f'  "description": {json.dumps(description)}',
    ]
    if stage.textures:
        parts.append(f'  "textures": {{\n{members(stage.textures)}\n  }}')
    parts.append(f'  "materials": {{\n{members(stage.materials)}\n  }}')
    parts.append(f'  "objects": [\n{items(stage.objects)}\n  ]')
    parts.append(f'  "lights": [\n{items(lights)}\n  ]' if lights else '  "lights": []')
    parts.append(f'  "ambient_light": {line(ambient_light)}')
    parts.append(f'  "background": {line(background)}')
    with open(path, "w", encoding="ascii", newline="\n") as file:
        file.write("{\n" + ",\n".join(parts) + "\n}\n")
