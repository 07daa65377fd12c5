"""Copies of remeshers, and what travels to other processes."""

import copy
import multiprocessing
import pickle

from conftest import same

import rtfmesh


def remeshed(remesher):
    """What another process makes of a remesher."""
    result = remesher.remesh(rtfmesh.sample("box"), 60)
    return result.vertices, result.faces


def test_remeshers_can_be_copied(remesher):
    mesh = rtfmesh.sample("box")
    expected = remesher.remesh(mesh, 60)
    limited = rtfmesh.Remesher(device_memory=512, timings=True)
    for made in (copy.deepcopy(remesher), pickle.loads(pickle.dumps(limited))):
        assert same(made.remesh(mesh, 60), expected)
        assert made.device == remesher.device
    assert pickle.loads(pickle.dumps(limited))._wanted == (None, 512, True)


def test_remeshers_travel_to_other_processes(remesher):
    expected = remesher.remesh(rtfmesh.sample("box"), 60)
    with multiprocessing.get_context("spawn").Pool(1) as pool:
        (vertices, faces), *_ = pool.map(remeshed, [remesher])
    assert (vertices == expected.vertices).all() and (faces == expected.faces).all()
