"""Moves apart parts of a mesh that lie in each other's surface.

Where two flat parts coincide, which of them a ray finds, and whether the other shades it, is
rounding: renderers differ there, each with its own right. Parts are connected components. One that
shares flat area with an earlier one sinks by `STEP` for each such layer above it.
"""

import numpy as np

from mesh_files import Mesh

STEP = 20e-6  # metres: above what single precision and shadow rays' offsets resolve at 6 m


def components(mesh):
    """The component of every triangle, numbered from 0."""
    label = np.arange(len(mesh.positions))
    while True:
        least = label[mesh.triangles].min(axis=1)
        lower = label.copy()
        for corner in range(3):
            np.minimum.at(lower, mesh.triangles[:, corner], least)
        lower = lower[lower]
        if (lower == label).all():
            return np.unique(label[mesh.triangles[:, 0]], return_inverse=True)[1]
        label = lower


def covers(a, b):
    """Whether a triangle of `b` (n, 3, 2) holds a point of a triangle of `a`, in their plane."""
    centre = a.mean(axis=1, keepdims=True)
    points = np.concatenate([centre, centre + 0.9 * (a - centre)], axis=1).reshape(-1, 1, 2)
    inside = []
    for corner in range(3):
        start, end = b[None, :, corner], b[None, :, (corner + 1) % 3]
        edge, away = end - start, points - start
        inside.append(edge[..., 0] * away[..., 1] - edge[..., 1] * away[..., 0])
    inside = np.stack(inside)
    return bool(((inside > 0).all(axis=0) | (inside < 0).all(axis=0)).any())


def shared_planes(mesh, component):
    """Pairs (earlier, later, normal) of components with common flat area, most area first."""
    corners = mesh.positions[mesh.triangles]
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    length = np.linalg.norm(normal, axis=1)
    keep = np.flatnonzero(length > 0)
    normal = normal[keep] / length[keep, None]
    distance = (normal * corners[keep, 0]).sum(axis=1)
    keys = np.round(np.column_stack([normal * 1e3, distance * 1e5])).astype(np.int64)
    _, group = np.unique(keys, axis=0, return_inverse=True)
    order = np.argsort(group.ravel(), kind="stable")
    planes = np.split(order, np.flatnonzero(np.diff(group.ravel()[order])) + 1)
    for members in sorted(planes, key=lambda plane: -length[keep[plane]].sum()):
        parts = np.unique(component[keep[members]])
        if len(parts) < 2 or len(members) > 5000:
            continue
        flat = np.argsort(np.abs(normal[members[0]]))[:2]  # drop the axis most along the normal
        triangles = {
            part: corners[keep[members[component[keep[members]] == part]]][:, :, flat]
            for part in parts
        }
        for i, earlier in enumerate(parts):
            for later in parts[i + 1 :]:
                a, b = triangles[earlier], triangles[later]
                if covers(a, b) or covers(b, a):
                    yield earlier, later, normal[members[0]]


def separated(mesh):
    """The mesh with coincident parts moved apart, or None if it has none."""
    component = components(mesh)
    if component.max() == 0:
        return None
    layer, facing = {}, {}
    for earlier, later, normal in shared_planes(mesh, component):
        layer[later] = max(layer.get(later, 0), layer.get(earlier, 0) + 1)
        facing.setdefault(later, normal)
    if not layer:
        return None
    positions = mesh.positions.copy()
    for part, normal in facing.items():
        vertices = np.unique(mesh.triangles[component == part])
        positions[vertices] -= STEP * layer[part] * normal
    return Mesh(positions, mesh.triangles, mesh.normals, mesh.uvs)


def write_obj(path, mesh):
    has = "/" if mesh.uvs is not None or mesh.normals is not None else ""
    with open(path, "w", encoding="utf-8") as file:
        columns = (("v", mesh.positions), ("vt", mesh.uvs), ("vn", mesh.normals))
        for name, values in columns:
            for row in values if values is not None else []:
                file.write(f"{name} " + " ".join(f"{value:.9g}" for value in row) + "\n")

        def corner(index):
            if not has:
                return f"{index}"
            uv = index if mesh.uvs is not None else ""
            return f"{index}/{uv}" + (f"/{index}" if mesh.normals is not None else "")

        for triangle in mesh.triangles + 1:
            file.write("f " + " ".join(corner(index) for index in triangle) + "\n")
