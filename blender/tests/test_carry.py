"""What a result has of its input."""

import bpy
import numpy as np
import pytest
from support import (
    array,
    corner_positions,
    cube,
    edges_where,
    face_areas_in_uv,
    grid,
    positions,
    remesh,
    sphere,
)


def test_the_result_has_exactly_the_vertices_asked_for_on_the_surface():
    sphere()
    mesh = remesh(700).data
    assert len(mesh.vertices) == 700
    assert len(mesh.polygons) == 2 * 700 - 4
    assert np.abs(np.linalg.norm(positions(mesh), axis=1) - 1).max() < 0.02
    edges = positions(mesh)[array(mesh.edges, "vertices", 2, np.int32)]
    lengths = np.linalg.norm(edges[:, 0] - edges[:, 1], axis=1)
    assert lengths.std() / lengths.mean() < 0.2


def test_materials_keep_their_faces_and_a_straight_border():
    square = grid()
    for name in ("left", "right"):
        square.data.materials.append(bpy.data.materials.new(name))
    for polygon in square.data.polygons:
        polygon.material_index = int(polygon.center.x > 0)
    mesh = remesh().data
    assert [material.name for material in mesh.materials] == ["left", "right"]
    index = array(mesh.polygons, "material_index", dtype=np.int32)
    sides = corner_positions(mesh).reshape(-1, 3, 3)[:, :, 0]
    assert sides[index == 0].max() < 1e-5 and sides[index == 1].min() > -1e-5
    assert 0.4 < index.mean() < 0.6


def test_borders_of_materials_are_crossed_if_they_are_not_kept():
    square = grid()
    for polygon in square.data.polygons:
        polygon.material_index = int(polygon.center.x > 0)
    mesh = remesh(keep_materials=False).data
    sides = corner_positions(mesh).reshape(-1, 3, 3)[:, :, 0]
    assert ((sides.min(axis=1) < -1e-3) & (sides.max(axis=1) > 1e-3)).any()
    assert set(array(mesh.polygons, "material_index", dtype=np.int32)) == {0, 1}


def test_each_side_of_a_seam_has_its_own_texture_coordinates():
    ball = sphere()
    before = ball.data.uv_layers.active.name
    mesh = remesh(900).data
    assert mesh.uv_layers.active.name == before
    u, v = array(mesh.uv_layers.active.data, "uv", 2).T
    # Longitude and latitude, as Blender lays out a sphere.
    x, y, z = corner_positions(mesh).T
    poles = np.abs(z) > 0.95
    turn = (u - np.arctan2(y, x) / (2 * np.pi)) % 1
    turn = (turn - np.median(turn) + 0.5) % 1 - 0.5
    assert np.abs(turn[~poles]).max() < 0.01
    assert np.abs(v - 0.5 - np.arcsin(np.clip(z, -1, 1)) / np.pi)[~poles].max() < 0.01
    # No face spans the whole texture, as it would across a seam.
    assert np.ptp(u.reshape(-1, 3), axis=1).max() < 0.5


def test_the_texture_of_a_cube_covers_the_same_area_in_all_maps():
    box = cube()
    second = box.data.uv_layers.new(name="second")
    flat = array(second.data, "uv", 2)
    second.data.foreach_set("uv", (flat * 0.5 + 0.25).ravel())
    mesh = remesh(400).data
    assert [layer.name for layer in mesh.uv_layers] == ["UVMap", "second"]
    areas = face_areas_in_uv(mesh)
    assert areas.min() > 0 and areas.sum() == pytest.approx(6 / 16, rel=1e-3)
    first, second = (array(layer.data, "uv", 2) for layer in mesh.uv_layers)
    assert np.abs(second - first * 0.5 - 0.25).max() < 1e-4


def test_vertex_groups_are_interpolated_and_stay_with_their_names():
    square = grid()
    square.vertex_groups.new(name="empty")
    slope = square.vertex_groups.new(name="slope")
    for vertex in square.data.vertices:
        if vertex.co.x > 0:
            slope.add([vertex.index], vertex.co.x, "REPLACE")
    mesh = remesh(300).data
    assert [group.name for group in bpy.context.object.vertex_groups] == ["empty", "slope"]
    x = positions(mesh)[:, 0]
    weights = np.zeros(len(x))
    for vertex in mesh.vertices:
        for element in vertex.groups:
            assert element.group == 1
            weights[vertex.index] = element.weight
    assert np.abs(weights - np.maximum(x, 0)).max() < 1e-4
    assert (weights > 0).sum() < len(x)


def test_colours_are_interpolated_per_vertex_and_per_corner():
    square = grid()
    mesh = square.data
    points = mesh.color_attributes.new("smooth", "FLOAT_COLOR", "POINT")
    xyz = positions(mesh)
    points.data.foreach_set("color", np.column_stack([xyz / 2 + 0.5, np.ones(len(xyz))]).ravel())
    corners = mesh.color_attributes.new("halves", "BYTE_COLOR", "CORNER")
    for polygon in mesh.polygons:
        for loop in polygon.loop_indices:
            corners.data[loop].color = (1, 0, 0, 1) if polygon.center.y > 0 else (0, 0, 1, 1)
    mesh.color_attributes.active_color = corners
    mesh = remesh(400).data
    smooth = array(mesh.color_attributes["smooth"].data, "color", 4)
    assert np.abs(smooth[:, :3] - positions(mesh) / 2 - 0.5).max() < 1e-4
    assert mesh.color_attributes.active_color.name == "halves"
    middle = corner_positions(mesh).reshape(-1, 3, 3)[:, :, 1].mean(axis=1)
    red = array(mesh.color_attributes["halves"].data, "color", 4).reshape(-1, 3, 4)[..., 0]
    # Half an edge around the border is either, because the border of colours is not kept.
    assert (red[middle > 0.15] == 1).all() and (red[middle < -0.15] == 0).all()


def test_marked_edges_are_lines_of_the_result_with_the_same_marks():
    square = grid()
    for edge in square.data.edges:
        ends = [square.data.vertices[index].co for index in edge.vertices]
        edge.use_edge_sharp = all(abs(end.x) < 1e-6 for end in ends)
        edge.use_seam = all(abs(end.y - 0.5) < 1e-6 for end in ends)
    mesh = remesh(300).data
    for name, axis, at in (("use_edge_sharp", 0, 0), ("use_seam", 1, 0.5)):
        ends = edges_where(mesh, name)
        assert np.abs(ends[:, :, axis] - at).max() < 1e-5
        assert np.linalg.norm(ends[:, 0] - ends[:, 1], axis=1).sum() == pytest.approx(2, rel=1e-4)


def test_marks_disappear_with_lines_that_are_not_kept():
    square = grid()
    for edge in square.data.edges:
        ends = [square.data.vertices[index].co for index in edge.vertices]
        edge.use_edge_sharp = all(abs(end.x) < 1e-6 for end in ends)
    mesh = remesh(300, keep_sharp=False).data
    length = np.linalg.norm(np.diff(edges_where(mesh, "use_edge_sharp"), axis=1), axis=-1).sum()
    assert length < 1


def test_creases_keep_their_weights():
    box = cube()
    crease = box.data.attributes.new("crease_edge", "FLOAT", "EDGE")
    top = [all(box.data.vertices[i].co.z > 0 for i in edge.vertices) for edge in box.data.edges]
    crease.data.foreach_set("value", np.array(top, np.float32) * 0.75)
    mesh = remesh(400).data
    values = array(mesh.attributes["crease_edge"].data, "value")
    assert set(values.tolist()) == {0.0, 0.75}
    ends = positions(mesh)[array(mesh.edges, "vertices", 2, np.int32)][values > 0]
    assert np.linalg.norm(ends[:, 0] - ends[:, 1], axis=1).sum() == pytest.approx(8, rel=1e-3)
    assert np.abs(ends[..., 2] - 1).max() < 1e-5


def test_shape_keys_stay_with_their_values_and_drivers():
    ball = sphere()
    ball.shape_key_add(name="Basis")
    wide = ball.shape_key_add(name="wide")
    for point in wide.data:
        if point.co.z > 0:
            point.co.x *= 2
    wide.value = 0.25
    wide.slider_max = 3
    wide.driver_add("value").driver.expression = "0.5"
    mesh = remesh(600).data
    assert len(mesh.vertices) == 600
    basis, wide = mesh.shape_keys.key_blocks
    assert (basis.name, wide.name, wide.slider_max) == ("Basis", "wide", 3)
    assert mesh.shape_keys.animation_data.drivers[0].driver.expression == "0.5"
    rest, moved = (array(key.data, "co", 3) for key in (basis, wide))
    np.testing.assert_allclose(rest, positions(mesh), atol=1e-6)
    # Apart from the triangles around the equator, which bend.
    above, below = rest[:, 2] > 0.3, rest[:, 2] < -0.3
    np.testing.assert_array_equal(moved[below], rest[below])
    np.testing.assert_allclose(moved[above], rest[above] * [2, 1, 1], atol=0.02)


def test_other_attributes_of_vertices_and_faces_are_carried_over():
    square = grid()
    mesh = square.data
    heat = mesh.attributes.new("heat", "FLOAT", "POINT")
    heat.data.foreach_set("value", positions(mesh)[:, 0].copy())
    part = mesh.attributes.new("part", "INT", "FACE")
    part.data.foreach_set("value", [int(p.center.x > 0) + 7 for p in mesh.polygons])
    mesh.polygons.foreach_set("use_smooth", [p.center.x > 0 for p in mesh.polygons])
    mesh = remesh(300).data
    heat = array(mesh.attributes["heat"].data, "value")
    np.testing.assert_allclose(heat, positions(mesh)[:, 0], atol=1e-4)
    part = array(mesh.attributes["part"].data, "value", dtype=np.int32)
    middle = corner_positions(mesh).reshape(-1, 3, 3)[:, :, 0].mean(axis=1)
    np.testing.assert_array_equal(part[np.abs(middle) > 1e-3], 7 + (middle[np.abs(middle) > 1e-3] > 0))
    is_smooth = array(mesh.polygons, "use_smooth", dtype=np.bool_)
    np.testing.assert_array_equal(is_smooth, part == 8)
