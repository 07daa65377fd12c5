"""Wrong arguments of `remesh_manifest`, which are said before Ray starts."""

import pytest
import ray

import rtfmesh
from rtfmesh.ray import remesh_manifest


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
        ({"device": "no such"}, "`device` is 'no such': no device matches"),
    ],
)
def test_wrong_arguments_are_said_before_any_work(tmp_path, monkeypatch, wrong, says):
    (tmp_path / "list.csv").write_text("id,path\na,a.ply\n")
    monkeypatch.setattr(ray, "is_initialized", lambda: False)
    monkeypatch.setattr(ray, "init", lambda: pytest.fail("Ray starts"))
    given = {"manifest": tmp_path / "list.csv", "out": tmp_path / "out", "n": 400, **wrong}
    with pytest.raises(rtfmesh.Error) as raised:
        remesh_manifest(**given)
    assert says in str(raised.value)


def test_near_names_are_suggested():
    with pytest.raises(TypeError, match="did you mean 'workers'"):
        remesh_manifest("list.csv", "out", worker=1)
