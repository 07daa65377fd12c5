"""Several values on a grid: surfaces of all of them in one mesh, and further arrays at its vertices."""

import numpy as np
import pytest
from test_contour import CENTRE, distances, halves

import rtfmesh

FRAME = np.array([[0, -2.0, 0, 5], [0.5, 0, 0, -3], [0, 0, 1, 100], [0, 0, 0, 1]])


def linear(points):
    """A function that trilinear interpolation gives exactly."""
    return points @ [1.0, -2.0, 0.5] + 3.0


def places(size=(23, 25, 22)):
    """The places of nodes, shape (X, Y, Z, 3)."""
    return np.moveaxis(np.indices(size), 0, -1) @ FRAME[:3, :3].T + FRAME[:3, 3]


def test_surfaces_at_several_values_are_told_apart(remesher):
    result = remesher.contour(distances(), 900, iso=[-3, 0.5])
    assert len(result.vertices) == 900
    iso = result.attributes.face["iso"]
    assert iso.dtype == np.float64 and set(iso) == {-3.0, 0.5}
    radii = np.linalg.norm(result.vertices - CENTRE, axis=1)
    for value in (-3, 0.5):
        assert np.abs(radii[result.faces[iso == value]] - 7.5 - value).max() < 0.1
    assert "iso" not in remesher.contour(distances(), 300, iso=np.float32(0)).attributes.face


@pytest.mark.parametrize(
    ("iso", "said"),
    [
        ([], "`iso` is empty; give a number or several"),
        ([[0, 1]], "`iso` has shape"),
        ([0, "x"], "`iso` has values of type"),
        (True, "`iso` is True; give a number"),
        (1j, "`iso` is of type complex; give a number"),
        (10**400, "`iso` is too large"),
        ([0, "x", None], "`iso` has values of type"),
        ([0, 1, 0], "give each value once"),
        ([0, 500], "no surface at 500"),
        ([0, float("nan")], "not finite"),
    ],
)
def test_values_that_cannot_be_used_are_named(iso, said, remesher):
    with pytest.raises(rtfmesh.InputError, match=said):
        remesher.contour(distances(), 100, iso=iso)


def test_further_arrays_come_along(remesher):
    at = places()
    given = {
        "height": linear(at).astype(np.float32),
        "direction": at,
        "organ": halves(),
        "inside": distances() < 0,
        "rgb": np.repeat(np.indices((23, 25, 22))[0][..., None], 3, axis=-1).astype(np.uint8),
    }
    result = remesher.contour(distances(), 400, iso=0, affine=FRAME, attributes={"vertex": given})
    found = result.attributes.vertex
    assert list(found) == list(given)
    assert all(found[name].dtype == given[name].dtype for name in given)
    assert np.allclose(found["height"], linear(result.vertices), atol=1e-4)
    assert np.allclose(found["direction"], result.vertices)
    index = (result.vertices - FRAME[:3, 3]) @ np.linalg.inv(FRAME[:3, :3]).T
    nearest = tuple(np.rint(index).astype(int).T)
    assert np.array_equal(found["organ"], halves()[nearest])
    assert np.array_equal(found["inside"], distances()[nearest] < 0)
    assert np.abs(found["rgb"] - index[:, :1]).max() <= 0.5 + 1e-9


def test_names_of_labels_come_along(remesher):
    given = {"vertex": {"organ": halves()}, "label_names": {"organ": ["air", "lung", "liver"]}}
    found = remesher.contour(distances(), 300, iso=0, attributes=given).attributes
    assert found.label_names == given["label_names"]


def test_infinite_values_of_further_arrays_count_where_they_are(remesher):
    values = np.where(np.indices((23, 25, 22))[0] < 11, np.inf, 4.0)
    found = remesher.contour(distances(), 400, iso=0, attributes={"vertex": {"dose": values}})
    dose, x = found.attributes.vertex["dose"], found.vertices[:, 0]
    assert np.isinf(dose[x < 11]).all() and np.allclose(dose[x > 11], 4)


def test_holes_in_further_arrays_stay_holes(remesher):
    values = np.where(np.indices((23, 25, 22))[0] < 11, np.nan, 4.0)
    found = remesher.contour(distances(), 400, iso=0, attributes={"vertex": {"dose": values}})
    dose, x = found.attributes.vertex["dose"], found.vertices[:, 0]
    assert np.isnan(dose[x < 11]).all() and np.allclose(dose[x > 11], 4)


@pytest.mark.parametrize(
    ("attributes", "said"),
    [
        ({"vertex": {"dose": np.zeros((3, 3, 3))}}, r"'dose'\]` has shape \(3, 3, 3\), but `values` has"),
        ({"vertex": {"dose": np.zeros(23 * 25 * 22)}}, r"give array.reshape\(\(X, Y, Z\), order='F'\)"),
        ({"vertex": {"dose": np.full((23, 25, 22), None)}}, r"'dose'\]` has values of type object"),
        ({"uv": np.zeros((5, 3, 2))}, "`attributes.uv` needs faces"),
        ({"materials": object()}, "`attributes.materials` is of type object"),
        ({"face": {"dose": np.zeros(5)}}, "`attributes.face` needs faces"),
        ({"dose": np.zeros(5)}, "its keys are"),
    ],
)
def test_arrays_that_do_not_fit_are_named(attributes, said, remesher):
    with pytest.raises(rtfmesh.InputError, match=said):
        remesher.contour(distances(), 100, iso=0, attributes=attributes)


def test_arrays_of_images_come_along(remesher):
    pyvista = pytest.importorskip("pyvista")
    image = pyvista.ImageData(dimensions=(23, 25, 22), spacing=(0.5, 2.0, 1.0), origin=(5, 6, 7))
    image.point_data["distance"] = distances().ravel(order="F")
    image.point_data["height"] = linear(image.points)
    image.point_data["place"] = np.asarray(image.points, np.float64)
    image.cell_data["middle"] = linear(image.cell_centers().points)
    image.cell_data["row"] = np.arange(image.n_cells)
    made = image.rtfmesh.contour(400, iso=0, scalars="distance", remesher=remesher)
    assert set(made.point_data.keys()) == {"height", "place", "middle", "row"}
    points = np.asarray(made.points, np.float64)
    for name in ("height", "middle"):
        assert np.allclose(made.point_data[name], linear(points), atol=1e-4)
    assert np.allclose(made.point_data["place"], points, atol=1e-4)
    centres = image.cell_centers().points[made.point_data["row"]]
    assert (np.abs(centres - points) <= np.array([0.25, 1.0, 0.5]) + 1e-4).all()
    bare = image.rtfmesh.contour(400, iso=0, scalars="distance", attributes=False, remesher=remesher)
    assert not bare.point_data.keys() and np.array_equal(bare.points, made.points)
    several = image.rtfmesh.contour(400, iso=[-1, 1], scalars="distance", remesher=remesher)
    assert set(several.cell_data["iso"]) == {-1.0, 1.0} and "height" in several.point_data


def test_arrays_of_points_come_before_those_of_cells(remesher):
    pyvista = pytest.importorskip("pyvista")
    image = pyvista.ImageData(dimensions=(23, 25, 22))
    image.point_data["distance"] = distances().ravel(order="F")
    image.point_data["dose"] = np.full(image.n_points, 1.0)
    image.cell_data["dose"] = np.full(image.n_cells, 2.0)
    with pytest.warns(rtfmesh.MeshWarning, match="points and cells have arrays named dose"):
        made = image.rtfmesh.contour(300, iso=0, scalars="distance", remesher=remesher)
    assert np.allclose(made.point_data["dose"], 1)
    wrong = {"vertex": {"dose": np.zeros(5)}}
    with pytest.raises(rtfmesh.InputError, match=r"but the grid has \(23, 25, 22\)"):
        image.rtfmesh.contour(300, iso=0, scalars="distance", attributes=wrong, remesher=remesher)
