"""Names of arrays in other packages: messages have those that their users know."""

from types import SimpleNamespace

import meshio
import numpy as np
import pytest
import pyvista as pv
import trimesh

import rtfmesh

BOX = rtfmesh.sample("box")


def halves():
    """Truth for each face of the box: whether it is one of the first half."""
    return np.arange(len(BOX.faces)) < len(BOX.faces) // 2


def coloured():
    """A box in two colours."""
    colours = np.where(halves()[:, None], [255, 0, 0, 255], [0, 0, 255, 255]).astype(np.uint8)
    return trimesh.Trimesh(BOX.vertices, BOX.faces, face_colors=colours, process=False)


def with_set():
    """A box with a set of cells."""
    return meshio.Mesh(
        BOX.vertices, [("triangle", BOX.faces)], cell_sets={"right": [np.flatnonzero(halves())]}
    )


@pytest.mark.parametrize("remesh", [rtfmesh.remesh, rtfmesh.trimesh.remesh])
def test_colours_of_trimesh_have_its_name(remesh):
    with pytest.raises(rtfmesh.InputError, match=r"names 'nope'; the faces have 'face_colors'$"):
        remesh(coloured(), 200, keep_labels="nope")
    plain = trimesh.Trimesh(BOX.vertices, BOX.faces, process=False)
    with pytest.raises(rtfmesh.InputError, match=r"names 'face_colors'; the faces have no arrays$"):
        remesh(plain, 200, keep_labels="face_colors")


def test_colours_of_trimesh_are_kept_by_name_everywhere():
    result = rtfmesh.remesh(coloured(), 200, keep_labels="face_colors")
    even = rtfmesh.trimesh.remesh(coloured(), 200, keep_labels="face_colors")
    assert np.array_equal(result.vertices, even.vertices)
    assert np.array_equal(result.attributes.face["rgba"], even.visual.face_colors)
    assert all(type(name) is str for name in result.attributes.face)


def test_sets_of_meshio_have_their_names():
    with pytest.raises(rtfmesh.InputError, match=r"names 'nope'; the faces have 'right'$"):
        rtfmesh.meshio.remesh(with_set(), 200, keep_labels="nope")
    even = rtfmesh.meshio.remesh(with_set(), 200, keep_labels="right")
    result = rtfmesh.remesh(with_set(), 200, keep_labels="right")
    assert np.array_equal(np.flatnonzero(result.attributes.face["right"]), even.cell_sets["right"][0])


def test_clouds_bring_normals_and_colours():
    ball = pv.Sphere(theta_resolution=40, phi_resolution=40)
    points, normals = np.asarray(ball.points, float), np.asarray(ball.point_normals, float)
    colours = np.random.default_rng(1).random(points.shape)
    expected = rtfmesh.reconstruct(points, 300, normals=normals, attributes={"vertex": {"colors": colours}})
    cloud = SimpleNamespace(points=points, normals=normals, colors=colours)
    found = rtfmesh.reconstruct(cloud, 300)
    assert np.array_equal(found.vertices, expected.vertices)
    assert np.array_equal(found.attributes.vertex["colors"], expected.attributes.vertex["colors"])
    red = trimesh.PointCloud(points, colors=np.tile(np.uint8([255, 0, 0, 255]), (len(points), 1)))
    assert (rtfmesh.reconstruct(red, 300).attributes.vertex["rgba"] == [255, 0, 0, 255]).all()
    even = pv.PolyData(points).rtfmesh.reconstruct(300, normals=normals)
    assert np.allclose(even.points, expected.vertices, atol=1e-6)


@pytest.mark.parametrize("wrong", ["x", {"vertex": {"z": BOX.vertices[:, 2]}}])
def test_arrays_beside_those_of_an_object_are_refused(wrong):
    surface = pv.PolyData.from_regular_faces(BOX.vertices, BOX.faces.astype(np.int64))
    calls = (
        surface.rtfmesh.remesh,
        pv.PolyData(BOX.vertices).rtfmesh.reconstruct,
        lambda n, **wanted: rtfmesh.trimesh.remesh(coloured(), n, **wanted),
        lambda n, **wanted: rtfmesh.meshio.remesh(with_set(), n, **wanted),
    )
    for call in calls:
        with pytest.raises(rtfmesh.InputError, match=r"^`attributes` is .*; use True or False"):
            call(200, attributes=wrong)
        with pytest.raises(TypeError, match=r"'correspondence'$"):
            call(200, correspondence=False)
