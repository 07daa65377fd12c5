"""Meshes of trimesh with what they look like."""

import numpy as np
import pytest

import rtfmesh

trimesh = pytest.importorskip("trimesh")
remesh = pytest.importorskip("rtfmesh.trimesh").remesh


@pytest.fixture
def ball():
    """A sphere without colours."""
    return trimesh.creation.icosphere(subdivisions=3)


def test_a_mesh_without_colours_stays_so(ball):
    even = remesh(ball, 300)
    assert type(even) is trimesh.Trimesh and len(even.vertices) == 300
    assert even.is_watertight and even.visual.kind is None
    assert len(ball.vertices) == 642


def test_colours_of_vertices_come_along(ball):
    ball.visual.vertex_colors = [[255, 0, 0, 255] if x > 0 else [0, 0, 255, 128] for x in ball.vertices[:, 0]]
    even = remesh(ball, 300)
    assert even.visual.kind == "vertex" and even.visual.vertex_colors.dtype == np.uint8
    right, left = even.vertices[:, 0] > 0.2, even.vertices[:, 0] < -0.2
    assert (even.visual.vertex_colors[right] == [255, 0, 0, 255]).all()
    assert (even.visual.vertex_colors[left] == [0, 0, 255, 128]).all()


def test_colours_of_faces_come_along(ball):
    ball.visual.face_colors = [
        [9, 9, 9, 255] if z > 0 else [200, 0, 0, 255] for z in ball.triangles_center[:, 2]
    ]
    even = remesh(ball, 300)
    assert even.visual.kind == "face"
    upper = even.triangles_center[:, 2] > 0.2
    assert (even.visual.face_colors[upper] == [9, 9, 9, 255]).all()


def test_texture_coordinates_come_along_with_their_material(ball):
    image = pytest.importorskip("PIL.Image").new("RGB", (4, 4), (1, 2, 3))
    uv = 0.5 + 0.4 * ball.vertices[:, :2]
    ball.visual = trimesh.visual.TextureVisuals(uv=uv, image=image)
    even = remesh(ball, 300)
    assert even.visual.kind == "texture" and len(even.vertices) == 300
    assert np.abs(even.visual.uv - (0.5 + 0.4 * even.vertices[:, :2])).max() < 0.02
    assert even.visual.material.image.getpixel((0, 0)) == (1, 2, 3)


def test_seams_of_a_texture_stay_if_they_are_to(ball):
    # Two halves with a piece of the texture each, and vertices of their own along the cut.
    upper = ball.triangles_center[:, 2] > 0
    halves = [trimesh.Trimesh(ball.vertices, ball.faces[half], process=False) for half in (upper, ~upper)]
    for half in halves:
        half.remove_unreferenced_vertices()
    vertices = np.concatenate([half.vertices for half in halves])
    faces = np.concatenate([halves[0].faces, halves[1].faces + len(halves[0].vertices)])
    offset = np.repeat([0.0, 0.5], [len(half.vertices) for half in halves])
    uv = np.column_stack([0.25 + 0.2 * vertices[:, 0] + offset, 0.5 + 0.2 * vertices[:, 1]])
    parted = trimesh.Trimesh(vertices, faces, process=False)
    parted.visual = trimesh.visual.TextureVisuals(uv=uv)
    even = remesh(parted, 400, keep_uv=True)
    assert len(even.vertices) > 400 and len(even.visual.uv) == len(even.vertices)
    assert len(np.unique(even.vertices, axis=0)) == 400
    across = np.ptp(even.visual.uv[even.faces][:, :, 0], axis=1)
    assert across.max() < 0.3, "a face crosses the seam"


def test_attributes_and_metadata_come_along(ball):
    ball.vertex_attributes["height"] = ball.vertices[:, 2].astype(np.float32)
    ball.face_attributes["octant"] = (ball.triangles_center > 0) @ [1, 2, 4]
    ball.metadata["name"] = "ball"
    even = remesh(ball, 300)
    assert np.allclose(even.vertex_attributes["height"], even.vertices[:, 2], atol=0.02)
    far = (np.abs(even.triangles_center) > 0.2).all(axis=1)
    octants = (even.triangles_center > 0) @ [1, 2, 4]
    assert (even.face_attributes["octant"] == octants)[far].all()
    assert even.metadata["name"] == "ball"


def test_options_and_errors_are_those_of_remesh(ball):
    assert len(remesh(ball, ratio=0.5, quality="draft").vertices) == 321
    with pytest.raises(rtfmesh.InputError, match="`weld`"):
        remesh(ball, 100, weld=3)
    with pytest.raises(rtfmesh.InputError, match="`mesh` is a PointCloud"):
        remesh(trimesh.PointCloud([[0, 0, 0]]), 10)
