"""What `help` and the question mark of notebooks say of the options."""

import inspect
import math
import re

import make_options
import pytest

import rtfmesh
from rtfmesh import _native, _words

BOX = rtfmesh.sample("box")
# What options need in order to do anything.
NEEDS = {
    "growth": {"sizing": "curvature"},
    "max_edge": {"sizing": "curvature"},
    "min_edge": {"sizing": "curvature"},
    "smooth_labels": {"keep_labels": "side", "attributes": {"face": {"side": BOX.faces[:, 0] > 3}}},
}
PRESETS = {"offset": "rpf", "lbfgs": "rvd"}
SIZES = ("n_faces", "edge_length", "ratio", "max_deviation")
INTEGERS = ("n_faces", "iterations", "seed", "lbfgs")


def entries(text):
    """The entries of a documentation: what follows the name, and the text."""
    found = re.findall(r"^( *)(\w+) : (.+)\n((?:\1    .*\n)+)", f"{text}\n", re.MULTILINE)
    return {name: (kind, " ".join(lines.split())) for _, name, kind, lines in found}


@pytest.mark.parametrize("kind", [rtfmesh.Options, rtfmesh.Research])
def test_all_options_are_explained(kind):
    found = entries(inspect.getdoc(kind))
    assert list(found) == list(kind.__annotations__)
    assert all(len(text) > 10 and text.endswith(".") for _, text in found.values())


def test_entries_have_types_units_ranges_and_defaults():
    found = entries(inspect.getdoc(rtfmesh.Options))
    assert found["quality"] == (
        '{"draft", "normal", "best"}',
        "Speed or quality [default: normal].",
    )
    kind, text = found["feature_angle"]
    assert kind == "float, above 0, at most 180 degrees" and "180 disables [default: 40]." in text
    kind, text = found["min_angle"]
    assert kind == "float, degrees" and "0 to 40; 0 disables [default: 30]." in text
    assert found["time_limit"][0] == "float, above 0 seconds"
    kind, text = found["max_edge"]
    assert kind == "float | str, above 0" and "in input units or e.g. 5% [default: 8 times" in text
    # What Python has instead of repeated flags and files.
    assert "array (L, 2)" in found["features"][1] and "may be a list" in found["refine"][1]
    assert not re.search(r"--[a-z]|several times|WHAT", inspect.getdoc(rtfmesh.Options))


def test_entries_are_short():
    lines = inspect.getdoc(rtfmesh.Options).splitlines()
    assert max(map(len, lines)) <= 110
    for name, (_, text) in entries(inspect.getdoc(rtfmesh.Options)).items():
        # Some have a syntax of their own.
        assert len(text) <= (700 if name in ("keep", "sizing", "refine") else 230), name


def test_functions_explain_their_options():
    expected = entries(inspect.getdoc(rtfmesh.Options))
    for function in (rtfmesh.remesh, rtfmesh.reconstruct, rtfmesh.contour):
        text = inspect.getdoc(function)
        assert entries(text) == expected
        sections = re.findall(r"\n\n(\w[\w ]+)\n-+\n", text)
        assert sections == ["Parameters", "Other Parameters", "Returns", "Raises", "Warns"]
        # What the function says itself is as it was.
        assert "    As in `Remesher`. The device" in text or "\nprogress, device, device_memory\n" in text
    assert inspect.signature(rtfmesh.remesh).parameters["seed"].annotation == "int | None"


def test_methods_and_other_modules_explain_their_options():
    pyvista = pytest.importorskip("pyvista")
    expected = entries(inspect.getdoc(rtfmesh.Options))
    surface, image = pyvista.Cube().rtfmesh, pyvista.ImageData(dimensions=(3, 3, 3)).rtfmesh
    points = pyvista.PointSet([[0.0, 0, 0]]).rtfmesh
    remesher = rtfmesh.Remesher
    for function in (
        *(remesher.remesh, remesher.reconstruct, remesher.contour),
        *(surface.remesh, surface.reconstruct, points.reconstruct, image.contour),
        *(rtfmesh.trimesh.remesh, rtfmesh.meshio.remesh, rtfmesh.vtk.remesh),
    ):
        text = inspect.getdoc(function)
        assert entries(text) == expected, function
        assert text.count("\n\nOther Parameters\n----------------\n") == 1
    assert inspect.getdoc(remesher.remesh).startswith("As `rtfmesh.remesh`, on this device.\n\nOther")
    assert "Other Parameters" not in inspect.getdoc(surface.measure)


def test_signatures_show_what_is_left_out():
    parameters = inspect.signature(rtfmesh.remesh).parameters
    assert parameters["strict"].default is False and parameters["fit"].default is True
    assert parameters["strict"].annotation == "bool" and parameters["seed"].default is None


def given(name, value):
    """The arguments that give an option a value."""
    if name in PRESETS:
        return {"research": {"preset": PRESETS[name], name: value}}
    return {name: value, **NEEDS.get(name, {})}


@pytest.mark.parametrize("name", make_options.RANGES)
def test_ranges_are_as_they_are_said(name, remesher):
    low, high, is_above, is_below = make_options.RANGES[name]
    step = 1 if name in INTEGERS else 1e-3
    inside = [low + step if is_above else low]
    outside = [low if is_above else low - step]
    if high < math.inf:
        inside.append(high - step if is_below else high)
        outside.append(high if is_below else high + step)
    n = None if name in SIZES else 100
    for value in inside:
        wanted = given(name, value)
        wanted.pop("attributes", None)
        _native.check(_words.words(n, wanted))
    for value in outside:
        with pytest.raises(rtfmesh.InputError) as raised:
            remesher.remesh(BOX, n, **given(name, value))
        assert f"`{name}`" in str(raised.value)
