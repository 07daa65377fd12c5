"""Which arrays of the faces are labels whose borders are kept."""

import numpy as np
import pytest

import rtfmesh


@pytest.fixture
def halves(sphere):
    """A sphere's faces right and left, front and back, and numbered."""
    middle = sphere.vertices[sphere.faces].mean(axis=1)
    return {
        "right": (middle[:, 0] > 0).astype(np.int32),
        "front": (middle[:, 1] > 0),
        "ids": np.arange(len(sphere.faces)),
        "height": middle[:, 2],
        "face_rgb": np.where(middle[:, 2:] > 0, 255, np.uint8(0)).repeat(3, axis=1).astype(np.uint8),
    }


def is_kept(sphere, result, values):
    """Whether vertices of a result lie all along the border between equal values of the input."""
    edges = np.sort(sphere.faces[:, [[0, 1], [1, 2], [2, 0]]], axis=2).reshape(-1, 2)
    order = np.lexsort(edges.T)
    edges, owner = edges[order], (np.arange(len(edges)) // 3)[order]
    pairs = owner.reshape(-1, 2)
    flat = values.reshape(len(values), -1)
    is_border = (flat[pairs[:, 0]] != flat[pairs[:, 1]]).any(axis=1)
    # Edges of the result between the two sides must lie on such edges.
    ends = sphere.vertices[edges[::2][is_border]]
    found = result.vertices[:, None, :]
    a, d = ends[:, 0], ends[:, 1] - ends[:, 0]
    along = np.clip(((found - a) * d).sum(axis=2) / (d**2).sum(axis=1), 0, 1)
    distances = np.linalg.norm(found - (a + along[..., None] * d), axis=2).min(axis=1)
    # A closed border of this surface has some thirty vertices among 1,000.
    return bool((distances < 1e-5).sum() > 25)


@pytest.mark.parametrize(
    ("keep", "kept"),
    [
        ("right", {"right"}),
        (["right", "front"], {"right", "front"}),
        (("front",), {"front"}),
        ("face_rgb", {"face_rgb"}),
        (False, set()),
        (None, set()),
        ([], set()),
    ],
)
def test_the_labels_that_are_named_are_kept(sphere, remesher, halves, keep, kept):
    given = {"face": halves}
    wanted = {"keep_labels": keep, "smooth_labels": 0.0} if keep else {"keep_labels": keep}
    result = remesher.remesh(sphere.vertices, sphere.faces, 1000, attributes=given, **wanted)
    found = {name for name in ("right", "front", "face_rgb") if is_kept(sphere, result, halves[name])}
    assert found == kept
    for name, values in halves.items():
        carried = result.attributes.face[name]
        assert carried.dtype == values.dtype and carried.shape[1:] == values.shape[1:]
    assert set(map(tuple, result.attributes.face["face_rgb"])) == {(0, 0, 0), (255, 255, 255)}
    assert set(result.attributes.face["ids"]) <= set(halves["ids"])


def test_numbers_of_faces_are_no_labels_and_a_warning_says_what_is(sphere, remesher, halves):
    wanted = {"attributes": {"face": halves}, "keep_labels": True, "smooth_labels": 0.0}
    with pytest.warns(rtfmesh.MeshWarning) as told:
        result = remesher.remesh(sphere, 1000, **wanted)
    text = "`keep_labels` keeps the borders of 'right', 'front', and not of 'ids', whose values differ"
    assert [str(one.message) for one in told] == [
        f"{text} from face to face; name the arrays to choose others"
    ]
    assert result.report["warning_codes"] == ["labels"]
    assert is_kept(sphere, result, halves["right"]) and is_kept(sphere, result, halves["front"])
    # A single array of labels is what was meant.
    only = {"face": {"right": halves["right"], "height": halves["height"]}}
    result = remesher.remesh(sphere, 1000, attributes=only, keep_labels=True, smooth_labels=0.0)
    assert is_kept(sphere, result, halves["right"])


@pytest.mark.parametrize(
    ("wrong", "says"),
    [
        ("none", "`keep_labels` names 'none'; the faces have 'right'"),
        (5, "`keep_labels` is 5; give True, or the name of an array of the faces, or several"),
        ([3], "`keep_labels` is [3]; give True"),
    ],
)
def test_labels_that_there_are_not_are_told(sphere, halves, remesher, wrong, says):
    with pytest.raises(rtfmesh.InputError) as raised:
        remesher.remesh(sphere, 1000, attributes={"face": {"right": halves["right"]}}, keep_labels=wrong)
    assert says in str(raised.value)


def test_colours_of_faces_count_in_trimesh_where_asked(sphere, halves, remesher):
    trimesh = pytest.importorskip("trimesh")
    mesh = trimesh.Trimesh(sphere.vertices, sphere.faces, process=False)
    mesh.visual.face_colors = np.column_stack([halves["face_rgb"], np.full(len(sphere.faces), 255)])
    asked = rtfmesh.trimesh.remesh(
        mesh, 1000, keep_labels="face_colors", smooth_labels=0.0, remesher=remesher
    )
    assert is_kept(sphere, asked, halves["face_rgb"])
    assert set(map(tuple, asked.visual.face_colors)) == {(0, 0, 0, 255), (255, 255, 255, 255)}
    unasked = rtfmesh.trimesh.remesh(mesh, 1000, remesher=remesher)
    assert not is_kept(sphere, unasked, halves["face_rgb"])


def test_numbers_that_pyvista_adds_are_no_labels(remesher):
    pyvista = pytest.importorskip("pyvista")
    grid = pyvista.ImageData(dimensions=(12, 12, 12)).cast_to_unstructured_grid()
    grid.cell_data["side"] = (grid.cell_centers().points[:, 0] > 6).astype(int)
    surface = grid.extract_surface(algorithm="dataset_surface").triangulate()
    surface.cell_data["quads"] = np.arange(surface.n_cells) // 2
    assert "vtkOriginalCellIds" in surface.cell_data
    plain = surface.copy()
    del plain.cell_data["vtkOriginalCellIds"], plain.cell_data["quads"]
    expected = plain.rtfmesh.remesh(1000, keep_labels=True, remesher=remesher)
    with pytest.warns(rtfmesh.MeshWarning, match="'side', and not of .* whose values differ"):
        even = surface.rtfmesh.remesh(1000, keep_labels=True, remesher=remesher)
    assert np.array_equal(even.points, expected.points)
    named = surface.rtfmesh.remesh(1000, keep_labels="side", remesher=remesher)
    assert np.array_equal(named.points, expected.points)
