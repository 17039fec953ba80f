"""Triangle meshes of OBJ, PLY and glTF files as fstop's loaders read them.

Right-handed, metres; texture v points up. Polygons become fans. Written apart from the C++
loaders, so that pictures that agree also say that both read the files alike.
"""

import base64
import json
import os
import struct
from dataclasses import dataclass

import numpy as np


@dataclass
class Mesh:
    positions: np.ndarray  # (n, 3)
    triangles: np.ndarray  # (m, 3)
    normals: np.ndarray | None = None  # (n, 3)
    uvs: np.ndarray | None = None  # (n, 2)


def read_mesh(path):
    readers = {".obj": read_obj, ".ply": read_ply, ".glb": read_gltf, ".gltf": read_gltf}
    extension = os.path.splitext(path)[1].lower()
    if extension not in readers:
        raise ValueError(f"{path}: meshes are .obj, .ply, .glb or .gltf")
    return readers[extension](path)


def fan(corners):
    return [(corners[0], corners[i], corners[i + 1]) for i in range(1, len(corners) - 1)]


def read_obj(path):
    columns = {"v": [], "vt": [], "vn": []}
    numbers, triangles = {}, []
    with open(path, encoding="utf-8") as file:
        for line in file.read().replace("\\\n", " ").splitlines():
            words = line.split("#")[0].split()
            if not words:
                continue
            if words[0] in columns:
                columns[words[0]].append([float(word) for word in words[1:4]])
            elif words[0] == "f":
                keys = [obj_corner(word, columns) for word in words[1:]]
                triangles += fan([numbers.setdefault(key, len(numbers)) for key in keys])
    corners = list(numbers)

    def gathered(name, part, width):
        if any(corner[part] is None for corner in corners):
            return None
        return np.array([columns[name][corner[part]][:width] for corner in corners])

    return Mesh(
        gathered("v", 0, 3), np.array(triangles), gathered("vn", 2, 3), gathered("vt", 1, 2)
    )


def obj_corner(word, columns):
    parts = (word.split("/") + ["", ""])[:3]
    counts = [len(columns[name]) for name in ("v", "vt", "vn")]
    return tuple(
        None if part == "" else (int(part) - 1 if int(part) > 0 else count + int(part))
        for part, count in zip(parts, counts)
    )


PLY_TYPES = {
    "char": "i1", "int8": "i1", "uchar": "u1", "uint8": "u1", "short": "i2", "int16": "i2",
    "ushort": "u2", "uint16": "u2", "int": "i4", "int32": "i4", "uint": "u4", "uint32": "u4",
    "float": "f4", "float32": "f4", "double": "f8", "float64": "f8",
}  # fmt: skip


def read_ply(path):
    with open(path, "rb") as file:
        data = file.read()
    end = data.index(b"end_header")
    body = data[data.index(b"\n", end) + 1 :]
    encoding, elements = ply_header(data[:end].decode("ascii"))
    if encoding == "ascii":
        values = iter(body.split())
        read = lambda code: float(next(values))
    else:
        order, at = "<" if encoding.endswith("little_endian") else ">", [0]

        def read(code):
            kind = np.dtype(order + code)
            value = np.frombuffer(body, kind, 1, at[0])[0]
            at[0] += kind.itemsize
            return float(value)

    vertices, triangles = {}, []
    for name, count, properties in elements:
        plain = all(counted is None for _, _, counted in properties)
        if plain and encoding != "ascii":
            kind = np.dtype([(key, order + code) for key, code, _ in properties])
            rows = np.frombuffer(body, kind, count, at[0])
            at[0] += kind.itemsize * count
            table = {key: rows[key].astype(float) for key in kind.names}
        else:
            table = {key: [] for key, _, _ in properties}
            for _ in range(count):
                for key, code, counted in properties:
                    if counted is None:
                        table[key].append(read(code))
                    else:
                        length = int(read(counted))
                        table[key].append([int(read(code)) for _ in range(length)])
        if name == "vertex":
            vertices = table
        elif name == "face":
            lists = table.get("vertex_indices", table.get("vertex_index"))
            triangles = [triangle for corners in lists for triangle in fan(corners)]

    def columns(*choices):
        for names in choices:
            if all(name in vertices for name in names):
                return np.stack([np.array(vertices[name], float) for name in names], -1)
        return None

    return Mesh(
        columns(("x", "y", "z")),
        np.array(triangles),
        columns(("nx", "ny", "nz")),
        columns(("u", "v"), ("s", "t"), ("texture_u", "texture_v")),
    )


def ply_header(text):
    encoding, elements = "ascii", []
    for line in text.splitlines():
        words = line.split()
        if words[:1] == ["format"]:
            encoding = words[1]
        elif words[:1] == ["element"]:
            elements.append((words[1], int(words[2]), []))
        elif words[:2] == ["property", "list"]:
            elements[-1][2].append((words[4], PLY_TYPES[words[3]], PLY_TYPES[words[2]]))
        elif words[:1] == ["property"]:
            elements[-1][2].append((words[2], PLY_TYPES[words[1]], None))
    return encoding, elements


GLTF_TYPES = {5120: "i1", 5121: "u1", 5122: "i2", 5123: "u2", 5125: "u4", 5126: "f4"}
GLTF_WIDTHS = {"SCALAR": 1, "VEC2": 2, "VEC3": 3}


def read_gltf(path):
    with open(path, "rb") as file:
        data = file.read()
    binary = None
    if data[:4] == b"glTF":
        length = struct.unpack_from("<I", data, 12)[0]
        document = json.loads(data[20 : 20 + length])
        if len(data) > 20 + length:
            binary = data[28 + length :]
    else:
        document = json.loads(data)
    buffers = [gltf_buffer(entry, binary, path) for entry in document.get("buffers", [])]
    nodes = document["nodes"]
    roots = document["scenes"][document.get("scene", 0)]["nodes"]
    parts, visits = [], [(root, np.eye(4)) for root in roots]
    while visits:
        index, parent = visits.pop()
        node = nodes[index]
        world = parent @ gltf_transform(node)
        visits += [(child, world) for child in node.get("children", [])]
        for primitive in document["meshes"][node["mesh"]]["primitives"] if "mesh" in node else []:
            if primitive.get("mode", 4) == 4:
                parts.append(gltf_primitive(document, buffers, primitive, world))
    return joined(parts)


def gltf_buffer(entry, binary, path):
    uri = entry.get("uri")
    if uri is None:
        return binary
    if uri.startswith("data:"):
        return base64.b64decode(uri.split(",", 1)[1])
    with open(os.path.join(os.path.dirname(path), uri), "rb") as file:
        return file.read()


def gltf_transform(node):
    if "matrix" in node:
        return np.array(node["matrix"], float).reshape(4, 4).T
    x, y, z, w = np.array(node.get("rotation", (0, 0, 0, 1)), float)
    x, y, z, w = np.array([x, y, z, w]) / np.sqrt(x * x + y * y + z * z + w * w)
    turn = np.array([
        [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
        [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
        [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
    ])  # fmt: skip
    matrix = np.eye(4)
    matrix[:3, :3] = turn * np.array(node.get("scale", (1, 1, 1)), float)
    matrix[:3, 3] = node.get("translation", (0, 0, 0))
    return matrix


def gltf_accessor(document, buffers, index):
    accessor = document["accessors"][index]
    view = document["bufferViews"][accessor["bufferView"]]
    kind = np.dtype("<" + GLTF_TYPES[accessor["componentType"]])
    width = GLTF_WIDTHS[accessor["type"]]
    start = view.get("byteOffset", 0) + accessor.get("byteOffset", 0)
    stride = view.get("byteStride", width * kind.itemsize)
    rows = np.ndarray(
        (accessor["count"], width), kind, buffers[view["buffer"]], start, (stride, kind.itemsize)
    ).astype(float)
    if accessor.get("normalized"):
        rows = np.maximum(rows / np.iinfo(kind).max, -1.0)
    return rows


def gltf_primitive(document, buffers, primitive, world):
    def attribute(name):
        index = primitive["attributes"].get(name)
        return None if index is None else gltf_accessor(document, buffers, index)

    positions = attribute("POSITION") @ world[:3, :3].T + world[:3, 3]
    corners = np.arange(len(positions))
    if "indices" in primitive:
        corners = gltf_accessor(document, buffers, primitive["indices"]).astype(int).ravel()
    triangles = corners.reshape(-1, 3)
    mirrored = np.linalg.det(world[:3, :3]) < 0
    normals, uvs = attribute("NORMAL"), attribute("TEXCOORD_0")
    if normals is not None:
        normals = normals @ np.linalg.inv(world[:3, :3])
    if uvs is not None:
        uvs = np.stack([uvs[:, 0], 1 - uvs[:, 1]], -1)
    return Mesh(positions, triangles[:, ::-1] if mirrored else triangles, normals, uvs)


def joined(parts):
    offsets = np.cumsum([0] + [len(part.positions) for part in parts[:-1]])

    def column(name):
        values = [getattr(part, name) for part in parts]
        return None if any(value is None for value in values) else np.concatenate(values)

    triangles = np.concatenate([part.triangles + n for part, n in zip(parts, offsets)])
    return Mesh(column("positions"), triangles, column("normals"), column("uvs"))
