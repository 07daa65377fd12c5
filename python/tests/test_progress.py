"""Progress, stops, threads."""

import signal
import subprocess
import sys
import threading
import time

import numpy as np
import pytest
from conftest import same

import rtfmesh


def test_a_function_is_told_of_the_progress(sphere, remesher):
    told = []
    result = remesher.remesh(sphere.vertices, sphere.faces, 5000, quality="best", progress=told.append)
    assert len(result.vertices) == 5000
    assert all(isinstance(progress, rtfmesh.Progress) for progress in told)
    fractions = [progress.fraction for progress in told if progress.attempt == 1]
    assert fractions == sorted(fractions) and 0 <= fractions[0] and 0.1 < fractions[-1] <= 1
    assert {progress.phase for progress in told} > {"last level"}


def test_a_function_may_finish_a_run_early(sphere, remesher):
    with pytest.warns(rtfmesh.MeshWarning, match="ended early"):
        early = remesher.remesh(
            sphere.vertices, sphere.faces, 3000, quality="best", progress=lambda progress: "finish"
        )
    assert len(early.vertices) == 3000 and early.report["finished_early"]


@pytest.fixture
def stopped(sphere, remesher):
    """Runs with a callback that stops it, and checks that the device goes on."""

    def run(callback):
        try:
            return remesher.remesh(sphere.vertices, sphere.faces, 5000, quality="best", progress=callback)
        finally:
            assert len(remesher.remesh(sphere.vertices, sphere.faces, 100).vertices) == 100

    return run


def test_cancelled_runs_raise(stopped):
    with pytest.raises(rtfmesh.Cancelled):
        stopped(lambda progress: "cancel")


def test_what_a_callback_raises_ends_the_run(stopped):
    def fails(progress):
        raise KeyError(progress.phase)

    with pytest.raises(KeyError):
        stopped(fails)


def test_an_answer_that_means_nothing_ends_the_run(stopped):
    for answer in (5, True, False):
        with pytest.raises(rtfmesh.InputError, match=f"`progress` returned {answer}; return None, 'finish'"):
            stopped(lambda progress, answer=answer: answer)


def test_true_shows_a_bar(sphere, remesher, capsys):
    pytest.importorskip("tqdm")
    remesher.remesh(sphere.vertices, sphere.faces, 1000, progress=True)
    assert "100%" in capsys.readouterr().err


def test_without_tqdm_there_is_a_warning_and_a_result(torus, remesher, monkeypatch):
    monkeypatch.setitem(sys.modules, "tqdm", None)
    monkeypatch.setitem(sys.modules, "tqdm.auto", None)
    with pytest.warns(UserWarning, match=r"no progress bar: tqdm is not installed \(pip install tqdm\)"):
        assert len(remesher.remesh(torus, 300, progress=True).vertices) == 300


def test_a_time_limit_ends_a_run_early(sphere, remesher):
    with pytest.warns(rtfmesh.MeshWarning, match="time limit"):
        result = remesher.remesh(sphere.vertices, sphere.faces, 5000, quality="best", time_limit=0.01)
    assert len(result.vertices) == 5000


LONG = """
import signal, sys, numpy as np, rtfmesh
signal.signal(signal.SIGINT, signal.default_int_handler)
mesh = rtfmesh.read(sys.argv[1])
def told(progress):
    print("running", flush=True)
    globals()["told"] = None
# Far more than could be done while the test waits.
try:
    rtfmesh.remesh(mesh.vertices, mesh.faces, 1_000_000, quality="best", progress=lambda p: told and told(p))
except KeyboardInterrupt:
    print("stopped")
"""


# Two surfaces that are close together take long to compare closely.
LONG_MEASURE = """
import signal, sys, threading, numpy as np, rtfmesh
signal.signal(signal.SIGINT, signal.default_int_handler)
mesh = rtfmesh.read(sys.argv[1])
times = range(200)
count = len(mesh.vertices)
vertices = np.concatenate([mesh.vertices + 1e-3 * k for k in times])
faces = np.concatenate([mesh.faces + np.uint32(count * k) for k in times])
try:
    print("running", flush=True)
    while True:
        rtfmesh.measure(vertices, faces, against=(vertices * 1.01, faces), accuracy=1e-6)
except KeyboardInterrupt:
    print("stopped")
"""


@pytest.mark.skipif(sys.platform == "win32", reason="Ctrl-C goes to all processes of a console there")
@pytest.mark.parametrize("program", [LONG, LONG_MEASURE], ids=["remesh", "measure"])
def test_ctrl_c_ends_a_run(folder, program):
    line = [sys.executable, "-c", program, str(folder / "torus.ply")]
    child = subprocess.Popen(line, stdout=subprocess.PIPE, text=True)
    assert child.stdout.readline() == "running\n"
    if program is LONG_MEASURE:
        # Into the midst of it.
        time.sleep(1)
    child.send_signal(signal.SIGINT)
    assert child.communicate(timeout=60)[0] == "stopped\n"
    assert child.returncode == 0


def test_two_remeshers_work_at_once(torus, sphere):
    alone = [rtfmesh.remesh(mesh.vertices, mesh.faces, 500) for mesh in (torus, sphere)]
    found = {}

    def work(place, mesh):
        remesher = rtfmesh.Remesher()
        found[place] = [remesher.remesh(mesh.vertices, mesh.faces, 500) for _ in range(3)]

    threads = [threading.Thread(target=work, args=pair) for pair in enumerate((torus, sphere))]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert all(same(alone[place], result) for place, results in found.items() for result in results)
    assert sorted(found) == [0, 1]


def test_threads_share_a_remesher(torus, remesher):
    counts = [200, 300, 400, 500]
    found = {}

    def work(count):
        found[count] = remesher.remesh(torus.vertices, torus.faces, count)

    threads = [threading.Thread(target=work, args=(count,)) for count in counts]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert [len(found[count].vertices) for count in counts] == counts


def test_other_threads_go_on_during_a_run(sphere, remesher):
    steps, done = [0], threading.Event()

    def count():
        while not done.is_set():
            steps[0] += 1
            np.sqrt(2.0)

    thread = threading.Thread(target=count)
    thread.start()
    before = steps[0]
    remesher.remesh(sphere.vertices, sphere.faces, 2000)
    after = steps[0]
    done.set()
    thread.join()
    # With the interpreter's lock held it could count only before and after.
    assert after - before > 1000
