"""Lists of meshes on a real local Ray, with workers that die."""

import csv
import json
import os
import signal
import threading

import pytest
import ray

import rtfmesh
from rtfmesh.ray import remesh_manifest
from rtfmesh.ray.__main__ import main

# Ray's own.
pytestmark = pytest.mark.filterwarnings("ignore")
MESHES = 300


@pytest.fixture(scope="module", autouse=True)
def cluster(folder):
    """Two cores, and few objects: meshes do not travel through Ray."""
    os.environ["RAY_USAGE_STATS_ENABLED"] = "0"
    ray.init(num_cpus=2, include_dashboard=False, object_store_memory=80 << 20, log_to_driver=False)
    yield
    ray.shutdown()


@pytest.fixture(scope="module")
def small(torus, remesher):
    """A mesh that takes no time."""
    return remesher.remesh(torus.vertices, torus.faces, 300)


def listed(path, rows):
    """A list of meshes in a file."""
    with open(path, "w", newline="") as file:
        table = csv.DictWriter(file, list(rows[0]))
        table.writeheader()
        table.writerows(rows)
    return path


def status(summary):
    """The status rows by their ids."""
    with open(summary.status, newline="") as file:
        rows = list(csv.DictReader(file))
    assert len(rows) == summary.meshes == summary.done + summary.kept + summary.failed
    return {row["id"]: row for row in rows}


def records(out):
    """All records of a folder by their files' names."""
    return {path.name: json.loads(path.read_text()) for path in out.rglob("*.json")}


def stamps(out):
    """When each output was written, to the nanosecond, and in which inode."""
    return {path: (path.stat().st_mtime_ns, path.stat().st_ino) for path in out.rglob("*.ply")}


def kill_worker(out, after, killed, over):
    """Kills a process while it works on a mesh, once so many are done."""
    while not killed and not over.wait(0.005):
        latest = sorted(out.glob("*.json"), key=lambda path: path.stat().st_mtime_ns)
        for record in latest[-2:] if len(latest) > after else []:
            found = json.loads(record.read_text())
            if found["state"] == "started" and not killed:
                killed.append(int(found["row"]["worker"].split(":")[1]))
                os.kill(killed[0], signal.SIGKILL)


def test_every_mesh_is_done_once_though_a_worker_is_killed(small, tmp_path):
    for i in range(MESHES):
        rtfmesh.write(tmp_path / f"{i}.ply", small.vertices * (1 + i), small.faces)
    rows = [{"id": f"mesh-{i}", "path": f"{i}.ply", "n": 100 + i % 3} for i in range(MESHES)]
    manifest, out = listed(tmp_path / "meshes.csv", rows), tmp_path / "out"
    killed, over = [], threading.Event()
    killer = threading.Thread(target=kill_worker, args=(out, MESHES // 3, killed, over))
    killer.start()
    try:
        summary = remesh_manifest(manifest, out, workers=2, batch_size=8)
    finally:
        over.set()
        killer.join()
    assert killed, "no worker was killed"
    assert (summary.done, summary.kept, summary.failed) == (MESHES, 0, 0)
    found = status(summary)
    assert sorted(found) == sorted(f"mesh-{i}" for i in range(MESHES))
    for i in range(MESHES):
        row, mesh = found[f"mesh-{i}"], rtfmesh.read(out / f"mesh-{i}.ply")
        assert len(mesh.vertices) == int(row["vertices"]) == 100 + i % 3
        assert abs(mesh.vertices).max() == pytest.approx((1 + i) * abs(small.vertices).max(), rel=0.1)
        assert float(row["mean_quality"]) > 0.8 and float(row["seconds"]) > 0 and row["error"] == ""
    # Only the mesh over which the worker died was begun again, and that one was not finished before.
    starts = [record["starts"] for record in records(out).values()]
    assert len(starts) == MESHES and sorted(starts)[-2:] in ([1, 1], [1, 2])
    # Before and after: the two first ones and the one in the place of the dead one.
    workers = {row["worker"].split(":")[1] for row in found.values()}
    assert str(killed[0]) in workers and len(workers) == 3
    assert len(list(out.glob("*.ply"))) == MESHES

    before = stamps(out)
    again = remesh_manifest(manifest, out, workers=2)
    assert (again.done, again.kept, again.failed) == (0, MESHES, 0)
    assert stamps(out) == before


@pytest.fixture(scope="module")
def mixed(small, tmp_path_factory):
    """A list with good and bad rows, and the folder of its results."""
    place = tmp_path_factory.mktemp("mixed")
    for name in ("a", "b", "c"):
        rtfmesh.write(place / f"{name}.ply", small.vertices, small.faces)
    (place / "broken.ply").write_text("ply\nformat ascii 1.0\nelement vertex 3\n")
    rows = [
        {"id": "a", "path": "a.ply"},
        {"id": "deep/down/b", "path": place / "b.ply", "n": "0.15k", "fit": "false"},
        {"id": "c", "path": "c.ply", "seed": 5},
        {"id": "broken", "path": "broken.ply"},
        {"id": "missing", "path": "missing.ply"},
        {"id": "range", "path": "a.ply", "feature_angle": 900},
        {"id": "word", "path": "a.ply", "fit": "perhaps"},
        {"id": "../out", "path": "a.ply"},
        {"id": "", "path": "a.ply"},
        {"id": "nowhere", "path": ""},
    ]
    names = ["id", "path", "n", "fit", "seed", "feature_angle"]
    rows = [{name: row.get(name, "") for name in names} for row in rows]
    manifest = listed(place / "meshes.csv", rows)
    return manifest, place / "out", remesh_manifest(manifest, place / "out", n=120, batch_size=3)


def test_errors_are_rows(mixed):
    manifest, out, summary = mixed
    rows = status(summary)
    assert (summary.done, summary.failed) == (3, 7)
    says = {
        "broken": "broken.ply",
        "missing": "missing.ply: No such file",
        "range": "`feature_angle` 900 is out of range",
        "word": "`fit` is 'perhaps'; use true or false",
        "../out": "'../out' is not a valid output name",
        "": "'' is not a valid output name",
        "nowhere": "has no path",
    }
    for name, text in says.items():
        assert rows[name]["state"] == "failed" and text in rows[name]["error"], rows[name]
        assert rows[name]["vertices"] == ""
    made = {str(path.relative_to(out)): len(rtfmesh.read(path).vertices) for path in out.rglob("*.ply")}
    assert made == {"a.ply": 120, "deep/down/b.ply": 150, "c.ply": 120}
    assert {path.parent for path in manifest.parent.glob("*.ply.json")} == set()


def test_what_has_changed_is_done_again(mixed, small):
    manifest, out, _ = mixed
    assert remesh_manifest(manifest, out, n=120).kept == 3

    # Another number for rows without their own; then another seed of one row.
    assert remesh_manifest(manifest, out, n=110).done == 2
    assert len(rtfmesh.read(out / "a.ply").vertices) == 110
    manifest.write_text(manifest.read_text().replace(",5,", ",6,"))
    before = stamps(out)
    summary = remesh_manifest(manifest, out, n=110)
    rows = status(summary)
    assert (rows["a"]["state"], rows["c"]["state"], summary.done) == ("kept", "done", 1)
    assert [path.name for path, stamp in stamps(out).items() if stamp != before[path]] == ["c.ply"]

    # A result that is gone, one that is cut off, and one whose input is another.
    (out / "a.ply").unlink()
    (out / "c.ply").write_bytes((out / "c.ply").read_bytes()[:-7])
    rtfmesh.write(manifest.parent / "b.ply", small.vertices[::-1], len(small.vertices) - 1 - small.faces)
    os.utime(manifest.parent / "b.ply", (1, 1))
    assert remesh_manifest(manifest, out, n=110).done == 3
    assert len(rtfmesh.read(out / "c.ply").vertices) == 110


def test_parquet_has_types(small, tmp_path):
    import pyarrow as pa
    from pyarrow import parquet

    rtfmesh.write(tmp_path / "a.ply", small.vertices, small.faces)
    columns = {"id": [1, 2], "path": ["a.ply"] * 2, "n": [100.0, None], "fit": [None, False]}
    parquet.write_table(pa.table(columns), tmp_path / "meshes.parquet")
    summary = remesh_manifest(
        tmp_path / "meshes.parquet", tmp_path / "out", n="200", suffix=".off", workers=1
    )
    assert summary.done == 2
    assert [len(rtfmesh.read(tmp_path / "out" / f"{i}.off").vertices) for i in (1, 2)] == [100, 200]


def test_it_is_a_command(small, tmp_path, capsys):
    rtfmesh.write(tmp_path / "a.ply", small.vertices, small.faces)
    manifest = listed(tmp_path / "meshes.csv", [{"id": "a", "path": "a.ply"}])
    line = [
        str(manifest),
        str(tmp_path / "out"),
        "-n",
        "100",
        "--workers",
        "1",
        "--option",
        "no-fit",
        "--quiet",
    ]
    assert main(line) == 0
    assert "1 meshes: 1 done, 0 kept, 0 failed" in capsys.readouterr().out
    assert "--no-fit" in records(tmp_path / "out")["a.ply.json"]["source"]["options"]
    listed(manifest, [{"id": "a", "path": "b.ply"}])
    assert main(line) == 1
    assert main(["missing.csv", str(tmp_path / "out")]) == 2
    assert "error: " in capsys.readouterr().err


def test_a_device_that_there_is_not_is_named(tmp_path):
    manifest = listed(tmp_path / "meshes.csv", [{"id": "a", "path": "a.ply"}])
    with pytest.raises(rtfmesh.DeviceError, match="a worker cannot start: `device` is 'no such', which"):
        remesh_manifest(manifest, tmp_path / "out", device="no such", workers=1)
