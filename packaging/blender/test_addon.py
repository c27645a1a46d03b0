# SPDX-FileCopyrightText: 2026 The VoxelPipe authors
# SPDX-License-Identifier: Apache-2.0
"""The add-on in Blender as a module (bpy), without a window. PICTURE=file.png renders what it made by Cycles."""

import os
import sys
from pathlib import Path

import bpy
import numpy as np
import pytest
import voxelpipe as vp

sys.path.insert(0, os.environ.get("VOXELPIPE_ADDON", str(Path(__file__).parent)))
import voxelpipe_addon  # noqa: E402


@pytest.fixture(autouse=True)
def scene():
    bpy.ops.wm.read_factory_settings(use_empty=True)
    voxelpipe_addon.register()
    yield
    voxelpipe_addon.unregister()


def material(name, rgb):
    m = bpy.data.materials.new(name)
    m.use_nodes = True
    m.node_tree.nodes["Principled BSDF"].inputs["Base Color"].default_value = (*rgb, 1)
    return m


def box(low, high, rgb=(0.8, 0.8, 0.8)):
    size = np.subtract(high, low)
    bpy.ops.mesh.primitive_cube_add(size=1, location=np.add(low, high) / 2)
    bpy.context.object.scale = size
    bpy.context.object.data.materials.append(material("m", rgb))
    return bpy.context.object


def select(*objects):
    bpy.ops.object.select_all(action="DESELECT")
    for o in objects:
        o.select_set(True)
    bpy.context.view_layer.objects.active = objects[0]


def loops(mesh):
    at = np.empty(len(mesh.loops), np.int32)
    mesh.loops.foreach_get("vertex_index", at)
    return at


def places(o):
    at = np.empty(len(o.data.vertices) * 3, np.float32)
    o.data.vertices.foreach_get("co", at)
    return at.reshape(-1, 3) + np.array(o.location)


def volume_inside(o):
    """By the divergence theorem, over the quads."""
    quads = places(o)[loops(o.data)].reshape(-1, 4, 3).astype(np.float64)
    a, b, c, d = quads.transpose(1, 0, 2)
    return (np.einsum("ij,ij->i", a, np.cross(b, c)) + np.einsum("ij,ij->i", a, np.cross(c, d))).sum() / 6


def test_cubes_lie_where_the_object_lies():
    o = box((1, 2, 3), (5, 4, 4), (0.5, 0.1, 0.02))
    select(o)
    assert bpy.ops.object.voxelpipe(resolution=40, fill="SOLID") == {"FINISHED"}
    made = bpy.context.object
    assert made is not o and made.type == "MESH" and made.name.endswith("voxels")
    assert o.hide_get() and o.hide_render and not made.hide_get()
    size = max(made.dimensions) / 40
    at = places(made)
    assert np.allclose(at.min(axis=0), (1, 2, 3), atol=2 * size) and np.allclose(at.max(axis=0), (5, 4, 4), atol=2 * size)
    # Every edge is shared by two sides, and they face outward.
    quads = loops(made.data).reshape(-1, 4)
    edges = np.concatenate([quads[:, [k, (k + 1) % 4]] for k in range(4)])
    assert sorted(map(tuple, edges)) == sorted(map(tuple, edges[:, ::-1]))
    inside = volume_inside(made)
    assert 8 < inside < 8 * 1.25
    assert not made.data.validate()
    assert not any(p.use_smooth for p in made.data.polygons)
    color = np.empty(len(made.data.loops) * 4, np.float32)
    made.data.color_attributes["Color"].data.foreach_get("color", color)
    assert np.allclose(color.reshape(-1, 4)[:, :3], (0.5, 0.1, 0.02), atol=0.01)


def test_modifiers_several_objects_and_what_has_no_surface():
    o = box((0, 0, 0), (1, 1, 1), (1, 0, 0))
    o.modifiers.new("three", "ARRAY").count = 3
    other = box((0, 3, 0), (1, 4, 1), (0, 0, 1))
    bpy.ops.object.camera_add()
    camera = bpy.context.object
    select(o, other, camera)
    bpy.ops.object.voxelpipe(resolution=32, keep_selected=True)
    made = bpy.context.object
    assert np.allclose(places(made).max(axis=0), (3, 4, 1), atol=0.3)
    assert not o.hide_get()
    color = np.empty(len(made.data.loops) * 4, np.float32)
    made.data.color_attributes["Color"].data.foreach_get("color", color)
    red, green, blue, _ = color.reshape(-1, 4).T
    assert red.any() and blue.any() and not green.any()


def test_textures():
    bpy.ops.mesh.primitive_plane_add(size=2)
    o = bpy.context.object
    picture = bpy.data.images.new("halves", 8, 8)
    texels = np.zeros((8, 8, 4), np.float32)
    texels[:, :4] = (1, 0, 0, 1)
    texels[:, 4:] = (0, 1, 0, 1)
    picture.pixels.foreach_set(texels.ravel())
    picture.pack()
    m = material("textured", (1, 1, 1))
    node = m.node_tree.nodes.new("ShaderNodeTexImage")
    node.image = picture
    m.node_tree.links.new(node.outputs["Color"], m.node_tree.nodes["Principled BSDF"].inputs["Base Color"])
    o.data.materials.append(m)
    select(o)
    bpy.ops.object.voxelpipe(resolution=16)
    made = bpy.context.object
    color = np.empty(len(made.data.loops) * 4, np.float32)
    made.data.color_attributes["Color"].data.foreach_get("color", color)
    centre = places(made)[loops(made.data)].reshape(-1, 4, 3).mean(axis=1)[:, 0]
    red, green = color.reshape(-1, 4, 4)[:, 0, :2].T
    assert (red[centre < -0.3] > green[centre < -0.3]).all() and (green[centre > 0.3] > red[centre > 0.3]).all()


@pytest.mark.parametrize("ending", [".vox", ".npz", ".nvdb"])
def test_files(tmp_path, ending):
    select(box((0, 0, 0), (2, 1, 1)))
    path = tmp_path / ("box" + ending)
    assert bpy.ops.object.voxelpipe(resolution=20, output="FILE", filepath=str(path)) == {"FINISHED"}
    assert path.stat().st_size > 100
    if ending == ".npz":
        voxels = next(a for a in np.load(path).values() if a.ndim == 2 and a.shape[1] == 3 and a.dtype.kind == "i")
        assert len(voxels) == 2 * (20 * 10) + 2 * (20 * 8) + 2 * (8 * 8)
        assert (np.ptp(voxels, axis=0) + 1).tolist() == [20, 10, 10]


def test_a_volume(tmp_path):
    o = box((1, 1, 1), (3, 2, 2), (0, 1, 0))
    select(o)
    path = tmp_path / "box.vdb"
    try:
        voxelpipe_addon.openvdb()
    except voxelpipe_addon.Refused:
        with pytest.raises(RuntimeError, match="OpenVDB"):
            bpy.ops.object.voxelpipe(resolution=20, output="VOLUME", filepath=str(path))
        pytest.skip("no Python module of OpenVDB: only the message was tested")
    assert bpy.ops.object.voxelpipe(resolution=20, fill="SOLID", output="VOLUME", filepath=str(path)) == {"FINISHED"}
    made = bpy.context.object
    assert made.type == "VOLUME" and made.data.grids.load()
    assert {g.name: g.data_type for g in made.data.grids} == {"density": "FLOAT", "color": "VECTOR_FLOAT"}
    voxel = 2.0002 / 20
    held, _ = voxelpipe_addon.openvdb().readAll(str(path))
    density = next(g for g in held if g.name == "density")
    low, high = density.evalActiveVoxelBoundingBox()
    first = density.transform.indexToWorld(low)
    assert np.allclose(first, np.array((1, 1, 1)) + voxel / 2, atol=1e-2)
    assert tuple(np.subtract(high, low) + 1) == (20, 10, 10)


def test_what_cannot_be(tmp_path):
    bpy.ops.object.camera_add()
    select(bpy.context.object)
    with pytest.raises(RuntimeError, match="has a surface"):
        bpy.ops.object.voxelpipe(resolution=8)
    assert len(bpy.data.objects) == 1
    o = box((0, 0, 0), (1, 1, 1))
    select(o)
    with pytest.raises(RuntimeError, match="Name the file"):
        bpy.ops.object.voxelpipe(resolution=8, output="FILE")
    with pytest.raises(RuntimeError, match="nonsense"):
        bpy.ops.object.voxelpipe(resolution=8, output="FILE", filepath=str(tmp_path / "a.nonsense"))
    assert not o.hide_get() and len(bpy.data.objects) == 2


def test_a_picture():
    picture = os.environ.get("PICTURE")
    if not picture:
        pytest.skip("PICTURE is not set")
    from mathutils import Vector

    bpy.ops.mesh.primitive_monkey_add(rotation=(-0.6, 0, 0))
    o = bpy.context.object
    o.data.materials.append(material("skin", (0.55, 0.16, 0.05)))
    o.data.materials.append(material("eyes", (0.9, 0.85, 0.7)))
    o.modifiers.new("smooth", "SUBSURF").levels = 2
    for p in o.data.polygons:  # the eyes are the islands in front
        if p.center.z > 0.1 and p.center.y < -0.68 and 0.15 < abs(p.center.x) < 0.6:
            p.material_index = 1
    bpy.ops.mesh.primitive_uv_sphere_add(radius=0.55, location=(1.9, -0.1, -0.43))
    ball = bpy.context.object
    ball.data.materials.append(material("ball", (0.05, 0.2, 0.5)))
    select(o, ball)
    bpy.ops.object.voxelpipe(resolution=96)
    bpy.ops.mesh.primitive_plane_add(size=1000, location=(0, 0, -1))
    bpy.ops.object.light_add(type="SUN", rotation=(0.7, 0.25, 0.4))
    bpy.context.object.data.energy = 4
    bpy.ops.object.light_add(type="AREA", location=(-4, -4, 5), rotation=(0.7, 0, -0.7))
    bpy.context.object.data.energy = 250
    bpy.ops.object.camera_add(location=(2.2, -5.2, 1.7))
    scene = bpy.context.scene
    scene.world = bpy.data.worlds.new("sky")
    scene.world.color = (0.05, 0.06, 0.08)
    scene.camera = bpy.context.object
    scene.camera.rotation_euler = (Vector((0.55, 0, -0.15)) - scene.camera.location).to_track_quat("-Z", "Y").to_euler()
    scene.render.engine = "CYCLES"
    scene.cycles.samples = 48
    scene.render.resolution_x, scene.render.resolution_y = 800, 500
    scene.render.filepath = picture
    bpy.ops.render.render(write_still=True)
    assert Path(picture).stat().st_size > 10000


def test_endings_of_the_description_exist():
    held = voxelpipe_addon.VOXELPIPE_OT_voxelize.__annotations__["output"].keywords["items"][2][2]
    assert all(word.strip(",") in vp.formats() for word in held.split() if word.startswith("."))
