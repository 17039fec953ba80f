"""Triangle meshes for the bundled scenes: parametric surfaces, sweeps, boxes, and their files.

Right-handed, metres, +y up. Normals point to the outside, triangles wind counter-clockwise seen
from there. Texture v points up; glTF's v, which points down, is turned when it is written.
"""

import json
import struct
from dataclasses import dataclass

import numpy as np


@dataclass
class Mesh:
    positions: np.ndarray  # (n, 3)
    normals: np.ndarray  # (n, 3), unit length
    uv: np.ndarray  # (n, 2)
    triangles: np.ndarray  # (m, 3)

    def moved(self, x=0.0, y=0.0, z=0.0):
        return Mesh(self.positions + np.array([x, y, z]), self.normals, self.uv, self.triangles)

    def scaled(self, x, y=None, z=None):
        scale = np.array([x, x if y is None else y, x if z is None else z], dtype=float)
        return Mesh(self.positions * scale, unit(self.normals / scale), self.uv, self.triangles)

    def rotated(self, axis, degrees):
        turn = rotation(axis, degrees)
        return Mesh(self.positions @ turn.T, self.normals @ turn.T, self.uv, self.triangles)

    def mapped_uv(self, scale=(1.0, 1.0), offset=(0.0, 0.0)):
        uv = self.uv * np.array(scale) + np.array(offset)
        return Mesh(self.positions, self.normals, uv, self.triangles)

    def flipped(self):
        return Mesh(self.positions, -self.normals, self.uv, self.triangles[:, ::-1])


def unit(vectors):
    length = np.linalg.norm(vectors, axis=-1, keepdims=True)
    return vectors / np.where(length > 0.0, length, 1.0)


def rotation(axis, degrees):
    """Matrix of the right-handed turn about `axis` ("x", "y", "z" or a vector)."""
    named = {"x": (1, 0, 0), "y": (0, 1, 0), "z": (0, 0, 1)}
    x, y, z = unit(np.array(named.get(axis, axis) if isinstance(axis, str) else axis, dtype=float))
    c, s = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
    cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return c * np.eye(3) + s * cross + (1 - c) * np.outer([x, y, z], [x, y, z])


def merged(meshes):
    offsets = np.cumsum([0] + [len(mesh.positions) for mesh in meshes[:-1]])
    return Mesh(
        np.concatenate([mesh.positions for mesh in meshes]),
        np.concatenate([mesh.normals for mesh in meshes]),
        np.concatenate([mesh.uv for mesh in meshes]),
        np.concatenate([mesh.triangles + offset for mesh, offset in zip(meshes, offsets)]),
    )


def surface(point, nu, nv, flip=False, u_range=(0.0, 1.0), v_range=(0.0, 1.0)):
    """Grid over a parametric surface; `point(u, v)` takes arrays and returns (..., 3).

    The outside is where the cross product of the u and v directions points, or with `flip` the
    other side. Closed surfaces keep a doubled seam, so that textures wrap without a streak.
    """
    u, v = np.meshgrid(np.linspace(*u_range, nu + 1), np.linspace(*v_range, nv + 1))
    positions = point(u, v)
    step_u = 1e-4 * (u_range[1] - u_range[0])
    step_v = 1e-4 * (v_range[1] - v_range[0])
    inside = np.clip(v, v_range[0] + 2 * step_v, v_range[1] - 2 * step_v)  # off the poles
    along_u = point(u + step_u, inside) - point(u - step_u, inside)
    along_v = point(u, inside + step_v) - point(u, inside - step_v)
    normals = unit(np.cross(along_u, along_v)).reshape(-1, 3)
    mesh = Mesh(
        positions.reshape(-1, 3),
        normals,
        np.stack([u, v], -1).reshape(-1, 2),
        grid_triangles(nu, nv),
    )
    return without_slivers(mesh.flipped() if flip else mesh)


def grid_triangles(nu, nv):
    row = np.arange(nv)[:, None] * (nu + 1) + np.arange(nu)[None, :]
    a, b, c, d = row, row + 1, row + nu + 2, row + nu + 1
    return np.concatenate(
        [np.stack([a, b, c], -1).reshape(-1, 3), np.stack([a, c, d], -1).reshape(-1, 3)]
    )


def without_slivers(mesh, area=1e-11):
    """The mesh without triangles of (nearly) no area, such as those at poles."""
    a, b, c = (mesh.positions[mesh.triangles[:, k]] for k in range(3))
    keep = np.linalg.norm(np.cross(b - a, c - a), axis=1) > area
    return Mesh(mesh.positions, mesh.normals, mesh.uv, mesh.triangles[keep])


def curve(points, samples=400):
    """Centripetal Catmull-Rom curve through `points`, as a function of its arc length in [0, 1]."""
    points = np.asarray(points, dtype=float)
    padded = np.concatenate([[2 * points[0] - points[1]], points, [2 * points[-1] - points[-2]]])
    gaps = np.maximum(np.linalg.norm(np.diff(padded, axis=0), axis=1), 1e-9) ** 0.5
    knots = np.concatenate([[0.0], np.cumsum(gaps)])
    t = np.linspace(knots[1], knots[-2], samples)
    k = np.clip(np.searchsorted(knots, t, side="right") - 1, 1, len(knots) - 3)
    p = [padded[k + j] for j in (-1, 0, 1, 2)]
    q = [knots[k + j] for j in (-1, 0, 1, 2)]

    def blend(a, b, from_knot, to_knot):
        weight = ((t - from_knot) / (to_knot - from_knot))[:, None]
        return (1 - weight) * a + weight * b

    a1, a2, a3 = (blend(p[j], p[j + 1], q[j], q[j + 1]) for j in range(3))
    b1, b2 = blend(a1, a2, q[0], q[2]), blend(a2, a3, q[1], q[3])
    path = blend(b1, b2, q[1], q[2])
    length = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(path, axis=0), axis=1))])
    length /= length[-1]
    return lambda s: np.stack(
        [np.interp(s, length, path[:, axis]) for axis in range(path.shape[1])], -1
    )


def revolution(profile, nu, nv, deform=None):
    """Surface of revolution about y of a `profile` of (radius, height) pairs.

    The profile runs up the outside (and down the inside of a vessel); v is its arc length;
    `deform(positions, u, v)` may bend the result.
    """
    section = curve(profile)

    def point(u, v):
        radius, height = np.moveaxis(section(np.clip(v, 0.0, 1.0)), -1, 0)
        angle = 2.0 * np.pi * u
        positions = np.stack([radius * np.sin(angle), height, radius * np.cos(angle)], -1)
        return positions if deform is None else deform(positions, u, v)

    return surface(point, nu, nv)


def tube(path, radius, sides, steps, closed=False):
    """Sweep of a circle along `path` (control points, or a function of [0, 1]).

    `radius` is a number or a function of [0, 1]. The frame is carried along without twist.
    """
    course = path if callable(path) else curve(path)
    s = np.linspace(0.0, 1.0, steps + 1)
    centres = course(s)
    tangents = unit(np.gradient(centres, axis=0))
    side = unit(np.cross(tangents[0], [0.31, 0.87, 0.38]))
    frames = []
    for tangent in tangents:
        side = unit(side - tangent * np.dot(side, tangent))
        frames.append((side, np.cross(tangent, side)))
    radii = radius(s) if callable(radius) else np.full(steps + 1, float(radius))
    angle = np.linspace(0.0, 2.0 * np.pi, sides + 1)
    across, up = (np.array([frame[k] for frame in frames])[:, None, :] for k in (0, 1))
    spokes = across * np.cos(angle)[None, :, None] + up * np.sin(angle)[None, :, None]
    positions = centres[:, None, :] + spokes * radii[:, None, None]
    slope = np.gradient(radii, s) / max(path_length(centres), 1e-9)
    normals = unit(spokes - tangents[:, None, :] * slope[:, None, None])
    uv = np.stack(np.meshgrid(angle / (2.0 * np.pi), s), -1)
    body = Mesh(
        positions.reshape(-1, 3),
        normals.reshape(-1, 3),
        uv.reshape(-1, 2),
        grid_triangles(sides, steps),
    )
    ends = (
        []
        if closed
        else [
            disc(centres[0], -tangents[0], radii[0], sides),
            disc(centres[-1], tangents[-1], radii[-1], sides),
        ]
    )
    return without_slivers(merged([body] + ends))


def path_length(points):
    return float(np.sum(np.linalg.norm(np.diff(points, axis=0), axis=1)))


def disc(centre, normal, radius, sides):
    """Flat disc; uv is its unit square."""
    normal = unit(np.asarray(normal, dtype=float))
    across = unit(np.cross(normal, [0.31, 0.87, 0.38]))
    up = np.cross(normal, across)
    angle = np.arange(sides) * (2.0 * np.pi / sides)
    ring = np.stack([np.cos(angle), np.sin(angle)], -1)
    rim = np.asarray(centre) + radius * (ring[:, :1] * across + ring[:, 1:] * up)
    k = np.arange(sides)
    return Mesh(
        np.concatenate([[np.asarray(centre, dtype=float)], rim]),
        np.tile(normal, (sides + 1, 1)),
        np.concatenate([[[0.5, 0.5]], 0.5 + 0.5 * ring]),
        np.stack([np.zeros_like(k), 1 + k, 1 + (k + 1) % sides], -1),
    )


def rounded_box(size, bevel, uv_metres=None):
    """Box about the origin with edges of radius `bevel`.

    uv is each face's unit square, or metres divided by `uv_metres` from the face's lower left.
    """
    half = np.asarray(size, dtype=float) / 2.0
    quarter = np.sin(np.radians([0.0, 22.5, 45.0])) / np.sin(np.radians(45.0))
    faces = []
    for axis in range(3):
        for sign in (-1.0, 1.0):
            # Right and up of the face as seen from outside, so that pictures stand upright.
            right, up = {0: (2, 1), 1: (0, 2), 2: (0, 1)}[axis]
            right_sign = {0: -sign, 1: 1.0, 2: sign}[axis]
            up_sign = {0: 1.0, 1: -sign, 2: 1.0}[axis]

            def steps(extent):
                near = extent - bevel + bevel * quarter
                return np.concatenate([-near[::-1], near])

            a, b = np.meshgrid(steps(half[right]), steps(half[up]))
            cube = np.zeros(a.shape + (3,))
            cube[..., axis] = sign * half[axis]
            cube[..., right] = right_sign * a
            cube[..., up] = up_sign * b
            core = np.clip(cube, -(half - bevel), half - bevel)
            normals = unit(cube - core)
            extent = np.array([2.0 * half[right], 2.0 * half[up]])
            uv = np.stack([a + half[right], b + half[up]], -1)
            uv = uv / extent if uv_metres is None else uv / uv_metres
            rows, columns = a.shape
            faces.append(
                Mesh(
                    (core + bevel * normals).reshape(-1, 3),
                    normals.reshape(-1, 3),
                    uv.reshape(-1, 2),
                    grid_triangles(columns - 1, rows - 1),
                )
            )
    return merged(faces)


def write(path, mesh):
    """Writes by the name's ending."""
    {"ply": write_ply, "obj": write_obj, "glb": write_glb}[path[-3:]](path, mesh)


def write_ply(path, mesh):
    """Binary little-endian PLY with x y z nx ny nz u v."""
    header = ["ply", "format binary_little_endian 1.0", f"element vertex {len(mesh.positions)}"]
    header += [f"property float {name}" for name in ("x", "y", "z", "nx", "ny", "nz", "u", "v")]
    header += [
        f"element face {len(mesh.triangles)}",
        "property list uchar int vertex_indices",
        "end_header\n",
    ]
    vertices = np.concatenate([mesh.positions, mesh.normals, mesh.uv], axis=1).astype("<f4")
    faces = np.zeros(len(mesh.triangles), dtype=[("count", "u1"), ("index", "<i4", (3,))])
    faces["count"], faces["index"] = 3, mesh.triangles
    with open(path, "wb") as file:
        file.write("\n".join(header).encode() + vertices.tobytes() + faces.tobytes())


def write_obj(path, mesh):
    """Wavefront OBJ with v, vt, vn."""
    lines = ["v {:.6f} {:.6f} {:.6f}".format(*row) for row in mesh.positions]
    lines += ["vt {:.5f} {:.5f}".format(*row) for row in mesh.uv]
    lines += ["vn {:.4f} {:.4f} {:.4f}".format(*row) for row in mesh.normals]
    lines += ["f {0}/{0}/{0} {1}/{1}/{1} {2}/{2}/{2}".format(*row) for row in mesh.triangles + 1]
    with open(path, "w", encoding="ascii", newline="\n") as file:
        file.write("\n".join(lines).replace("-0.000000", "0.000000") + "\n")


def write_glb(path, mesh):
    """Binary glTF 2.0: one mesh, one primitive, no material."""
    turned = mesh.uv * np.array([1.0, -1.0]) + np.array([0.0, 1.0])
    small = len(mesh.positions) < 65536
    parts = [
        mesh.positions.astype("<f4"),
        mesh.normals.astype("<f4"),
        turned.astype("<f4"),
        mesh.triangles.reshape(-1).astype("<u2" if small else "<u4"),
    ]
    views, blob = [], b""
    for part, target in zip(parts, (34962, 34962, 34962, 34963)):
        views.append(
            {"buffer": 0, "byteOffset": len(blob), "byteLength": part.nbytes, "target": target}
        )
        blob += part.tobytes() + b"\0" * (-part.nbytes % 4)
    accessors = [
        {"bufferView": k, "componentType": 5126, "count": len(part), "type": kind}
        for k, (part, kind) in enumerate(zip(parts[:3], ("VEC3", "VEC3", "VEC2")))
    ]
    accessors[0]["min"] = parts[0].min(axis=0).astype(float).tolist()
    accessors[0]["max"] = parts[0].max(axis=0).astype(float).tolist()
    accessors.append(
        {
            "bufferView": 3,
            "componentType": 5123 if small else 5125,
            "count": len(parts[3]),
            "type": "SCALAR",
        }
    )
    document = {
        "asset": {"version": "2.0"},
        "scene": 0,
        "scenes": [{"nodes": [0]}],
        "nodes": [{"mesh": 0}],
        "meshes": [
            {
                "primitives": [
                    {"attributes": {"POSITION": 0, "NORMAL": 1, "TEXCOORD_0": 2}, "indices": 3}
                ]
            }
        ],
        "accessors": accessors,
        "bufferViews": views,
        "buffers": [{"byteLength": len(blob)}],
    }
    text = json.dumps(document, separators=(",", ":")).encode()
    text += b" " * (-len(text) % 4)
    with open(path, "wb") as file:
        file.write(struct.pack("<III", 0x46546C67, 2, 28 + len(text) + len(blob)))
        file.write(struct.pack("<II", len(text), 0x4E4F534A) + text)
        file.write(struct.pack("<II", len(blob), 0x004E4942) + blob)
