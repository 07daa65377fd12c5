"""Meshes for all tests."""

import os
import subprocess
import sys

import numpy as np
import pytest

import rtfmesh

# As the Rust tests do; lavapipe is everywhere.
os.environ.setdefault("RTFMESH_DEVICE", "cpu")


def program(*args, **wanted):
    """Runs the command line that comes with the package."""
    command = [sys.executable, "-m", "rtfmesh", *map(str, args)]
    return subprocess.run(command, capture_output=True, text=True, timeout=300, **wanted)


@pytest.fixture(scope="session")
def folder(tmp_path_factory):
    """Built-in models in files."""
    folder = tmp_path_factory.mktemp("models")
    for name in ("torus", "bumpy-sphere", "box"):
        done = program("sample", name, folder / f"{name}.ply")
        assert done.returncode == 0, done.stderr
    return folder


@pytest.fixture(scope="session")
def torus(folder):
    """A torus of some thousand faces."""
    return rtfmesh.read(folder / "torus.ply")


@pytest.fixture(scope="session")
def sphere(folder):
    """A sphere with bumps."""
    return rtfmesh.read(folder / "bumpy-sphere.ply")


@pytest.fixture(scope="session")
def remesher():
    """One device for all tests that need no other."""
    return rtfmesh.Remesher()


@pytest.fixture
def tetrahedron():
    """The smallest closed mesh, as lists."""
    vertices = [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]]
    return vertices, [[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]]


def same(a, b):
    """Whether two results are the same to the last bit."""
    return np.array_equal(a.vertices, b.vertices) and np.array_equal(a.faces, b.faces)
