"""Wrong arguments of `remesh_manifest`, which are said before Ray starts."""

import numpy as np
import pytest
import ray

import rtfmesh
from rtfmesh.ray import remesh_manifest
from rtfmesh.ray.__main__ import main


class StartError(Exception):
    """Ray would start here."""


def begin(folder, monkeypatch, arguments):
    """Calls with arguments, up to the start of Ray."""

    def start():
        raise StartError

    (folder / "list.csv").write_text("id,path\na,a.ply\n")
    monkeypatch.setattr(ray, "is_initialized", lambda: False)
    monkeypatch.setattr(ray, "init", start)
    remesh_manifest(**{"manifest": folder / "list.csv", "out": folder / "out", "n": 400, **arguments})


@pytest.mark.parametrize(
    ("wrong", "says"),
    [
        ({"manifest": 5}, "`manifest` is 5; give a path"),
        ({"out": None}, "`out` is None; give a path"),
        ({"workers": "a"}, "`workers` is 'a'; give a whole number"),
        ({"cpus_per_worker": "x"}, "`cpus_per_worker` is 'x'; give a number"),
        ({"progress": "x"}, "`progress` is 'x'; use True or False"),
        ({"suffix": "ply"}, "`suffix` is 'ply'; give an extension such as '.ply'"),
        ({"suffix": ".zzz"}, "`suffix` is '.zzz': unknown file type"),
        ({"features": "no.obj"}, "`features` is 'no.obj': there is no such file"),
        ({"fixed_points": "no.xyz"}, "`fixed_points` is 'no.xyz': there is no such file"),
        ({"device": 1.5}, "`device` is 1.5; give"),
        ({"device": "no such"}, "`device` is 'no such', which matches no device"),
        ({"min_edge": 2, "max_edge": 1, "sizing": "curvature"}, "`min_edge` 2 is more than `max_edge` 1"),
        ({"min_edge": "2%", "max_edge": "1%", "sizing": "curvature"}, "`min_edge` 2% is more than"),
        ({"wrap": "-1%"}, "`wrap` -1% is out of range; give a length above 0"),
        ({"features": 5}, "`features` is 5; give the name of a file"),
        ({"fixed_points": 0.5}, "`fixed_points` is 0.5; give the name of a file"),
        ({"fixed_points": __file__}, "`fixed_points`: "),
        ({"keep": [3]}, "invalid value '3' for `keep`"),
        ({"sizing": np.ones(3)}, "`sizing` is of type ndarray"),
    ],
)
def test_wrong_arguments_are_said_before_any_work(tmp_path, monkeypatch, wrong, says):
    with pytest.raises(rtfmesh.Error) as raised:
        begin(tmp_path, monkeypatch, wrong)
    assert says in str(raised.value)


@pytest.mark.parametrize(
    "wrong",
    [
        {"wrap": -1},
        {"wrap": 0},
        {"wrap": "0"},
        {"wrap": float("nan")},
        {"wrap": float("inf")},
        {"wrap": "5%", "keep_boundary": True},
        {"wrap": "5%", "keep": "label:a"},
        {"wrap": "5%", "only": ["label:a"]},
        {"wrap": "5%", "features": "lines.obj"},
        {"wrap": "5%", "symmetric": "x"},
        {"wrap": "5%", "n": None, "ratio": 0.5},
        {"smooth_labels": -1, "keep_labels": True},
        {"smooth_labels": 10.5, "keep_labels": True},
        {"smooth_labels": float("nan"), "keep_labels": "a"},
        {"fixed_points": "points.xyz", "max_deviation": "1%"},
        {"fill_holes": -1},
        {"weld": 2},
        {"refine": "sphere:0,0,0,-1=0.5"},
        {"time_limit": 0},
        {"accuracy": 2},
        {"max_deviation": 0},
        {"sizing": "anisotropic", "aspect": 0},
    ],
    ids=lambda wrong: " ".join(map(str, wrong)),
)
def test_what_is_wrong_for_each_mesh_is_said_once(tmp_path, monkeypatch, remesher, wrong):
    (tmp_path / "lines.obj").write_text("v 0 0 0\nv 1 0 0\nl 1 2\n")
    (tmp_path / "points.xyz").write_text("0 0 0\n")
    monkeypatch.chdir(tmp_path)
    wanted = {"n": 400, **wrong}
    box = rtfmesh.sample("box")
    labels = {"face": {"a": (box.faces[:, 0] > 3).astype(int)}}
    with pytest.raises(rtfmesh.InputError) as of_one:
        remesher.remesh(box, wanted.pop("n"), attributes=labels, **wanted)
    with pytest.raises(rtfmesh.InputError) as of_all:
        begin(tmp_path, monkeypatch, wrong)
    name = "NaN" if "NaN" in str(of_one.value) else "nan"
    assert str(of_all.value).replace("nan", name) == str(of_one.value)


@pytest.mark.parametrize(
    "right",
    [
        {"wrap": "5%", "keep_boundary": False, "keep": None, "ratio": None},
        {"wrap": 0.1, "n": None},
        {"smooth_labels": 10, "keep_labels": "a"},
        {"smooth_labels": "0", "keep_labels": True},
        {"max_deviation": "1%"},
        {"fixed_points": "points.xyz"},
        {"fixed_points": "box.ply", "features": "lines.obj"},
    ],
)
def test_what_is_right_is_not_refused(tmp_path, monkeypatch, right):
    (tmp_path / "lines.obj").write_text("v 0 0 0\nv 1 0 0\nl 1 2\n")
    (tmp_path / "points.xyz").write_text("0 0 0\n1 0 0\n")
    rtfmesh.write(tmp_path / "box.ply", rtfmesh.sample("box"))
    monkeypatch.chdir(tmp_path)
    with pytest.raises(StartError):
        begin(tmp_path, monkeypatch, right)


def test_the_command_says_it_at_once(tmp_path, capsys):
    (tmp_path / "list.csv").write_text("id,path\na,a.ply\n")
    line = [str(tmp_path / "list.csv"), str(tmp_path / "out"), "-n", "400", "--option", "wrap=-1"]
    assert main(line) == 2
    assert capsys.readouterr().err == "error: `wrap` -1 is out of range; give a length above 0, such as 1%\n"


def test_near_names_are_suggested():
    with pytest.raises(TypeError, match="did you mean 'workers'"):
        remesh_manifest("list.csv", "out", worker=1)
