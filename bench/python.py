#!/usr/bin/env python3
"""Times the Python package beside the program: python bench/python.py PROGRAM MESH.ply.

Prints how long `import rtfmesh` takes after numpy, what a call takes of the program's time for the same run
(both without files, on a device that is open), and how time and memory go over many small meshes. Medians.
The package must be installed.
"""

import argparse
import json
import resource
import statistics
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import rtfmesh

RUNS = 7
SMALL, MESHES = 2_000, 200  # vertices of the input and of the result


def timed(what):
    begin = time.perf_counter()
    found = what()
    return time.perf_counter() - begin, found


def import_seconds():
    code = "import numpy, time; t = time.perf_counter(); import rtfmesh; print(time.perf_counter() - t)"
    run = lambda: float(subprocess.run([sys.executable, "-c", code], check=True, capture_output=True).stdout)
    return statistics.median(run() for _ in range(RUNS))


def program_seconds(program, mesh, n, folder):
    """The program's own time from the mesh in memory to the result in memory."""
    report = Path(folder, "report.json")
    files = [mesh, Path(folder, "out.ply"), "--report", report]
    subprocess.run([program, "remesh", *files, "-n", str(n), "--quiet"], check=True)
    return json.loads(report.read_text())["timings"]["wall_milliseconds"] / 1000


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("program")
    parser.add_argument("mesh")
    parser.add_argument("-n", type=int, default=10_000)
    args = parser.parse_args()
    print(f"import rtfmesh: {import_seconds():.3f} s")

    mesh = rtfmesh.read(args.mesh)
    remesher = rtfmesh.Remesher()
    # Which point of the input each vertex is at, the program is not asked for.
    run = lambda mesh, n, more: remesher.remesh(
        mesh.vertices, mesh.faces, n, correspondence=False, **more
    )
    call = lambda mesh, n, **more: timed(lambda: run(mesh, n, more))
    call(mesh, args.n)
    with tempfile.TemporaryDirectory() as folder:
        pairs = [
            (call(mesh, args.n, distances=True)[0], program_seconds(args.program, args.mesh, args.n, folder))
            for _ in range(RUNS)
        ]
    own, program = (statistics.median(column) for column in zip(*pairs))
    print(f"{args.n} vertices: {own:.3f} s, the program {program:.3f} s, {own / program:.2f} times")

    small = call(mesh, SMALL)[1]
    seconds, memory = [], []
    for seed in range(MESHES):
        seconds.append(call(small, SMALL, seed=seed)[0])
        memory.append(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss // 1024)
    each = statistics.median(seconds)
    report = call(small, SMALL, distances=True)[1].report
    device = report["timings"]["waiting_milliseconds"] / 1000
    print(f"{MESHES} meshes of {SMALL} vertices: {each:.3f} s each, the device {device:.3f} s of one")
    print(f"peak memory after 20 of them {memory[19]} MiB, after all {memory[-1]} MiB")


if __name__ == "__main__":
    main()
