"""Writes a scene as a .blend file for Cycles. Inside Blender:

    blender -b --factory-startup --python blender_export.py -- scene.json request.json out.blend

Textures are read from the folder `textures` beside scene.json, where the driver has put linear
EXR copies. How fstop's model is said in Cycles' nodes is told at each function.
"""

import json
import math
import os
import sys

import bpy
import numpy as np
from mathutils import Matrix, Vector

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
from scene_model import Sphere, read_model, unit

MOST_BOUNCES = 16


class Nodes:
    """A node tree that is added to by function calls."""

    def __init__(self, tree):
        self.tree = tree
        tree.nodes.clear()

    def add(self, kind, inputs=(), **settings):
        node = self.tree.nodes.new(kind)
        for key, value in settings.items():
            setattr(node, key, value)
        for name, value in dict(inputs).items():
            if isinstance(value, bpy.types.NodeSocket):
                self.tree.links.new(value, node.inputs[name])
            else:
                node.inputs[name].default_value = value
        return node

    def math(self, operation, *values):
        node = self.add("ShaderNodeMath", enumerate(values), operation=operation)
        return node.outputs[0]


def frame(position, x, y, z):
    columns = [Vector(tuple(map(float, axis))) for axis in (x, y, z)]
    matrix = Matrix.Identity(4)
    for row in range(3):
        for column in range(3):
            matrix[row][column] = columns[column][row]
        matrix[row][3] = float(position[row])
    return matrix


def frame_along(position, z):
    """A right-handed frame with `z` towards where a lamp's light comes from."""
    z = unit(z)
    side = np.cross((0, 1, 0) if abs(z[1]) < 0.9 else (1, 0, 0), z)
    x = unit(side)
    return frame(position, x, np.cross(z, x), z)


def add_object(name, data, matrix=None):
    thing = bpy.data.objects.new(name, data)
    if matrix is not None:
        thing.matrix_world = matrix
    bpy.context.scene.collection.objects.link(thing)
    return thing


# ---- Materials: diffuse and unoccluded glow, no light passed on from surface to surface.


def texture_node(nodes, model, name, of_sphere):
    texture = model.textures[name]
    number = list(model.textures).index(name)
    path = os.path.join(model.folder, "textures", f"{number}.exr")
    image = bpy.data.images.load(path, check_existing=True)
    image.colorspace_settings.name = "Non-Color"
    inputs = {"Vector": sphere_uv(nodes)} if of_sphere else {}
    wrap = "EXTEND" if texture.get("wrap", "repeat") == "clamp" else "REPEAT"
    return nodes.add("ShaderNodeTexImage", inputs, image=image, extension=wrap).outputs["Color"]


def sphere_uv(nodes):
    """u = 1/2 + atan2(x, z)/2pi, v = 1/2 + asin(y)/pi of the normal, seen from outside."""
    normal = nodes.add("ShaderNodeNewGeometry").outputs["Normal"]
    x, y, z = nodes.add("ShaderNodeSeparateXYZ", {0: normal}).outputs
    u = nodes.math("MULTIPLY_ADD", nodes.math("ARCTAN2", x, z), 0.5 / math.pi, 0.5)
    v = nodes.math("MULTIPLY_ADD", nodes.math("ARCSINE", y), 1 / math.pi, 0.5)
    return nodes.add("ShaderNodeCombineXYZ", {0: u, 1: v}).outputs[0]


def shader_of(nodes, kind, colour, model, of_sphere):
    node = nodes.add(kind)
    if colour.texture is None:
        node.inputs["Color"].default_value = (*colour.scale, 1.0)
        return node.outputs[0]
    value = texture_node(nodes, model, colour.texture, of_sphere)
    if tuple(colour.scale) != (1, 1, 1):
        factors = {0: value, 1: colour.scale}
        value = nodes.add("ShaderNodeVectorMath", factors, operation="MULTIPLY").outputs[0]
    nodes.tree.links.new(value, node.inputs["Color"])
    return node.outputs[0]


def make_material(material, model, of_sphere=False):
    result = bpy.data.materials.new(material.name)
    result.use_nodes = True
    result.cycles.sample_as_light = False
    nodes = Nodes(result.node_tree)
    shaders = [
        shader_of(nodes, "ShaderNodeEmission", colour, model, of_sphere) for colour in material.glow
    ]
    if not material.diffuse.is_black():
        shaders.append(
            shader_of(nodes, "ShaderNodeBsdfDiffuse", material.diffuse, model, of_sphere)
        )
    if material.reflection > 0:
        gloss = {"Color": (*[material.reflection] * 3, 1.0), "Roughness": 0.0}
        mirror = nodes.add("ShaderNodeBsdfGlossy", gloss, distribution="SHARP")
        shaders.append(mirror.outputs[0])
    if not shaders:
        shaders.append(nodes.add("ShaderNodeEmission", {"Strength": 0.0}).outputs[0])
    surface = shaders[0]
    for shader in shaders[1:]:
        surface = nodes.add("ShaderNodeAddShader", {0: surface, 1: shader}).outputs[0]
    if material.transmission > 0:
        clear = nodes.add("ShaderNodeBsdfTransparent").outputs[0]
        mix = {0: material.transmission, 1: surface, 2: clear}
        surface = nodes.add("ShaderNodeMixShader", mix).outputs[0]
    nodes.add("ShaderNodeOutputMaterial", {"Surface": surface})
    return result


# ---- Objects


def add_mesh(name, mesh, material):
    data = bpy.data.meshes.new(name)
    data.from_pydata(mesh.positions.tolist(), [], mesh.triangles.tolist())
    corners = mesh.triangles.ravel()
    if mesh.uvs is not None:
        layer = data.uv_layers.new(name="UVMap")
        layer.data.foreach_set("uv", mesh.uvs[corners].astype(np.float32).ravel())
    if mesh.normals is not None:
        data.polygons.foreach_set("use_smooth", np.ones(len(mesh.triangles), bool))
        data.use_auto_smooth = True
        data.auto_smooth_angle = math.pi
        data.normals_split_custom_set(mesh.normals[corners].tolist())
    data.update()
    data.materials.append(material)
    return add_object(name, data)


def add_spheres(name, spheres, material):
    """Points with a radius, which Cycles intersects as exact spheres."""
    data = bpy.data.meshes.new(name)
    data.from_pydata([sphere.center for sphere in spheres], [], [])
    radius = data.attributes.new("sphere_radius", "FLOAT", "POINT")
    radius.data.foreach_set("value", [sphere.radius for sphere in spheres])
    data.materials.append(material)
    thing = add_object(name, data)
    tree = bpy.data.node_groups.new(name, "GeometryNodeTree")
    tree.inputs.new("NodeSocketGeometry", "Geometry")
    tree.outputs.new("NodeSocketGeometry", "Geometry")
    nodes = Nodes(tree)
    given = nodes.add("NodeGroupInput").outputs[0]
    attribute = nodes.add("GeometryNodeInputNamedAttribute", {"Name": "sphere_radius"})
    size = next(socket for socket in attribute.outputs if socket.enabled)
    points = nodes.add("GeometryNodeMeshToPoints", {"Mesh": given, "Radius": size}).outputs[0]
    painted = nodes.add("GeometryNodeSetMaterial", {"Geometry": points, "Material": material})
    nodes.add("NodeGroupOutput", {0: painted.outputs[0]})
    thing.modifiers.new("spheres", "NODES").node_group = tree
    return thing


def add_objects(model):
    materials, spheres, things = {}, {}, []
    for number, (shape, name) in enumerate(model.objects):
        key = (name, isinstance(shape, Sphere))
        if key not in materials:
            materials[key] = make_material(model.materials[name], model, of_sphere=key[1])
        if key[1]:
            spheres.setdefault(name, []).append(shape)
        else:
            things.append(add_mesh(f"object {number}", shape, materials[key]))
    for name, group in spheres.items():
        things.append(add_spheres(f"spheres of {name}", group, materials[(name, True)]))
    for thing in things:
        # No light from surface to surface: what a diffuse bounce would meet is not there.
        thing.visible_diffuse = False
        thing.cycles.shadow_terminator_offset = 0.0
        thing.cycles.shadow_terminator_geometry_offset = 0.0


# ---- Lights


def lamp(kind, light, factor):
    """Intensity i of fstop lights a facing Lambertian surface of albedo a to a i: E = pi i."""
    data = bpy.data.lights.new(light["type"], kind)
    largest = max(light["intensity"])
    data.color = [value / largest for value in light["intensity"]]
    data.energy = largest * factor
    data.cycles.use_multiple_importance_sampling = False
    return data


def falloff(nodes, attenuation):
    """d^2/(a0 + a1 d + a2 d^2): what turns the inverse square into fstop's attenuation."""
    a0, a1, a2 = attenuation
    if a1 == 0 and a2 > 0:
        node = nodes.add("ShaderNodeLightFalloff", {"Strength": 1 / a2, "Smooth": a0 / a2})
        return node.outputs["Quadratic"]
    if a1 == 0 and a2 == 0:
        return nodes.add("ShaderNodeLightFalloff", {"Strength": 1 / a0}).outputs["Constant"]
    d = nodes.add("ShaderNodeLightPath").outputs["Ray Length"]
    below = nodes.math("MULTIPLY_ADD", nodes.math("MULTIPLY_ADD", d, a2, a1), d, a0)
    return nodes.math("DIVIDE", nodes.math("MULTIPLY", d, d), below)


def shade_lamp(data, strength_of):
    data.use_nodes = True
    nodes = Nodes(data.node_tree)
    emission = nodes.add("ShaderNodeEmission", {"Strength": strength_of(nodes)}).outputs[0]
    nodes.add("ShaderNodeOutputLight", {"Surface": emission})


def add_light(light):
    if max(light["intensity"]) == 0:
        return
    attenuation = light.get("attenuation", (1, 0, 0))
    if light["type"] == "directional":
        data = lamp("SUN", light, math.pi)
        data.angle = 0.0
        add_object("sun", data, frame_along((0, 0, 0), -np.array(light["direction"], float)))
        return
    if light["type"] == "area":
        add_area_light(light, attenuation)
        return
    data = lamp("POINT", light, 4 * math.pi**2)
    data.shadow_soft_size = 0.0
    if light["type"] == "point":
        shade_lamp(data, lambda nodes: falloff(nodes, attenuation))
    else:
        shade_lamp(data, lambda nodes: spot_strength(nodes, light, attenuation))
    add_object(light["type"], data, frame_along(light["position_m"], (0, 0, 1)))


def spot_strength(nodes, light, attenuation):
    """max(0, cos)^exponent about the lamp's direction."""
    away = nodes.add("ShaderNodeNewGeometry").outputs["Incoming"]
    axis = tuple(unit(light["direction"]))
    cosine = nodes.add("ShaderNodeVectorMath", {0: away, 1: axis}, operation="DOT_PRODUCT")
    cosine = nodes.math("MAXIMUM", cosine.outputs["Value"], 0.0)
    angular = nodes.math("POWER", cosine, light.get("exponent", 1.0))
    return nodes.math("MULTIPLY", angular, falloff(nodes, attenuation))


def add_area_light(light, attenuation):
    """Two lamps back to back, since Cycles' shine to one side; over the cosine, since fstop's
    points shine alike to all sides."""
    u, v = (np.array(light[key], float) for key in ("edge_u_m", "edge_v_m"))
    if abs(np.dot(u, v)) > 1e-6 * np.linalg.norm(u) * np.linalg.norm(v):
        raise ValueError("an area light must be a rectangle to be matched by Cycles")
    centre = np.array(light["corner_m"], float) + (u + v) / 2

    def strength(nodes):
        geometry = nodes.add("ShaderNodeNewGeometry").outputs
        cosine = nodes.add(
            "ShaderNodeVectorMath",
            {0: geometry["Incoming"], 1: geometry["Normal"]},
            operation="DOT_PRODUCT",
        ).outputs["Value"]
        positive = nodes.math("MAXIMUM", nodes.math("ABSOLUTE", cosine), 1e-6)
        return nodes.math("DIVIDE", falloff(nodes, attenuation), positive)

    for side in (1, -1):
        data = lamp("AREA", light, 4 * math.pi)
        data.shape = "RECTANGLE"
        data.size, data.size_y = float(np.linalg.norm(u)), float(np.linalg.norm(v))
        shade_lamp(data, strength)
        x, y = unit(u), unit(v) * side
        thing = add_object("area", data, frame(centre, x, y, np.cross(x, y)))
        thing.visible_camera = thing.visible_glossy = thing.visible_transmission = False


# ---- Camera, world, settings


def add_camera(camera):
    data = bpy.data.cameras.new("camera")
    data.sensor_fit = "HORIZONTAL"
    data.sensor_width, data.sensor_height = (1e3 * side for side in camera.sensor)
    data.lens = 1e3 * camera.image_distance
    data.clip_start, data.clip_end = 1e-3, 1e6
    data.dof.use_dof = True
    data.dof.focus_distance = camera.focus_distance
    diameter = camera.aperture_diameter
    if camera.blades >= 3:  # fstop's polygon has the disc's area, Cycles' the disc about it
        angle = 2 * math.pi / camera.blades
        diameter *= math.sqrt(angle / math.sin(angle))
        data.dof.aperture_rotation = math.radians(camera.blade_rotation_deg)
    data.dof.aperture_blades = camera.blades
    data.dof.aperture_ratio = 1.0
    data.dof.aperture_fstop = camera.image_distance / diameter
    matrix = frame(camera.position, camera.right, camera.up, -camera.forward)
    bpy.context.scene.camera = add_object("camera", data, matrix)


def set_world(background):
    world = bpy.data.worlds.new("world")
    bpy.context.scene.world = world
    world.use_nodes = True
    world.node_tree.nodes["Background"].inputs[0].default_value = (*background, 1)
    world.cycles.sampling_method = "NONE"
    world.cycles_visibility.diffuse = False


def set_cycles(model):
    scene = bpy.context.scene
    render, cycles = scene.render, scene.cycles
    render.engine = "CYCLES"
    cycles.device = "CPU"
    cycles.use_denoising = False
    mirrors = any(material.reflection > 0 for material in model.materials.values())
    sheets = any(material.transmission > 0 for material in model.materials.values())
    cycles.max_bounces = cycles.glossy_bounces = MOST_BOUNCES if mirrors else 0
    cycles.diffuse_bounces = cycles.transmission_bounces = cycles.volume_bounces = 0
    cycles.transparent_max_bounces = 4 * MOST_BOUNCES if sheets else 0
    cycles.sample_clamp_direct = cycles.sample_clamp_indirect = 0.0
    cycles.light_sampling_threshold = 0.0
    cycles.caustics_reflective = mirrors
    cycles.caustics_refractive = False
    cycles.blur_glossy = 0.0
    cycles.pixel_filter_type = "BOX"  # always one pixel wide
    cycles.sampling_pattern = "PROGRESSIVE_MULTI_JITTER"
    render.resolution_x, render.resolution_y = model.camera.pixels
    render.resolution_percentage = 100
    render.use_compositing = render.use_sequencer = False
    scene.view_settings.view_transform = "Raw"
    render.image_settings.file_format = "OPEN_EXR_MULTILAYER"
    render.image_settings.color_depth = "32"
    render.image_settings.exr_codec = "ZIP"


def main():
    scene_file, request_file, out = sys.argv[sys.argv.index("--") + 1 :]
    with open(request_file, encoding="utf-8") as file:
        model = read_model(scene_file, json.load(file))
    bpy.ops.wm.read_factory_settings(use_empty=True)
    add_objects(model)
    for light in model.lights:
        add_light(light)
    add_camera(model.camera)
    set_world(model.background)
    set_cycles(model)
    bpy.ops.wm.save_as_mainfile(filepath=os.path.abspath(out))


main()
