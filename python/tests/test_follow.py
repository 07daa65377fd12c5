"""Results that follow their inputs to other poses."""

import numpy as np
import pytest
from conftest import program

import rtfmesh


def test_poses_are_those_of_the_program(folder, torus, remesher, tmp_path):
    result = remesher.remesh(torus, 300)
    poses = np.stack([torus.vertices, torus.vertices * (1, 2, 1), torus.vertices @ np.diag((1, 1, 3.0))])
    found = rtfmesh.follow(torus, result, poses)
    assert found.shape == (3, 300, 3)
    assert np.abs(found[0] - result.vertices).max() < 1e-12
    rtfmesh.write(tmp_path / "result.ply", result)
    rtfmesh.write(tmp_path / "pose.ply", (poses[1], torus.faces))
    made, files = tmp_path / "made", [folder / "torus.ply", tmp_path / "result.ply", tmp_path / "pose.ply"]
    done = program("follow", *files, "--out", made)
    assert done.returncode == 0, done.stderr
    written = rtfmesh.read(made / "pose.ply")
    assert np.array_equal(written.faces, result.faces)
    assert np.abs(written.vertices - found[1]).max() < 1e-6


def test_meshes_that_are_no_results_are_told(sphere, remesher):
    other = remesher.remesh(rtfmesh.sample("sphere"), 1000)
    with pytest.warns(
        rtfmesh.MeshWarning, match=r"^`result` is up to 1\.\d+ edge lengths .* `mesh`; give"
    ) as told:
        rtfmesh.follow(sphere, other, [sphere.vertices])
    assert told[0].filename == __file__
    rtfmesh.follow(sphere, remesher.remesh(sphere, 200), [sphere.vertices])
    with pytest.raises(rtfmesh.InputError, match=r"^`result` is up to .* away from `mesh`, more than"):
        rtfmesh.follow(sphere, remesher.remesh(rtfmesh.sample("torus"), 1000), [sphere.vertices])


@pytest.mark.parametrize("poses", [np.zeros((2, 5, 3)), np.zeros((5, 3)), "walk", [[[np.nan] * 3] * 4]])
def test_poses_that_do_not_fit_are_errors(tetrahedron, poses):
    with pytest.raises(rtfmesh.InputError, match="poses"):
        rtfmesh.follow(tetrahedron, tetrahedron, poses)
