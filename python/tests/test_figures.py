"""Measures, features, pictures, devices."""

import json

import numpy as np
import pytest
from conftest import program

import rtfmesh


def test_measures_are_those_of_the_program(folder, torus):
    found = rtfmesh.measure(
        torus.vertices, torus.faces, against=torus, energy=True, features=True, feature_angle=30, accuracy=0.1
    )
    path = folder / "torus.ply"
    options = ["--energy", "--features", "--feature-angle", "30", "--accuracy", "0.1", "--json"]
    assert found == json.loads(program("measure", path, "--against", path, *options).stdout)
    assert found["distances"]["hausdorff"] < 1e-6 and found["topology"]["genus"] == 1


def test_a_mesh_is_measured_against_points(torus, tmp_path):
    points = torus.vertices[::2] * 1.01
    found = rtfmesh.measure(torus.vertices, torus.faces, against=points)
    assert found["points"]["points"] == len(points) and found["points"]["from_points"]["rms"] > 0.1
    assert found["points"]["spacing"] > found["points"]["from_points"]["rms"]
    empty = (points, np.zeros((0, 3), int))
    assert rtfmesh.measure(torus.vertices, torus.faces, against=empty) == found
    np.savetxt(tmp_path / "points.xyz", points, fmt="%.17g")
    rtfmesh.write(tmp_path / "torus.ply", torus.vertices, torus.faces)
    options = ("--against", tmp_path / "points.xyz", "--json")
    assert json.loads(program("measure", tmp_path / "torus.ply", *options).stdout) == found
    with pytest.raises(rtfmesh.InputError, match="`energy` needs a mesh as `against`"):
        rtfmesh.measure(torus.vertices, torus.faces, against=points, energy=True)
    with pytest.raises(rtfmesh.InputError, match="shape"):
        rtfmesh.measure(torus.vertices, torus.faces, against=points[:, :2])


def test_measuring_needs_something_to_measure(torus):
    with pytest.raises(rtfmesh.InputError, match="`faces` is empty"):
        rtfmesh.measure(np.zeros((3, 3)), np.zeros((0, 3), int))
    with pytest.raises(rtfmesh.InputError, match="`energy` needs `against`"):
        rtfmesh.measure(torus.vertices, torus.faces, energy=True)
    with pytest.raises(rtfmesh.InputError, match="`against` is 5, not a mesh"):
        rtfmesh.measure(torus.vertices, torus.faces, against=5)
    with pytest.raises(rtfmesh.InputError, match=r"`against.faces` has \[0, 1, 9\]"):
        rtfmesh.measure(torus.vertices, torus.faces, against=(np.eye(3), [[0, 1, 9]]))
    with pytest.raises(rtfmesh.InputError, match="accuracy"):
        rtfmesh.measure(torus.vertices, torus.faces, against=torus, accuracy=7)


def test_inspections_are_those_of_the_program(folder):
    box = rtfmesh.read(folder / "box.ply")
    found = rtfmesh.inspect(box.vertices, box.faces, 500, feature_angle=30)
    theirs = json.loads(
        program("inspect", folder / "box.ply", "-n", "500", "--feature-angle", "30", "--json").stdout
    )
    assert found == {key: value for key, value in theirs.items() if key not in ("notes", "attributes")}
    assert found["corners"] == 8
    smooth = rtfmesh.inspect(box.vertices, box.faces, feature_angle=180)
    lined = rtfmesh.inspect(box.vertices, box.faces, feature_angle=180, features=[box.faces[0, :2]])
    assert (smooth["curves"], len(lined["curves"])) == ([], 1)
    with pytest.raises(rtfmesh.InputError, match="`n` is 0"):
        rtfmesh.inspect(box.vertices, box.faces, 0)


def test_pictures_are_arrays_or_files(folder, torus, sphere, tmp_path):
    picture = rtfmesh.render(torus, size=(160, 120))
    assert picture.shape == (120, 160, 4) and picture.dtype == np.uint8
    assert (picture[..., 3] == 255).all() and (picture[0, 0] == 255).all() and picture.min() < 50
    pair = rtfmesh.render([torus, (sphere.vertices, sphere.faces)], size=(160, 120), color="quality")
    assert pair.shape == (120, 320, 4)
    assert rtfmesh.render(torus, tmp_path / "ours.png", size=(160, 120), zoom=2, z_up=True) is None
    line = [
        "render",
        folder / "torus.ply",
        tmp_path / "theirs.png",
        "--size",
        "160x120",
        "--zoom",
        "2",
        "--z-up",
    ]
    assert program(*line).returncode == 0
    assert (tmp_path / "ours.png").read_bytes() == (tmp_path / "theirs.png").read_bytes()
    image = pytest.importorskip("PIL.Image")
    rtfmesh.render(torus, tmp_path / "a.png", size=(160, 120))
    assert np.array_equal(np.asarray(image.open(tmp_path / "a.png").convert("RGBA")), picture)


def test_pictures_show_distances_and_curves(folder, torus):
    box = rtfmesh.read(folder / "box.ply")
    plain = rtfmesh.render(box, size=(160, 120), edges=False)
    assert not np.array_equal(plain, rtfmesh.render(box, size=(160, 120), edges=False, curves=True))
    off = rtfmesh.render(box, size=(160, 120), edges=False, color="distance", against=torus)
    assert not np.array_equal(plain, off)


@pytest.mark.parametrize(
    ("wrong", "says"),
    [
        ({"color": "red"}, "`color` 'red' is unknown; use plain, quality, distance"),
        ({"color": "distance"}, "`against`"),
        ({"path": "a.jpg"}, "a.jpg does not end in .png"),
        ({"elevation": 100}, "`elevation` 100"),
        ({"zoom": 0}, "`zoom` 0"),
        ({"size": (3, 3)}, "pixels"),
        ({"meshes": []}, "`meshes` is empty"),
        ({"meshes": 5}, "mesh"),
        ({"meshes": [(np.eye(3), [[0, 1, 5]])]}, "`meshes[0].faces`"),
    ],
)
def test_pictures_that_cannot_be_are_errors(torus, wrong, says):
    with pytest.raises(rtfmesh.InputError) as raised:
        rtfmesh.render(**{"meshes": torus, **wrong})
    assert says in str(raised.value)


def test_devices_are_those_of_the_program():
    assert rtfmesh.devices() == json.loads(program("devices", "--json").stdout)
