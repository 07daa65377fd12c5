"""What notebooks show, complete and hand over."""

import base64
import inspect
import io
import re

import numpy as np
import pytest
from conftest import program

import rtfmesh


def test_options_are_in_the_signatures():
    for function in (rtfmesh.remesh, rtfmesh.reconstruct, rtfmesh.contour, rtfmesh.Remesher.remesh):
        parameters = inspect.signature(function).parameters
        assert {"n", "distances", "feature_angle", "keep_labels", "seed", "fit"} < set(parameters)
        assert parameters["seed"].kind is inspect.Parameter.KEYWORD_ONLY
        assert not any(one.kind is one.VAR_KEYWORD for one in parameters.values())
    # Those of points are not those of the presets.
    assert inspect.signature(rtfmesh.reconstruct).parameters["normals"].annotation == "ArrayLike | None"


def test_meshes_and_results_show_a_picture_and_figures(torus, remesher):
    with pytest.warns(rtfmesh.MeshWarning):
        result = remesher.remesh(torus, 5000, quality="best", time_limit=0.001, distances=True)
    for shown, count in ((torus._repr_html_(), len(torus.vertices)), (result._repr_html_(), 5000)):
        data = re.search(r"data:image/png;base64,([^\"]+)", shown)[1]
        assert base64.b64decode(data).startswith(b"\x89PNG")
        assert f"<td>vertices</td><td>{count}</td>" in shown
    for text in ("mean quality", "smallest angle", "RMS distance", "warning 1", "ended the run early"):
        assert text in result._repr_html_()
    # What cannot be drawn has its figures, and nothing is taken for markup.
    nothing = rtfmesh.Mesh(np.zeros((0, 3)), np.zeros((0, 3), np.uint32), rtfmesh.Attributes())
    assert nothing._repr_html_().startswith("<table><tr><td>vertices</td><td>0</td>")


def test_models_are_those_of_the_program(tmp_path):
    mesh = rtfmesh.sample("genus3")
    assert program("sample", "genus3", tmp_path / "a.ply").returncode == 0
    theirs = rtfmesh.read(tmp_path / "a.ply")
    assert np.array_equal(mesh.vertices, theirs.vertices) and np.array_equal(mesh.faces, theirs.faces)
    with pytest.raises(rtfmesh.InputError, match=r"'none'.* torus"):
        rtfmesh.sample("none")
    with pytest.raises(rtfmesh.InputError, match="`name` is 5"):
        rtfmesh.sample(5)


def test_open_files_are_read_as_paths_are(torus, tmp_path):
    for name in ("a.ply", "a.obj", "a.stl", "a.ply.gz"):
        rtfmesh.write(tmp_path / name, torus)
        expected = rtfmesh.read(tmp_path / name)
        with open(tmp_path / name, "rb") as file:
            found = [
                rtfmesh.read(file),
                rtfmesh.read(io.BytesIO((tmp_path / name).read_bytes()), format=name[2:]),
            ]
        for mesh in found:
            assert np.array_equal(mesh.vertices, expected.vertices)
            assert np.array_equal(mesh.faces, expected.faces)
    with open(tmp_path / "a.obj") as file:
        assert len(rtfmesh.read(file).faces) == len(torus.faces)
    with pytest.raises(rtfmesh.InputError, match=r"^bad\.obj: line 2") as raised:
        (tmp_path / "bad.obj").write_text("v 0 0 0\nv a b c\n")
        with open(tmp_path / "bad.obj", "rb") as file:
            rtfmesh.read(file)
    assert "/tmp" not in str(raised.value)
