"""What the package does to the process that it is in: modules, memory, threads."""

import os
import subprocess
import sys

import pytest


def run(text, *args, **environment):
    """The words that a program in a process of its own prints."""
    done = subprocess.run(
        [sys.executable, "-c", text, *map(str, args)],
        env={**os.environ, **environment},
        capture_output=True,
        text=True,
        timeout=300,
    )
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout.split()


def test_the_import_brings_no_large_package():
    text = """
import sys, numpy
before = set(sys.modules)
import rtfmesh
print(*sorted({name.partition(".")[0] for name in set(sys.modules) - before}))
"""
    brought = set(run(text))
    assert "rtfmesh" in brought
    # Of what is not Python's own. `rtfmesh_cpu` is only the place of a driver.
    assert brought - set(sys.stdlib_module_names) - {"numpy"} <= {"rtfmesh", "rtfmesh_cpu"}
    # Of Python's own, what takes long.
    assert not brought & {"asyncio", "concurrent", "email", "http", "multiprocessing", "unittest", "xml"}


MEMORY = """
import resource, sys
import numpy as np, rtfmesh

values = np.linalg.norm(np.indices((14, 14, 14)) - 6.5, axis=0)

def calls(count):
    for _ in range(count):
        mesh = rtfmesh.read(sys.argv[1])
        attributes = {"vertex": {"height": mesh.vertices[:, 2]}}
        result = rtfmesh.remesh(mesh, 300, quality="draft", attributes=attributes)
        rtfmesh.contour(values, 60, iso=5, quality="draft")
        rtfmesh.measure(result)
        try:
            rtfmesh.remesh(mesh, 300, weld=2)
        except rtfmesh.InputError:
            pass

def peak():
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * (1 if sys.platform == "darwin" else 1024)

calls(20)
before = peak()
calls(100)
print(peak() - before)
"""


@pytest.mark.skipif(sys.platform == "win32", reason="no module `resource`")
def test_memory_stays_flat_over_hundreds_of_calls(folder):
    (grown,) = run(MEMORY, folder / "torus.ply")
    # If the mesh of each round stayed, which has 80 kB, that would be 8 MB.
    assert int(grown) < 4 << 20


THREADS = """
import hashlib, sys
import numpy as np, rtfmesh

mesh = rtfmesh.read(sys.argv[1])
heights = {"vertex": {"height": mesh.vertices[:, 2]}}
values = np.linalg.norm(np.indices((20, 20, 20)) - 9.5, axis=0)
results = [
    rtfmesh.remesh(mesh, 800, attributes=heights),
    rtfmesh.remesh(mesh, 800, sizing="curvature", seed=5),
    rtfmesh.remesh(mesh, 800, local=True),
    rtfmesh.remesh(mesh, 500, wrap="4%"),
    rtfmesh.reconstruct(mesh.vertices, 500),
    rtfmesh.contour(values, 500, iso=7),
    rtfmesh.contour((values < 7).astype(int), 500, labels=True),
]
for result in results:
    found = hashlib.sha256(result.vertices.tobytes() + result.faces.tobytes())
    for arrays in (result.attributes.vertex, result.attributes.face):
        for name in sorted(arrays):
            found.update(arrays[name].tobytes())
    if result.correspondence:
        found.update(result.correspondence.triangles.tobytes() + result.correspondence.barycentrics.tobytes())
    print(found.hexdigest())
"""


def test_any_number_of_threads_gives_the_same_bytes(folder):
    found = [
        run(THREADS, folder / "torus.ply", RAYON_NUM_THREADS=str(count), LP_NUM_THREADS=str(count))
        for count in (1, 2, 5)
    ]
    assert len(set(found[0])) == 7
    assert found[1] == found[0] and found[2] == found[0]
