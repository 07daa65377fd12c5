"""The types of results; ci/python.sh gives this file to mypy, and nothing runs it."""

import numpy as np
from numpy.typing import NDArray
from typing_extensions import assert_type

import rtfmesh


def by_functions(mesh: rtfmesh.Mesh, wanted: bool) -> None:
    """A correspondence is never None where it was asked for."""
    assert_type(rtfmesh.remesh(mesh, 100).correspondence, rtfmesh.Correspondence)
    assert_type(rtfmesh.remesh(mesh, 100, correspondence=True).correspondence, rtfmesh.Correspondence)
    assert_type(rtfmesh.remesh(mesh, 100, seed=7).correspondence.triangles, NDArray[np.uint32])
    for found in (
        rtfmesh.remesh(mesh, 100, correspondence=False),
        rtfmesh.remesh(mesh, 100, correspondence=wanted),
        rtfmesh.reconstruct(mesh.vertices, 100),
        rtfmesh.contour(np.zeros((3, 3, 3)), 100, iso=0),
    ):
        assert_type(found.correspondence, rtfmesh.Correspondence | None)


def by_a_remesher(remesher: rtfmesh.Remesher, mesh: rtfmesh.Mesh, wanted: bool) -> None:
    """The same of a remesher's methods."""
    assert_type(remesher.remesh(mesh.vertices, mesh.faces, 100), rtfmesh.LocatedResult)
    assert_type(remesher.remesh(mesh, 100, correspondence=True), rtfmesh.LocatedResult)
    assert_type(remesher.remesh(mesh, 100, correspondence=wanted), rtfmesh.Result)
