"""Lists of meshes, and one mesh of a list, without a cluster."""

import json
import os
import stat
import sys

import pytest

import rtfmesh
from rtfmesh.ray import __main__, _pipeline, _worker, remesh_manifest
from rtfmesh.ray._batches import Batches
from rtfmesh.ray._manifest import ROWS, Manifest
from rtfmesh.ray._meshes import STARTS, Job, do_row
from rtfmesh.ray._records import Record, record_path


@pytest.fixture
def job(torus, tmp_path):
    """A run over a folder with one mesh."""
    rtfmesh.write(tmp_path / "a.ply", torus.vertices, torus.faces)
    return Job("first", tmp_path, tmp_path / "out", ".ply", {"n": 100})


ROW = {"id": "a", "path": "a.ply"}


class Failing:
    """A remesher whose device fails."""

    def __init__(self, error):
        self.device = {"name": "none"}
        self.error = error
        self.calls = 0

    def remesh(self, *_, **__):
        """Fails."""
        self.calls += 1
        raise self.error


def test_a_mesh_over_which_workers_die_is_given_up(job):
    failing = Failing(rtfmesh.DeviceError("the device was lost"))
    for _ in range(STARTS):
        with pytest.raises(rtfmesh.DeviceError):
            do_row(failing, job, ROW)
    row = do_row(failing, job, ROW)
    assert row["state"] == "failed" and failing.calls == STARTS
    assert row["error"] == f"{STARTS} workers ended without a result of this mesh: the device was lost"


def test_a_row_with_a_size_of_its_own_takes_no_other(job, remesher, torus):
    row = do_row(remesher, job, {**ROW, "ratio": "0.5"})
    assert (row["state"], row["vertices"], row.get("error")) == ("done", len(torus.vertices) // 2, None)


def test_the_next_run_tries_it_again(job, remesher):
    failing = Failing(rtfmesh.OutOfMemoryError("too little memory"))
    for _ in range(5):
        assert do_row(failing, job, ROW)["error"] == "too little memory"
    # A batch that is begun again does not fail again over what has failed.
    assert failing.calls == 1
    again = Job("second", job.root, job.out, job.suffix, job.options)
    row = do_row(remesher, again, ROW)
    assert (row["state"], row["vertices"], row.get("error")) == ("done", 100, None)
    assert do_row(Failing(ValueError()), again, ROW) == row
    third = Job("third", job.root, job.out, job.suffix, job.options)
    assert do_row(Failing(ValueError()), third, ROW) == {**row, "state": "kept"}


def test_faults_of_any_kind_are_rows(job):
    assert do_row(Failing(ZeroDivisionError("odd")), job, ROW)["error"] == "ZeroDivisionError: odd"
    job.out.joinpath("b").write_text("a file where a folder is to be")
    row = do_row(Failing(None), job, {**ROW, "id": "b/c"})
    assert row["state"] == "failed" and "FileExistsError" in row["error"]


def test_a_worker_without_its_device_ends(job, monkeypatch, capsys):
    worker = _worker.Worker.__new__(_worker.Worker)
    worker._job, worker._remesher = job, Failing(rtfmesh.DeviceError("the device was lost"))
    # `sys.exit` raises, where `os._exit` ends the tests, too.
    monkeypatch.setattr(os, "_exit", sys.exit)
    with pytest.raises(SystemExit, match="1"):
        worker({"rows": [json.dumps([ROW])]})
    assert "the device was lost" in capsys.readouterr().out


def test_warnings_are_in_the_row(job, remesher):
    row = do_row(remesher, job, {**ROW, "n": 5000, "quality": "best", "time_limit": 0.001})
    assert row["state"] == "done" and "time" in row["warnings"]


def test_records_are_whole_or_nothing(tmp_path):
    path = record_path(tmp_path / "a.ply")
    assert path.name == "a.ply.json" and Record.read(path) is None
    record = Record({"path": "x"}, "run", row={"id": "a"})
    record.write(path)
    assert Record.read(path) == record and stat.S_IMODE(path.stat().st_mode) == 0o644
    for text in ("", path.read_text()[:-3], "[]", '{"unknown": 1}'):
        path.write_text(text)
        assert Record.read(path) is None
    assert list(tmp_path.iterdir()) == [path]


def test_batches_are_small_and_read_when_needed(tmp_path):
    count = 3 * ROWS + 5
    lines = "".join(f"m{i},a.ply\n" for i in range(count))
    path = tmp_path / "meshes.csv"
    path.write_text(f"id,path\n{lines}")
    manifest = Manifest.open(path)
    assert manifest.count() == count
    (task,) = Batches(manifest, 10).get_read_tasks(1)
    names = []
    for table in task():
        # Ray divides tables between rows only.
        assert table.num_rows == 1
        batch = json.loads(table["rows"][0].as_py())
        assert len(batch) <= 10 and table.nbytes < 1000
        names += [row["id"] for row in batch]
    assert names == [f"m{i}" for i in range(count)]

    # What is wrong far behind is not met before the rows in front of it are asked for.
    path.write_text(f"id,path\n{lines * 20}one cell\n")
    rows = manifest.rows()
    assert next(rows)["id"] == "m0"
    with pytest.raises(rtfmesh.InputError, match=r"meshes\.csv"):
        list(rows)


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("id,n\na,5\n", "the column 'path' is missing; there are id, n"),
        ("id,path,feature_angel\n", "is not an option of remesh; did you mean 'feature_angle'"),
        ("id,path,zzz\n", "'zzz' is not an option of remesh; remove it"),
        ("id,path\na,x\nb,x\na,y\n", "the id 'a' occurs twice"),
        ("", "not a CSV or Parquet file"),
        ("id,path\na\n", "CSV parse error"),
        (None, "there is no such file"),
    ],
)
def test_lists_that_cannot_be_used_are_errors(text, says, tmp_path):
    path = tmp_path / "meshes.csv"
    if text is not None:
        path.write_text(text)
    with pytest.raises(rtfmesh.InputError, match=says):
        Manifest.open(path).count()


@pytest.mark.parametrize(
    ("wrong", "error", "says"),
    [
        ({"workers": 0}, rtfmesh.InputError, "`workers`"),
        ({"gpus_per_worker": 2}, rtfmesh.InputError, "`gpus_per_worker`"),
        ({"cpus_per_worker": 0}, rtfmesh.InputError, "`cpus_per_worker`"),
        ({"batch_size": 0}, rtfmesh.InputError, "`batch_size`"),
        ({"suffix": ".xyz"}, rtfmesh.InputError, "xyz"),
        ({"qualty": "best"}, TypeError, "did you mean 'quality'"),
        ({"fit": 3}, rtfmesh.InputError, "`fit`"),
        ({"sizing": [1.0, 2.0]}, rtfmesh.InputError, "`sizing`"),
        ({"quality": "hi"}, rtfmesh.InputError, "`quality`"),
        ({"n": 3}, rtfmesh.InputError, "`n`"),
        ({"n": "many"}, rtfmesh.InputError, "`n`"),
        ({"n": 100, "ratio": 0.5}, rtfmesh.InputError, "`ratio`"),
        ({"weld": 2}, rtfmesh.InputError, "`weld` 2 is out of range"),
        ({"research": {"k_clip": 9}}, rtfmesh.InputError, "`k_clip` works only with"),
        ({"accuracy": 3}, rtfmesh.InputError, "`accuracy`"),
        ({"out": os.devnull}, rtfmesh.OutputError, "folder"),
    ],
)
def test_wrong_arguments_are_named_before_anything_begins(wrong, error, says, tmp_path, monkeypatch):
    monkeypatch.setattr(_pipeline.ray, "init", lambda: pytest.fail("Ray was started"))
    monkeypatch.setattr(_pipeline.ray, "is_initialized", lambda: False)
    (tmp_path / "meshes.csv").write_text("id,path\na,a.ply\n")
    with pytest.raises(error, match=says):
        remesh_manifest(**{"manifest": tmp_path / "meshes.csv", "out": tmp_path / "out", **wrong})


@pytest.mark.parametrize(
    ("there", "gpus", "cpus", "workers"),
    [
        ({"CPU": 8.0}, 0, 1, 8),
        ({"CPU": 8.0}, 0, 3, 2),
        ({"CPU": 64.0, "GPU": 4.0}, 1, 2, 4),
        ({"CPU": 64.0, "GPU": 4.0}, 0.25, 1, 16),
        ({"CPU": 2.0, "GPU": 4.0}, 1, 1, 2),
    ],
)
def test_there_are_as_many_workers_as_fit(there, gpus, cpus, workers, monkeypatch):
    monkeypatch.setattr(_pipeline.ray, "cluster_resources", lambda: there)
    assert _pipeline.room(gpus, cpus) == workers
    with pytest.raises(rtfmesh.InputError, match="the cluster has"):
        _pipeline.room(gpus, 1000)


@pytest.mark.parametrize(
    ("meshes", "batch"), [(0, 16), (300, 16), (800_000, 16), (800_001, 17), (10**8, 2000)]
)
def test_the_number_of_batches_has_a_limit(meshes, batch):
    assert _pipeline.usual_batch(meshes) == batch


def test_ctrl_c_ends_the_command_with_130(monkeypatch, capsys):
    def interrupted(*_, **__):
        raise KeyboardInterrupt

    monkeypatch.setattr(__main__, "remesh_manifest", interrupted)
    assert __main__.main(["meshes.csv", "out"]) == 130
    assert "the same command goes on" in capsys.readouterr().err
