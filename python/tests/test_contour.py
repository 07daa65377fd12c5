"""Surfaces of values on a grid."""

import numpy as np
import pytest
from conftest import program, same

import rtfmesh

CENTRE = np.array([11.2, 12.1, 10.7])


def distances(radius=7.5, size=(23, 25, 22)):
    """Signed distances from a ball."""
    return np.linalg.norm(np.moveaxis(np.indices(size), 0, -1) - CENTRE, axis=-1) - radius


def halves():
    """A ball of two labels, with a wall at x = 11.5."""
    x = np.indices((23, 25, 22))[0]
    return np.where(distances() < 0, np.where(x < 11.5, 1, 2), 0)


def enclosed(result, sign=1):
    """The volume within, for faces that look outward."""
    a, b, c = (result.vertices[result.faces[:, k]] for k in range(3))
    return (sign * np.einsum("ij,ij->i", a, np.cross(b, c))).sum() / 6


def test_the_surface_at_a_value_has_exactly_n_vertices_and_lies_there(remesher):
    values = distances()
    before = values.copy()
    result = rtfmesh.contour(values, 600, iso=0.0)
    assert result.vertices.shape == (600, 3) and result.faces.shape == (1196, 3)
    radii = np.linalg.norm(result.vertices - CENTRE, axis=1)
    assert np.abs(radii - 7.5).max() < 0.05
    assert enclosed(result) == pytest.approx(4 / 3 * np.pi * 7.5**3, rel=0.02)
    assert result.correspondence is None and result.face_correspondence is None
    assert "23 x 25 x 22 values" in result.report["notes"][0]
    assert np.array_equal(values, before)
    for strided in (np.asfortranarray(values), values[::-1][::-1], values.astype(np.float32)):
        assert same(remesher.contour(strided, 600, iso=0.0), result)
    # The other side, and the same from the negated values.
    outer = remesher.contour(values, 600, iso=0.0, inside="above")
    assert enclosed(outer) == pytest.approx(-enclosed(result), rel=0.01)
    assert enclosed(remesher.contour(-values, 600, iso=0.0, inside="above")) > 0


def test_the_program_makes_the_same_of_a_file(tmp_path, remesher):
    np.save(tmp_path / "v.npy", distances().astype(np.float32))
    done = program("remesh", tmp_path / "v.npy", tmp_path / "v.ply", "-n", 500, "--iso=0", "--quiet")
    assert done.returncode == 0, done.stderr
    file = rtfmesh.read(tmp_path / "v.ply")
    own = remesher.contour(distances(), 500, iso=0)
    assert np.array_equal(file.vertices, own.vertices) and np.array_equal(file.faces, own.faces)


def test_spacing_and_affine_say_where_values_are(remesher):
    lengths = np.array([0.5, 2.0, 1.0])
    far = remesher.contour(distances(), 400, iso=0, spacing=lengths)
    radii = np.linalg.norm(far.vertices / lengths - CENTRE, axis=1)
    assert np.abs(radii - 7.5).max() < 0.2
    # A mirror keeps faces outward.
    affine = np.array([[0, -1.0, 0, 5], [1, 0, 0, -3], [0, 0, -1, 100], [0, 0, 0, 1]])
    turned = remesher.contour(distances(), 400, iso=0, affine=affine @ np.diag([1, 1, -1, 1.0]))
    mirrored = remesher.contour(distances(), 400, iso=0, affine=affine)
    centre = affine[:3, :3] @ CENTRE + affine[:3, 3]
    assert np.abs(np.linalg.norm(mirrored.vertices - centre, axis=1) - 7.5).max() < 0.1
    assert enclosed(mirrored) > 1000 and enclosed(turned) > 1000


def test_specks_are_left_out_unless_they_are_kept(remesher):
    values = distances()
    values[1:3, 1:3, 1:3] = -1
    plain = rtfmesh.contour(values, 600, iso=0.0)
    assert np.abs(np.linalg.norm(plain.vertices - CENTRE, axis=1) - 7.5).max() < 0.05
    assert any("1 speck" in note for note in plain.report["notes"])
    kept = remesher.contour(values, 600, iso=0.0, keep_specks=True)
    assert (np.linalg.norm(kept.vertices - [1.5, 1.5, 1.5], axis=1) < 2).any()


def test_the_origin_is_the_place_of_the_first_value(remesher):
    near = remesher.contour(distances(), 400, iso=0, spacing=(1, 1, 2))
    far = remesher.contour(distances(), 400, iso=0, spacing=(1, 1, 2), origin=(8, -4, 16))
    assert np.allclose(far.vertices, near.vertices + np.array([8, -4, 16]))


def test_some_labels_are_as_if_all_others_were_outside(remesher):
    result = remesher.contour(halves(), 500, labels=[2])
    assert same(result, remesher.contour(np.where(halves() == 2, 2, 0), 500, labels=True))
    assert same(result, remesher.contour(halves(), 500, labels=2))
    assert set(result.attributes.face["label_behind"]) == {2}


def test_labels_meet_and_faces_have_both(remesher):
    result = remesher.contour(halves(), 800, labels=True)
    assert len(result.vertices) == 800
    behind, before = (result.attributes.face[f"label_{side}"] for side in ("behind", "before"))
    assert behind.dtype == np.uint32 and len(behind) == len(result.faces)
    assert {(1, 0), (2, 0), (2, 1)} == set(zip(behind.tolist(), before.tolist(), strict=True))
    for label in (1, 2):
        sign = (behind == label).astype(int) - (before == label)
        assert enclosed(result, sign) == pytest.approx((halves() == label).sum(), rel=0.05)
    # Truth values are labels, too.
    mask = remesher.contour(halves() > 0, 400, labels=True)
    assert len(mask.vertices) == 400 and set(mask.attributes.face["label_behind"]) == {1}


def test_boxes_of_labels_have_their_faces_and_volumes(remesher):
    labels = np.zeros((20, 18, 16), np.uint8)
    labels[4:9, 4:14, 4:12] = 1
    labels[9:16, 4:14, 4:12] = 2
    result = remesher.contour(labels, 1500, labels=True)
    # Faces lie halfway between nodes, and have no rim.
    assert np.allclose(result.vertices.min(axis=0), [3.5, 3.5, 3.5], atol=1e-6)
    assert np.allclose(result.vertices.max(axis=0), [15.5, 13.5, 11.5], atol=1e-6)
    behind, before = (result.attributes.face[f"label_{side}"] for side in ("behind", "before"))
    for label in (1, 2):
        sign = (behind == label).astype(int) - (before == label)
        assert enclosed(result, sign) == pytest.approx((labels == label).sum(), rel=1e-3)
    top = result.vertices[result.vertices[:, 2] > 11]
    inside = (np.abs(top[:, 0] - 9.5) < 4.5) & (np.abs(top[:, 1] - 8.5) < 4.5)
    assert inside.sum() > 50 and np.abs(top[inside, 2] - 11.5).max() < 1e-6


def test_closed_ends_flat_at_the_border(remesher):
    half = distances()[:12]
    for closed, edges in ((True, 0), (False, 1)):
        result = remesher.contour(half, 500, iso=0.0, inside="below", closed=closed)
        pairs = np.sort(result.faces[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
        alone = (np.unique(pairs, axis=0, return_counts=True)[1] == 1).sum()
        assert min(alone, 1) == edges


@pytest.mark.parametrize(
    ("values", "wanted", "said"),
    [
        (np.zeros((3, 3)), {"iso": 0}, "shape"),
        (np.zeros((3, 1, 3)), {"iso": 0}, "at least two"),
        (np.array([["a"]]), {"iso": 0}, "real numbers"),
        (np.zeros((3, 3, 3)), {"iso": 0}, "no surface at 0"),
        (np.full((3, 3, 3), np.nan), {"iso": 0}, "no value is finite"),
        (distances(), {}, "either `iso`"),
        (distances(), {"iso": 0, "labels": True}, "either `iso`"),
        (distances(), {"iso": "x"}, "`iso` is 'x'"),
        (distances(), {"iso": float("nan")}, "not finite"),
        (distances(), {"iso": 0, "inside": "left"}, "left"),
        (halves(), {"labels": halves()}, "give True, or labels above 0 such as"),
        (halves(), {"labels": [1, 5]}, "`labels` has 5, which is none of the values"),
        (halves(), {"labels": 0}, "`labels` is 0; give True"),
        (distances(), {"iso": 0, "origin": [0, 1]}, "`origin`"),
        (distances(), {"iso": 0, "origin": [0, 0, 1], "affine": np.eye(4)}, "remove `origin`"),
        (distances(), {"labels": True, "inside": "above"}, "only with `iso`"),
        (distances(), {"labels": True}, "which is not a label"),
        (np.full((3, 3, 3), (1 << 24) + 1), {"labels": True}, "16777215"),
        (distances(), {"iso": 0, "spacing": (1, 0, 1)}, "above 0"),
        (distances(), {"iso": 0, "affine": np.zeros((4, 4))}, "invertible"),
        (distances(), {"iso": 0, "affine": np.eye(4), "spacing": (1, 1, 1)}, "remove `spacing`"),
        (distances(), {"iso": 0, "sizing": np.ones(4)}, "`sizing`"),
        (distances(), {"iso": 0, "features": [[0, 1]]}, "`features`"),
    ],
)
def test_what_cannot_be_used_is_named(values, wanted, said, remesher):
    with pytest.raises(rtfmesh.InputError, match=said):
        remesher.contour(values, 100, **wanted)


def test_an_unknown_option_is_named(remesher):
    with pytest.raises(TypeError, match=r"contour\(\) got an unexpected keyword argument 'levels'"):
        remesher.contour(distances(), 100, iso=0, levels=3)


def test_images_of_pyvista(remesher):
    pyvista = pytest.importorskip("pyvista")
    image = pyvista.ImageData(dimensions=(23, 25, 22), spacing=(0.5, 2.0, 1.0), origin=(5, 6, 7))
    image.point_data["distance"] = distances().ravel(order="F")
    image.field_data["of"] = ["a ball"]
    made = image.rtfmesh.contour(500, iso=0, remesher=remesher)
    own = remesher.contour(distances(), 500, iso=0, spacing=(0.5, 2.0, 1.0))
    assert made.n_points == 500 and made.n_cells == len(own.faces)
    assert np.allclose(made.points, own.vertices + np.array([5, 6, 7]), atol=1e-4)
    assert made.field_data["of"][0] == "a ball"
    # Labels of cells lie at their centres.
    cells = pyvista.ImageData(dimensions=(24, 26, 23))
    cells.cell_data["label"] = halves().ravel(order="F")
    made = cells.rtfmesh.contour(600, labels=True, scalars="label", remesher=remesher)
    assert np.allclose(np.mean(made.bounds[:2]), CENTRE[0] + 0.5, atol=0.1)
    assert set(made.cell_data["label_behind"]) == {1, 2}
    # What is active is taken, though points have an array of the same name.
    cells.point_data["label"] = np.zeros(cells.n_points)
    cells.set_active_scalars("label", preference="cell")
    assert np.array_equal(cells.rtfmesh.contour(600, labels=True, remesher=remesher).points, made.points)
    for wanted in ({"scalars": "none", "iso": 0}, {"scalars": "distance"}):
        with pytest.raises(rtfmesh.InputError):
            image.rtfmesh.contour(100, remesher=remesher, **wanted)
