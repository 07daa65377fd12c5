"""Options that have no effect: a warning says so."""

import numpy as np
import pytest

import rtfmesh

BOX = rtfmesh.sample("box")
LABELS = np.zeros((9, 9, 9), np.uint8)
LABELS[2:7, 2:7, 2:7] = 1


def warning_of(call):
    """The one warning of a call, which the report has as well."""
    with pytest.warns(rtfmesh.MeshWarning) as told:
        result = call()
    report = result.report if isinstance(result, rtfmesh.Result) else result.metadata["rtfmesh"]
    assert [str(one.message) for one in told] == report["warnings"]
    assert report["warning_codes"] == ["no-effect"] and told[0].filename == __file__
    return report["warnings"][0]


@pytest.mark.parametrize(
    ("wanted", "says"),
    [
        (
            {"keep_uv": True},
            "`keep_uv` has no effect: the input has no texture coordinates; remove `keep_uv`",
        ),
        ({"keep_labels": True}, "`keep_labels` has no effect: the input has no labels; remove `keep_labels`"),
        (
            {"keep_labels": True, "attributes": {"face": {"all": np.ones(len(BOX.faces), int)}}},
            "`keep_labels` has no effect: all neighbouring triangles have the same labels; remove",
        ),
    ],
)
def test_nothing_to_keep_is_told(remesher, wanted, says):
    assert warning_of(lambda: remesher.remesh(BOX, 200, **wanted)).startswith(says)
    assert warning_of(lambda: rtfmesh.remesh(BOX, 200, **wanted)).startswith(says)


@pytest.mark.parametrize("option", ["keep_uv", "keep_labels"])
def test_points_and_values_have_nothing_to_keep(remesher, option):
    wanted, says = {option: True}, f"`{option}` has no effect: "
    points = rtfmesh.sample("sphere").vertices
    assert warning_of(lambda: remesher.reconstruct(points, 200, **wanted)).startswith(says)
    assert warning_of(lambda: remesher.contour(LABELS, 200, iso=0.5, **wanted)).startswith(says)


def test_meshes_of_trimesh_are_told_as_well(remesher):
    trimesh = pytest.importorskip("trimesh")
    mesh = trimesh.Trimesh(BOX.vertices, BOX.faces, process=False)
    found = warning_of(lambda: rtfmesh.trimesh.remesh(mesh, 200, keep_uv=True, remesher=remesher))
    assert found.startswith("`keep_uv` has no effect")


def test_labels_that_are_kept_are_no_warning(remesher):
    sides = {"face": {"half": np.arange(len(BOX.faces)) < 6, "other": np.zeros(len(BOX.faces), int)}}
    result = remesher.remesh(BOX, 200, attributes=sides, keep_labels="half")
    assert result.report["warnings"] == [] and not any("keep_labels" in n for n in result.report["notes"])
    two = np.zeros((16, 16, 16), np.uint8)
    two[2:8, 2:14, 2:14], two[8:14, 2:14, 2:14] = 1, 2
    result = remesher.contour(two, 500, labels=True, keep_labels=True)
    assert "no-effect" not in result.report["warning_codes"]
