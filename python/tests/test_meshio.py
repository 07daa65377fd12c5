"""Meshes of meshio with their data."""

import copy

import numpy as np
import pytest

import rtfmesh

meshio = pytest.importorskip("meshio")
remesh = pytest.importorskip("rtfmesh.meshio").remesh
split = pytest.importorskip("rtfmesh.meshio").split


@pytest.fixture
def ball(sphere):
    """A closed surface with data of all kinds."""
    centres = sphere.vertices[sphere.faces].mean(axis=1)
    return meshio.Mesh(
        sphere.vertices,
        [("triangle", sphere.faces)],
        point_data={"height": sphere.vertices[:, 2], "place": sphere.vertices},
        cell_data={"octant": [(centres > 0) @ [1, 2, 4]]},
        field_data={"steel": np.array([7, 2])},
    )


def grid(n):
    """Points and quads of the unit square."""
    x, y = np.meshgrid(np.linspace(0, 1, n + 1), np.linspace(0, 1, n + 1), indexing="ij")
    corner = np.arange((n + 1) * (n + 1)).reshape(n + 1, n + 1)
    quads = [corner[:-1, :-1], corner[1:, :-1], corner[1:, 1:], corner[:-1, 1:]]
    return np.column_stack([x.ravel(), y.ravel()]), np.stack(quads, axis=-1).reshape(-1, 4)


def area(points, triangles):
    """The sum of signed areas, seen from above."""
    a, b, c = (points[triangles[:, k]] for k in range(3))
    return np.cross(b - a, c - a)[:, 2].sum() / 2


def test_data_of_points_and_cells_come_along_and_the_source_stays(ball):
    before = copy.deepcopy(ball)
    even = remesh(ball, 400)
    assert type(even) is meshio.Mesh and even.points.shape == (400, 3)
    assert [block.type for block in even.cells] == ["triangle"]
    assert np.allclose(even.point_data["height"], even.points[:, 2], atol=0.03)
    assert even.point_data["place"].shape == (400, 3)
    (octants,) = even.cell_data["octant"]
    assert octants.dtype.kind in "iu"
    centres = even.points[even.cells_dict["triangle"]].mean(axis=1)
    far = (np.abs(centres) > 0.2).all(axis=1)
    assert far.sum() > 100 and (octants == (centres > 0) @ [1, 2, 4])[far].all()
    assert even.field_data["steel"].tolist() == [7, 2]
    even.field_data["steel"][0] = 8
    for name in ("points", "point_data", "cells_dict", "cell_data", "field_data"):
        np.testing.assert_equal(getattr(ball, name), getattr(before, name))


def test_triangles_quads_and_polygons_of_one_mesh_are_one_surface():
    points, quads = grid(8)
    points = np.column_stack([points, np.zeros(len(points))])
    # Two squares side by side make a polygon of six corners.
    first, second = quads[::2], quads[1::2]
    hexagons = np.column_stack([first[:, 0], first[:, 1], second[:, [1, 2, 3]], first[:, 3]])
    mixed = meshio.Mesh(
        points,
        [
            ("polygon", hexagons[:16]),
            ("quad", quads[32:48]),
            ("triangle", quads[48:][:, [0, 1, 2, 0, 2, 3]].reshape(-1, 3)),
        ],
        cell_data={"block": [np.full(16, 0), np.full(16, 1), np.full(32, 2)]},
    )
    even = remesh(mixed, 300)
    triangles = even.cells_dict["triangle"]
    assert len(even.points) == 300 and area(even.points, triangles) == pytest.approx(1)
    x = even.points[triangles].mean(axis=1)[:, 0]
    (block,) = even.cell_data["block"]
    assert (block[x < 0.45] == 0).all() and (block[x > 0.8] == 2).all()
    assert (block[(x > 0.55) & (x < 0.7)] == 1).all()


def test_quads_that_are_not_convex_do_not_fold():
    # An arrow head, from each of its corners.
    points = np.array([[0, 0, 0], [2, 1, 0], [0, 2, 0], [1, 1, 0]], float)
    for start in range(4):
        polygon = np.roll(np.arange(4), start)[None]
        a, b, c = (points[split(polygon, points)[0][:, k]] for k in range(3))
        assert np.cross(b - a, c - a)[:, 2].tolist() == [1, 1], start


def test_points_in_the_plane_stay_there():
    points, quads = grid(6)
    even = remesh(meshio.Mesh(points, [("quad", quads)]), 150)
    assert even.points.shape == (150, 2)
    assert np.ptp(even.points, axis=0) == pytest.approx([1, 1])


def test_vertices_and_lines_between_the_triangles_are_left_out(ball):
    lines = [("vertex", [[0]]), ("line", [[0, 1], [1, 2]]), *ball.cells, ("line", [[2, 3]])]
    octant = ball.cell_data["octant"][0]
    data = [np.array([9]), np.array([9, 9]), octant, np.array([9])]
    even = remesh(meshio.Mesh(ball.points, lines, cell_data={"octant": data}), 200)
    alone = remesh(ball, 200)
    assert [block.type for block in even.cells] == ["triangle"]
    assert np.array_equal(even.points, alone.points)
    assert np.array_equal(even.cell_data["octant"][0], alone.cell_data["octant"][0])
    with pytest.raises(rtfmesh.InputError):
        remesh(meshio.Mesh(ball.points, lines[:2], cell_data={"octant": data[:2]}), 200)


def test_a_result_goes_through_files(ball, tmp_path):
    for name in ("ball.vtu", "ball.msh", "ball.obj"):
        meshio.write(tmp_path / name, remesh(ball, 200))
        again = meshio.read(tmp_path / name)
        assert again.points.shape == (200, 3)
        assert len(remesh(again, 100, quality="draft").points) == 100


def test_what_is_no_surface_is_told_with_a_remedy(ball):
    solid = meshio.Mesh(np.eye(4, 3), [("tetra", [[0, 1, 2, 3]])])
    with pytest.raises(rtfmesh.InputError, match=r"type tetra;.*surface"):
        remesh(solid, 100)
    with pytest.raises(rtfmesh.InputError, match="not a meshio"):
        remesh(ball.points, 100)
    with pytest.raises(rtfmesh.InputError, match=r"cells\[0\].*there are 4 points"):
        remesh(meshio.Mesh(np.eye(4, 3), [("triangle", [[0, 1, 4]])]), 100)
    with pytest.raises(rtfmesh.InputError, match=r"cell_data\['x'\]"):
        blocks = [("triangle", [[0, 1, 2]]), ("triangle", [[1, 2, 3]])]
        remesh(meshio.Mesh(np.eye(4, 3), blocks, cell_data={"x": [[1.0], [[1.0, 2.0]]]}), 100)
    with pytest.raises(rtfmesh.InputError, match="`weld`"):
        remesh(ball, 100, weld=3)
