# SPDX-FileCopyrightText: 2026 The VoxelPipe authors
# SPDX-License-Identifier: Apache-2.0
"""Voxels of the selected objects in Blender: a mesh of cubes, a volume object, or a file."""

import os
import tempfile
import warnings

import bpy
import numpy as np
import voxelpipe as vp
from bpy.props import BoolProperty, EnumProperty, IntProperty, StringProperty

# What has a surface once it is evaluated.
KINDS = {"MESH", "CURVE", "SURFACE", "FONT", "META"}
# The outward quad of a voxel's side in each direction: corners relative to the voxel.
SIDES = (
    ((-1, 0, 0), ((0, 0, 0), (0, 0, 1), (0, 1, 1), (0, 1, 0))),
    ((1, 0, 0), ((1, 0, 0), (1, 1, 0), (1, 1, 1), (1, 0, 1))),
    ((0, -1, 0), ((0, 0, 0), (1, 0, 0), (1, 0, 1), (0, 0, 1))),
    ((0, 1, 0), ((0, 1, 0), (0, 1, 1), (1, 1, 1), (1, 1, 0))),
    ((0, 0, -1), ((0, 0, 0), (0, 1, 0), (1, 1, 0), (1, 0, 0))),
    ((0, 0, 1), ((0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1))),
)


class Refused(Exception):
    """A reason that the user can act on."""


def model_of_selection(context, folder):
    """The selected objects as they are drawn: with modifiers, materials and textures, in Blender's world axes.

    Blender's own glTF exporter evaluates them, and voxelpipe's reader takes what it writes."""
    objects = [o for o in context.selected_objects if o.type in KINDS]
    if not objects:
        raise Refused("Select an object that has a surface")
    path = os.path.join(folder, "selection.glb")
    others = [o for o in context.selected_objects if o not in objects]
    for o in others:
        o.select_set(False)
    try:
        bpy.ops.export_scene.gltf(
            filepath=path,
            export_format="GLB",
            use_selection=True,
            export_apply=True,
            export_yup=False,
            export_animations=False,
            export_skins=False,
            export_morph=False,
        )
    finally:
        for o in others:
            o.select_set(True)
    return vp.load_model(path)


def voxels_of(model, resolution, fill, repair):
    """(voxels (n, 3), colours (n, 4) of uint8 in sRGB, grid)."""
    grid = vp.fit(model, resolution)
    solid = "nonzero" if fill == "SOLID" else None
    voxels, values = vp.sparse(model, grid, "color", solid=solid, repair=repair if solid else "none")
    if not len(voxels):
        raise Refused("Nothing of the selection is in a voxel")
    return np.asarray(voxels), values["color"], grid


def outer_sides(voxels):
    """Sides of voxels that no other voxel shares: corners (m, 4, 3) and the number of the voxel that each belongs to."""
    extent = voxels.max(axis=0).astype(np.int64) + 3  # a layer around, so that no neighbour wraps
    step = np.array([1, extent[0], extent[0] * extent[1]])
    keys = (voxels + 1) @ step
    known = np.sort(keys)
    corners, owners = [], []
    for direction, quad in SIDES:
        wanted = keys + np.dot(direction, step)
        at = np.minimum(np.searchsorted(known, wanted), len(known) - 1)
        bare = np.flatnonzero(known[at] != wanted)
        corners.append(voxels[bare, None, :] + np.array(quad))
        owners.append(bare)
    return np.concatenate(corners), np.concatenate(owners)


def linear(srgb):
    """sRGB in uint8 as linear floats."""
    c = srgb.astype(np.float32) / 255
    return np.where(c <= 0.04045, c / 12.92, ((c + 0.055) / 1.055) ** 2.4)


def color_material(name, attribute, shader, socket):
    """A material whose colour is an attribute of its object."""
    material = bpy.data.materials.new(name)
    material.use_nodes = True
    nodes, links = material.node_tree.nodes, material.node_tree.links
    nodes.clear()
    output = nodes.new("ShaderNodeOutputMaterial")
    surface = nodes.new(shader)
    source = nodes.new("ShaderNodeAttribute")
    source.attribute_name = attribute
    links.new(source.outputs["Color"], surface.inputs[socket])
    links.new(surface.outputs[0], output.inputs["Volume" if socket == "Color" else "Surface"])
    return material


def cube_mesh(name, voxels, colors, grid):
    """A mesh of the outer sides, with the corner attribute "Color". Vertices are relative to the grid's low corner."""
    corners, owners = outer_sides(voxels)
    flat = corners.reshape(-1, 3).astype(np.int64)
    extent = flat.max(axis=0) + 1
    keys = flat @ np.array([1, extent[0], extent[0] * extent[1]])
    _, first, number = np.unique(keys, return_index=True, return_inverse=True)
    mesh = bpy.data.meshes.new(name)
    mesh.vertices.add(len(first))
    mesh.vertices.foreach_set("co", (flat[first] * np.array(grid.voxel_size)).astype(np.float32).ravel())
    mesh.loops.add(len(flat))
    mesh.loops.foreach_set("vertex_index", number.ravel().astype(np.int32))
    mesh.polygons.add(len(corners))
    mesh.polygons.foreach_set("loop_start", np.arange(0, len(flat), 4, dtype=np.int32))
    attribute = mesh.color_attributes.new("Color", "BYTE_COLOR", "CORNER")
    of_corner = np.repeat(colors[owners].astype(np.float32) / 255, 4, axis=0)
    attribute.data.foreach_set("color_srgb", of_corner.ravel())
    mesh.materials.append(color_material(name, "Color", "ShaderNodeBsdfPrincipled", "Base Color"))
    mesh.update(calc_edges=True)
    mesh.shade_flat()
    return mesh


def openvdb():
    """The module that writes .vdb files, which Blender's builds bring under one of two names."""
    for name in ("openvdb", "pyopenvdb"):
        try:
            module = __import__(name)
        except ImportError:
            continue
        if hasattr(module, "FloatGrid"):  # a folder of that name is a module, too
            return module
    raise Refused("This Blender has no Python module of OpenVDB: take cubes, or a file")


def volume(name, path, voxels, colors, grid):
    """A volume that reads `path`, a .vdb with "density", 1 in voxels, and "color", linear."""
    vdb = openvdb()
    low = voxels.min(axis=0)
    at = tuple((voxels - low).T)
    shape = tuple(voxels.max(axis=0) - low + 1)
    size = grid.voxel_size
    # OpenVDB's voxels lie around whole numbers.
    place = [float(o + s * (k + 0.5)) for o, s, k in zip(grid.origin, size, low)]
    matrix = [[size[0], 0, 0, 0], [0, size[1], 0, 0], [0, 0, size[2], 0], [*place, 1]]
    density = np.zeros(shape, np.float32)
    density[at] = 1
    color = np.zeros((*shape, 3), np.float32)
    color[at] = linear(colors[:, :3])
    grids = []
    for kind, title, values in ((vdb.FloatGrid, "density", density), (vdb.Vec3SGrid, "color", color)):
        one = kind()
        one.name = title
        one.copyFromArray(values)
        one.transform = vdb.createLinearTransform(matrix)
        grids.append(one)
    vdb.write(path, grids=grids)
    data = bpy.data.volumes.new(name)
    data.filepath = path
    data.materials.append(color_material(name, "color", "ShaderNodeVolumePrincipled", "Color"))
    return data


class VOXELPIPE_OT_voxelize(bpy.types.Operator):
    """Make exact voxels of the selected objects, as they are drawn"""

    bl_idname = "object.voxelpipe"
    bl_label = "Voxelize"
    bl_options = {"REGISTER", "UNDO"}

    resolution: IntProperty(name="Resolution", description="Voxels along the longest side", default=64, min=1, max=4096)
    fill: EnumProperty(
        name="Fill",
        items=[("SURFACE", "Surface", "Voxels that the surface touches"), ("SOLID", "Solid", "The inside, too")],
    )
    repair: EnumProperty(
        name="Holes",
        description="What makes a solid of a mesh with holes",
        items=[
            ("none", "As they are", "For closed meshes"),
            ("close_holes", "Close", "Cones over the edges of holes"),
            ("exterior", "Flood", "All that the outside does not reach"),
            ("vote", "Vote", "The majority of rays along three axes"),
            ("winding", "Winding number", "Where the mesh covers at least half of what a point sees"),
        ],
    )
    output: EnumProperty(
        name="Output",
        items=[
            ("CUBES", "Cubes", "A mesh of the voxels' outer sides, with colours"),
            ("VOLUME", "Volume", "A volume object that reads a .vdb file"),
            ("FILE", "File", ".vox, .schem, .nvdb, .npz, .vti and others"),
        ],
    )
    filepath: StringProperty(name="File", description="Of a volume or a file", subtype="FILE_PATH")
    keep_selected: BoolProperty(name="Show Originals", default=False, description="Leave the originals visible")

    @classmethod
    def poll(cls, context):
        return context.mode == "OBJECT"

    def path(self, ending):
        path = bpy.path.abspath(self.filepath)
        if path:
            return path if not ending or path.endswith(ending) else path + ending
        if not ending:
            raise Refused("Name the file: " + " ".join(vp.formats()))
        # Beside the .blend, once that has a name.
        folder = os.path.dirname(bpy.data.filepath) or bpy.app.tempdir or tempfile.gettempdir()
        return os.path.join(folder, "voxels" + ending)

    def make(self, context, folder):
        originals = list(context.selected_objects)
        name = (context.active_object or originals[0]).name + " voxels" if originals else "voxels"
        model = model_of_selection(context, folder)
        voxels, colors, grid = voxels_of(model, self.resolution, self.fill, self.repair)
        if self.output == "FILE":
            written = vp.save(self.path(""), (voxels, {"color": colors}), grid, up="z")
            self.report({"INFO"}, f"{len(voxels)} voxels in {', '.join(written)}")
            return
        if self.output == "CUBES":
            made = bpy.data.objects.new(name, cube_mesh(name, voxels, colors, grid))
            made.location = grid.origin
        else:
            made = bpy.data.objects.new(name, volume(name, self.path(".vdb"), voxels, colors, grid))
        context.collection.objects.link(made)
        for o in originals:
            o.select_set(False)
            if not self.keep_selected:
                o.hide_set(True)
                o.hide_render = True
        made.select_set(True)
        context.view_layer.objects.active = made
        self.report({"INFO"}, f"{len(voxels)} voxels of {' x '.join(str(n) for n in reversed(grid.shape))}")

    def execute(self, context):
        try:
            with tempfile.TemporaryDirectory() as folder, warnings.catch_warnings(record=True) as said:
                warnings.simplefilter("always")
                self.make(context, folder)
        except (Refused, ValueError, IndexError, MemoryError, OSError, RuntimeError) as e:
            self.report({"ERROR"}, str(e) or type(e).__name__)
            return {"CANCELLED"}
        for text in dict.fromkeys(str(w.message) for w in said if "voxelpipe" in type(w.message).__module__):
            self.report({"WARNING"}, text)
        return {"FINISHED"}

    def invoke(self, context, event):
        return context.window_manager.invoke_props_dialog(self)

    def draw(self, context):
        self.layout.use_property_split = True
        for name in ("resolution", "fill", "repair", "output", "filepath", "keep_selected"):
            if name == "repair" and self.fill != "SOLID" or name == "filepath" and self.output == "CUBES":
                continue
            if name == "keep_selected" and self.output == "FILE":
                continue
            self.layout.prop(self, name)


def in_menu(self, context):
    self.layout.operator(VOXELPIPE_OT_voxelize.bl_idname, text="Voxelize", icon="MESH_CUBE")


def register():
    bpy.utils.register_class(VOXELPIPE_OT_voxelize)
    bpy.types.VIEW3D_MT_object.append(in_menu)
    bpy.types.VIEW3D_MT_object_context_menu.append(in_menu)


def unregister():
    bpy.types.VIEW3D_MT_object_context_menu.remove(in_menu)
    bpy.types.VIEW3D_MT_object.remove(in_menu)
    bpy.utils.unregister_class(VOXELPIPE_OT_voxelize)
