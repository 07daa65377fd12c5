"""Processes that are forked from one that has used a device, and those that are started otherwise."""

import os
import subprocess
import sys

import pytest

pytestmark = pytest.mark.skipif(not hasattr(os, "fork"), reason="nothing forks on this system")

# Programs of their own, since what goes wrong hangs.
HEAD = """
import multiprocessing, os, signal, sys, threading, time, warnings
import numpy as np, rtfmesh

warnings.filterwarnings("ignore", category=DeprecationWarning)
mesh = rtfmesh.read(sys.argv[1])

def job(n, **wanted):
    result = rtfmesh.remesh(mesh.vertices, mesh.faces, n, **wanted)
    return result.vertices.tobytes()

def in_fork(work):
    sys.stdout.flush()
    child = os.fork()
    if child == 0:
        try:
            work()
        except BaseException as error:
            print(type(error).__name__, error, flush=True)
            os._exit(1)
        os._exit(0)
    return os.waitstatus_to_exitcode(os.waitpid(child, 0)[1])
"""


@pytest.fixture
def run(folder, tmp_path):
    """What a program prints; it must end within a minute or two."""

    def run(text):
        file = tmp_path / "program.py"
        file.write_text(HEAD + text)
        done = subprocess.run(
            [sys.executable, file, folder / "torus.ply"], capture_output=True, text=True, timeout=120
        )
        assert done.returncode == 0, done.stdout + done.stderr
        return done.stdout.splitlines()

    return run


@pytest.mark.parametrize("method", ["fork", "forkserver", "spawn"])
@pytest.mark.parametrize("used", [True, False])
def test_pools_give_what_the_parent_gives(run, method, used):
    text = f"""
if __name__ == "__main__":
    first = job(300) if {used} else None
    with multiprocessing.get_context({method!r}).Pool(2) as pool:
        found = pool.map(job, [300, 200, 300])
    assert found[0] == found[2] == (first or job(300)) and found[1] == job(200)
    print("same")
"""
    assert run(text) == ["same"]


def test_what_the_parent_opened_is_let_go_and_opened_again(run):
    text = """
remesher = rtfmesh.Remesher()
before = remesher.remesh(mesh.vertices, mesh.faces, 300).vertices.tobytes()

def child():
    global remesher
    for _ in range(2):
        assert remesher.remesh(mesh.vertices, mesh.faces, 300).vertices.tobytes() == before
        assert job(200)
    assert rtfmesh.measure(mesh.vertices, mesh.faces)["quality"] and rtfmesh.devices() and remesher.device
    assert in_fork(lambda: job(200) and remesher.device) == 0
    del remesher
    print("done", flush=True)

job(200)
assert in_fork(child) == 0

def unused():
    global remesher
    del remesher
    rtfmesh._remesher._remeshers.clear()
    print("let go", flush=True)

assert in_fork(unused) == 0
assert remesher.remesh(mesh.vertices, mesh.faces, 300).vertices.tobytes() == before
"""
    assert run(text) == ["done", "let go"]


def test_a_fork_compiles_what_a_run_needs_later(run):
    # As for tens of thousands of vertices; on a thread beside the run, which hung in a fork.
    text = """
os.environ["RTFMESH_DEVICE_POLISH"] = "1"
first = job(300)
print(in_fork(lambda: print(job(300) == first, flush=True)))
"""
    assert run(text) == ["True", "0"]


def test_a_fork_may_end_as_any_process(run):
    text = """
before = job(300)
sys.stdout.flush()
child = os.fork()
if child == 0:
    assert job(300) == before
    sys.exit(7)
assert os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]) == 7
# Nor is one hurt that never uses what it has got.
child = os.fork()
if child == 0:
    sys.exit(8)
assert os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]) == 8
print("ended", len(job(300)) == len(before))
"""
    assert run(text) == ["ended True"]


def test_a_fork_during_a_run_is_told_every_time(run):
    text = """
def forked():
    for work in (lambda: job(200), rtfmesh.devices, lambda: rtfmesh.Remesher()):
        try:
            work()
        except rtfmesh.DeviceError as error:
            print("spawn" in str(error), flush=True)

began, may_end = threading.Event(), threading.Event()

def told(progress):
    began.set()
    may_end.wait(60)

thread = threading.Thread(target=lambda: job(5000, quality="best", progress=told))
thread.start()
began.wait(60)
assert in_fork(forked) == 0
may_end.set()
thread.join()
"""
    assert run(text) == ["True"] * 3


def test_a_process_that_progress_forks_ends_with_the_function(run):
    text = """
sys.stderr = sys.stdout

def fork_and(leave):
    children = []

    def told(progress):
        if not children:
            sys.stdout.flush()
            children.append(os.fork())
            if children[0] == 0:
                leave()

    job(20_000, quality="best", progress=told)
    return os.waitstatus_to_exitcode(os.waitpid(children[0], 0)[1])

print(fork_and(lambda: print("in the fork")))
print(fork_and(lambda: sys.exit(7)), fork_and(sys.exit))
print(fork_and(lambda: 1 / 0), fork_and(lambda: sys.exit("for a reason")))
"""
    printed = run(text)
    assert printed[:2] == ["in the fork", printed[1]] and "in a process that it has forked" in printed[1]
    assert printed[2:4] == ["1", "7 0"] and printed[4].startswith("Traceback")
    assert printed[-3:] == ["ZeroDivisionError: division by zero", "for a reason", "1 1"]


def test_ctrl_c_ends_a_run_in_a_fork(run):
    text = """
def child():
    def told(progress):
        os.kill(os.getpid(), signal.SIGINT) if not sent else None
        sent.append(1)

    sent = []
    signal.signal(signal.SIGINT, signal.default_int_handler)
    try:
        job(20_000, quality="best", progress=told)
    except KeyboardInterrupt:
        print("stopped", flush=True)

job(300)
assert in_fork(child) == 0
"""
    assert run(text) == ["stopped"]


def test_workers_of_a_data_loader(run):
    pytest.importorskip("torch")
    text = """
import torch

class Meshes(torch.utils.data.Dataset):
    def __len__(self):
        return 6

    def __getitem__(self, index):
        return len(job(100 + 50 * index)) // 24

job(300)
loader = torch.utils.data.DataLoader(Meshes(), num_workers=2, batch_size=None)
print([int(count) for count in loader])
"""
    assert run(text) == ["[100, 150, 200, 250, 300, 350]"]
