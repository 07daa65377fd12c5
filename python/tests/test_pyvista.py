"""The accessor on surfaces of PyVista. Nothing is drawn, so that no display is needed."""

import inspect

import numpy as np
import pytest

import rtfmesh

pv = pytest.importorskip("pyvista")


@pytest.fixture
def ball():
    """A sphere with arrays of many kinds."""
    ball = pv.Sphere(theta_resolution=40, phi_resolution=40)
    ball.clear_data()
    x, y, z = ball.points.T
    ball.point_data["height"] = z
    ball.point_data["rgb"] = np.column_stack([255 * (x > 0), 255 * (y > 0), np.full(len(x), 7)]).astype(
        np.uint8
    )
    ball.point_data["tensor"] = np.tile(ball.points, (1, 3)).astype(np.float64)
    ball.point_data["number"] = np.arange(len(x), dtype=np.int64) + 2**40
    ball.point_data["upper"] = z > 0
    ball.cell_data["side"] = (ball.cell_centers().points[:, 0] > 0).astype(np.int16)
    ball.cell_data["middle"] = ball.cell_centers().points
    ball.field_data["name"] = ["ball"]
    ball.set_active_scalars("rgb")
    return ball


def test_the_accessor_needs_no_import_of_rtfmesh():
    assert pv.PolyData.rtfmesh.__name__ == "Accessor"


def test_arrays_of_points_and_cells_come_along(ball):
    before = ball.copy()
    even = ball.rtfmesh.remesh(500)
    assert type(even) is pv.PolyData and even.n_points == 500 and even.n_cells == 996
    assert even.is_all_triangles and even.is_manifold
    assert set(even.point_data) == set(ball.point_data) and set(even.cell_data) == set(ball.cell_data)
    for data, source in ((even.point_data, ball.point_data), (even.cell_data, ball.cell_data)):
        assert all(data[name].dtype == source[name].dtype for name in source)
        assert all(data[name].shape[1:] == source[name].shape[1:] for name in source)
    assert np.allclose(even["height"], even.points[:, 2], atol=0.01)
    assert np.allclose(even["tensor"].reshape(-1, 3, 3), even.points[:, None], atol=0.01)
    far = np.abs(even.points) > 0.1
    assert ((even["rgb"][:, 0] == 255) == (even.points[:, 0] > 0))[far[:, 0]].all()
    assert (even["rgb"][:, 2] == 7).all()
    assert set(even["number"]) <= set(ball["number"])
    assert (even["upper"] == (even.points[:, 2] > 0))[far[:, 2]].all()
    middle = even.cell_centers().points
    assert ((even["side"] == 1) == (middle[:, 0] > 0))[np.abs(middle[:, 0]) > 0.1].all()
    assert np.abs(even["middle"] - middle).max() < 0.1
    assert list(even.field_data["name"]) == ["ball"]
    assert even.active_scalars_name == "rgb"
    # The source is as it was.
    assert ball == before and ball is not even and not np.shares_memory(ball.points, even.points)


def test_options_are_the_command_lines(ball):
    ball.point_data["size"] = np.where(ball.points[:, 2] > 0, 1.0, 3.0)
    adapted = ball.rtfmesh.remesh(400, sizing="property:size", quality="draft")
    assert (adapted.points[:, 2] > 0).mean() > 0.7
    ratio = ball.rtfmesh.remesh(ratio=0.5)
    assert ratio.n_points == ball.n_points / 2


def test_polygons_and_strips_are_triangulated():
    plane = pv.Plane(i_resolution=12, j_resolution=12)
    plane.clear_data()
    plane.cell_data["row"] = np.repeat(np.arange(12), 12)
    assert not plane.is_all_triangles
    even = plane.rtfmesh.remesh(200)
    assert even.n_points == 200 and even.is_all_triangles and not plane.is_all_triangles
    rows = (12 * (even.cell_centers().points[:, 1] + 0.5)).astype(int)
    assert np.abs(even["row"] - rows).max() <= 1 and len(np.unique(even["row"])) == 12
    strips = pv.Sphere().strip()
    assert strips.n_strips and strips.rtfmesh.remesh(300).n_points == 300


def test_cells_that_are_no_faces_are_left_out():
    mixed = pv.Cube().triangulate().clean()
    mixed.clear_data()
    faces = mixed.faces
    mixed = pv.PolyData(mixed.points, faces=faces, lines=[2, 0, 1], verts=[1, 0, 1, 1])
    mixed.cell_data["kind"] = [0, 0, 1, *range(10, 22)]
    even = mixed.rtfmesh.remesh(200)
    assert even.n_points == 200 and set(even["kind"]) == set(range(10, 22))


def test_texture_seams_stay_if_they_are_to():
    u = np.linspace(0, 1, 41)
    grid = np.stack(np.meshgrid(u, u, indexing="ij"), axis=-1).reshape(-1, 2)
    angle = 2 * np.pi * grid[:, 0]
    tube = np.column_stack([np.cos(angle), np.sin(angle), 3 * grid[:, 1]])
    corner = np.arange(41 * 41).reshape(41, 41)
    a, b, c, d = (
        part.ravel() for part in (corner[:-1, :-1], corner[1:, :-1], corner[1:, 1:], corner[:-1, 1:])
    )
    faces = np.concatenate([np.column_stack([a, b, c]), np.column_stack([a, c, d])])
    tube = pv.PolyData.from_regular_faces(tube, faces)
    tube.active_texture_coordinates = grid
    kept = tube.rtfmesh.remesh(500, keep_uv=True)
    uv = kept.active_texture_coordinates
    assert kept.n_points > 500 and uv.shape == (kept.n_points, 2)
    place = np.column_stack([np.cos(2 * np.pi * uv[:, 0]), np.sin(2 * np.pi * uv[:, 0]), 3 * uv[:, 1]])
    assert np.abs(place - kept.points).max() < 0.05
    across = np.ptp(uv[kept.regular_faces][:, :, 0], axis=1)
    assert across.max() < 0.5, "a face crosses the seam"
    with pytest.warns(rtfmesh.MeshWarning, match="keep_uv=True"):
        assert tube.rtfmesh.remesh(500).n_points == 500


def test_surfaces_that_cannot_be_are_refused(ball):
    with pytest.raises(rtfmesh.InputError):
        pv.PolyData().rtfmesh.remesh(100)
    with pytest.raises(rtfmesh.InputError):
        pv.PolyData(np.eye(3)).rtfmesh.remesh(100)
    ball.points[5] = np.nan
    with pytest.raises(rtfmesh.InputError, match="row 5"):
        ball.rtfmesh.remesh(100)


def test_numbers_that_are_none_stay_where_they_are(ball):
    ball.point_data["gaps"] = np.where(ball.points[:, 0] > 0, np.nan, 1.0)
    even = ball.rtfmesh.remesh(500)
    far = np.abs(even.points[:, 0]) > 0.1
    assert (np.isnan(even["gaps"]) == (even.points[:, 0] > 0))[far].all()


def test_one_remesher_serves_many_surfaces(ball, remesher):
    for count in (100, 200):
        assert ball.rtfmesh.remesh(count, remesher=remesher).n_points == count


def test_surfaces_are_measured_and_inspected(ball):
    even = ball.rtfmesh.remesh(500)
    measures = even.rtfmesh.measure(ball)
    assert measures["vertices"] == 500 and 0 < measures["distances"]["hausdorff"] < 2
    for points in (pv.PointSet(ball.points), pv.PolyData(ball.points)):
        assert 0 < even.rtfmesh.measure(points)["points"]["from_points"]["rms"] < 2
    assert pv.Cube().rtfmesh.inspect(feature_angle=30)["corners"] == 8


def test_points_become_a_surface():
    at = pv.Sphere(theta_resolution=60, phi_resolution=60).points
    for points in (pv.PointSet(at), pv.PolyData(at)):
        points.point_data["height"] = at[:, 2]
        points.field_data["name"] = ["ball"]
        before = points.copy()
        even = points.rtfmesh.reconstruct(400, closed=True)
        assert type(even) is pv.PolyData and even.n_points == 400 and even.is_manifold
        assert np.allclose(np.linalg.norm(even.points, axis=1), 0.5, atol=0.01)
        assert np.allclose(even["height"], even.points[:, 2], atol=0.06)
        assert even.active_scalars_name == "height" and list(even.field_data["name"]) == ["ball"]
        assert points == before
        assert even.volume > 0.4
        # Normals say which side is outside, and are not carried.
        points.point_data.active_normals = -at / np.linalg.norm(at, axis=1, keepdims=True)
        inward = points.rtfmesh.reconstruct(400)
        a, b, c = (inward.points[inward.regular_faces[:, k]] for k in range(3))
        assert np.einsum("ij,ij->i", a, np.cross(b, c)).sum() / 6 < -0.4
        assert list(inward.point_data) == ["height"]


def test_surfaces_are_no_points(ball):
    with pytest.raises(rtfmesh.InputError, match="works only with points"):
        ball.rtfmesh.reconstruct(100)


def test_what_is_no_surface_yet_says_how_to_make_one():
    image = pv.ImageData(dimensions=(3, 3, 3)).rtfmesh
    points = pv.PointSet(np.zeros((4, 3))).rtfmesh
    for method in ("remesh", "measure", "inspect"):
        with pytest.raises(AttributeError, match=rf"'{method}'; call `\.rtfmesh\.contour\(n, iso=\.\.\.\)` "):
            getattr(image, method)
        with pytest.raises(AttributeError, match=rf"'{method}'; call `\.rtfmesh\.reconstruct\(n\)` first"):
            getattr(points, method)
        assert not hasattr(image, method)
    with pytest.raises(AttributeError, match=r"no attribute 'nothing'$"):
        image.nothing  # noqa: B018


def test_accessors_show_the_keywords_that_they_pass_on():
    surface, points = pv.Sphere().rtfmesh, pv.PointSet(np.zeros((4, 3))).rtfmesh
    for method, own, others in (
        (surface.measure, ["against"], ["accuracy", "features"]),
        (surface.inspect, ["n"], ["feature_angle"]),
        (surface.reconstruct, ["n"], ["closed", "remesher", "max_deviation"]),
        (points.reconstruct, ["n"], ["closed", "remesher", "max_deviation"]),
    ):
        names = list(inspect.signature(method).parameters)
        assert names[: len(own)] == own and set(others) <= set(names), names
        assert not {"vertices", "faces", "points", "wanted"} & set(names), names
