"""What is wrong is an exception that names the argument, never anything else."""

import os
import subprocess
import sys

import numpy as np
import pytest

import rtfmesh

GOOD = {"vertices": np.zeros((3, 3)), "faces": [[0, 1, 2]], "n": 100}
NAN = np.array([[0, 0, 0], [1, 0, 0], [0, np.nan, 0]])


@pytest.mark.parametrize(
    ("wrong", "says"),
    [
        ({"vertices": np.zeros((3, 2))}, "`vertices` has shape (3, 2); give one of shape (N, 3)"),
        ({"vertices": np.zeros(9)}, "`vertices` has shape (9,)"),
        ({"vertices": []}, "`vertices` has shape (0,)"),
        ({"vertices": [["a"] * 3]}, "`vertices` has values of type <U1; give real numbers"),
        ({"vertices": np.zeros((3, 3), complex)}, "`vertices` has values of type complex128"),
        ({"vertices": [[0, 0, 0], [0, 0]]}, "`vertices` has rows of different lengths"),
        ({"vertices": None}, "`vertices` has values of type object"),
        ({"vertices": NAN}, "`vertices` has a value in row 2"),
        ({"vertices": np.full((3, 3), np.inf)}, "finite"),
        ({"faces": [[0, 1]]}, "`faces` has shape (1, 2)"),
        ({"faces": [[0.0, 1.0, 2.0]]}, "`faces` has values of type float64; give integers"),
        ({"faces": [[0, 1, 2], [0, 1, 3]]}, "`faces` has [0, 1, 3] in row 1; give indices of the 3 vertices"),
        ({"faces": [[0, -1, 2]]}, "`faces` has [0, -1, 2] in row 0"),
        ({"faces": np.zeros((0, 3), int)}, "face"),
        ({"vertices": np.zeros((0, 3)), "faces": np.zeros((0, 3), int)}, "`vertices` is empty"),
        ({}, "`faces`: no face has an area"),
        ({"n": 3}, "`n`"),
        ({"n": -5}, "`n`"),
        ({"n": 10.5}, "`n`"),
        ({"n": "many"}, "`n`"),
        ({"n": True}, "`n` is True; use a number or a word"),
        ({"n": [5]}, "`n` is of type list"),
        ({"n": 10**30}, "`n`"),
        ({"ratio": 0.5}, "`n` and `ratio` do not go together"),
        ({"n": None, "ratio": -1}, "ratio"),
        ({"n": None, "edge_length": "wide"}, "`edge_length`"),
        ({"weld": 2}, "`weld` 2 is out of range"),
        ({"weld": "x"}, "`weld`"),
        ({"weld": True}, "`weld` is True; use a number or a word"),
        ({"weld": [1]}, "`weld` is of type list"),
        ({"fit": 1}, "`fit` is 1; use True or False"),
        ({"quality": "bset"}, "`quality`"),
        ({"feature_angle": float("nan")}, "`feature_angle`"),
        ({"gradation": 2}, "`gradation` needs `sizing` curvature"),
        ({"research": {"k_clip": 99, "preset": "rtf"}}, "`k_clip` 99 is out of range; use 3 to 48"),
        ({"research": {"k_clip": 9}}, "`k_clip` works only with"),
        ({"research": {"kclip": 9}}, "`research` has 'kclip'; its keys are preset, face"),
        ({"research": "rtf"}, "`research` is 'rtf'; give a dict such as {'preset': 'rtf'}"),
        ({"seed": -1}, "`seed`"),
        ({"sizing": [1.0]}, "`sizing` has shape (1,); give one of shape (3,)"),
        ({"sizing": "property:none"}, "none"),
        ({"features": [[0, 7]]}, "`features` has [0, 7] in row 0"),
        ({"features": "missing.obj"}, "missing.obj"),
        ({"strict": True, "vertices_at_least": True}, "`vertices_at_least`"),
        ({"progress": 3}, "`progress` is 3"),
        ({"device_memory": 0}, "`device_memory` 0 is out of range"),
        ({"device_memory": "much"}, "`device_memory` is 'much'; use 1 to 2^30 MiB"),
        ({"attributes": 5}, "`attributes`"),
        ({"attributes": {"points": {}}}, "`attributes` has ['points']"),
        ({"attributes": {"vertex": {"a": [1]}}}, "`attributes.vertex['a']` has shape (1,), but there are 3"),
        ({"attributes": {"face": {"a": 1}}}, "`attributes.face['a']` has shape ()"),
        ({"attributes": {"uv": np.zeros((3, 2))}}, "`attributes.uv` has shape (3, 2)"),
    ],
)
def test_wrong_arguments_are_named(wrong, says):
    with pytest.raises(rtfmesh.InputError) as raised:
        rtfmesh.remesh(**{**GOOD, **wrong})
    assert says in str(raised.value)
    assert "--" not in str(raised.value) and "\n" not in str(raised.value)
    assert isinstance(raised.value, ValueError) and isinstance(raised.value, rtfmesh.Error)


def test_options_that_there_are_not_are_type_errors():
    with pytest.raises(TypeError, match=r"'k_clip'; did you mean research=\{'k_clip': 9\}"):
        rtfmesh.remesh(**GOOD, k_clip=9)
    with pytest.raises(TypeError, match="'qualty'; did you mean 'quality'"):
        rtfmesh.remesh(**GOOD, qualty="best")


def test_a_device_that_there_is_not_is_named(torus):
    with pytest.raises(rtfmesh.DeviceError, match="`device` is 'no such', which matches no device") as raised:
        rtfmesh.remesh(torus.vertices, torus.faces, 100, device="no such")
    assert isinstance(raised.value, RuntimeError)
    with pytest.raises(rtfmesh.DeviceError):
        rtfmesh.Remesher("no such")


def test_too_little_memory_is_told_before_the_run(torus):
    with pytest.raises(rtfmesh.OutOfMemoryError, match="`device_memory`") as raised:
        rtfmesh.remesh(torus.vertices, torus.faces, 200_000, device_memory=1)
    assert isinstance(raised.value, MemoryError)


def test_what_is_wrong_with_a_result_is_a_warning_at_the_callers_line(torus):
    with pytest.warns(rtfmesh.MeshWarning) as told:
        result = rtfmesh.remesh(torus.vertices, torus.faces, 5000, quality="best", time_limit=0.001)
    assert told[0].filename == __file__
    assert [str(warning.message) for warning in told] == result.report["warnings"]
    # Below what the topology needs, there is no mesh.
    with pytest.raises(rtfmesh.InputError, match=r"4 vertices are too few .*ask for 8 vertices or more"):
        rtfmesh.remesh(torus.vertices, torus.faces, 4)


def test_without_a_driver_the_error_says_what_to_install():
    line = "import rtfmesh; rtfmesh.remesh([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]], 100)"
    nowhere = {"VK_DRIVER_FILES": os.devnull, "VK_ICD_FILENAMES": os.devnull}
    done = subprocess.run(
        [sys.executable, "-c", line],
        env={**os.environ, **nowhere},
        capture_output=True,
        text=True,
        timeout=60,
    )
    last = done.stderr.splitlines()[-1]
    assert last.startswith("rtfmesh._errors.DeviceError: there is no Vulkan driver")
    for command in ("apt install", "dnf install", "pacman -S", "conda install", "brew install"):
        assert command in last
