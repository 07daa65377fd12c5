"""Repairs without remeshing."""

import numpy as np
import pytest

import rtfmesh


def spoiled() -> tuple[np.ndarray, np.ndarray]:
    """A sphere with a hole, a turned face, a spike, and a smaller one inside."""
    vertices, faces = rtfmesh.sample("sphere")
    both = np.vstack([vertices, vertices * 0.3])
    both[9] *= 4.0
    kept = faces.copy()
    kept[200] = kept[200][::-1]
    away = ~(faces == 1200).any(axis=1)
    return both, np.vstack([kept[away], faces + len(vertices)])


def test_what_is_asked_for_is_repaired_and_the_rest_stays() -> None:
    vertices, faces = spoiled()
    count = len(vertices) // 2
    made = rtfmesh.repair(vertices, faces, fill_holes="100%", smooth_spikes=True, outer=True)
    wanted = {"holes_filled": 1, "spikes_smoothed": 1, "hidden_components_removed": 1, "faces_turned": 1}
    assert {name: made.repairs[name] for name in wanted} == wanted
    assert any("hole was filled" in note for note in made.notes)
    topology = rtfmesh.inspect(made.vertices, made.faces)["topology"]
    assert (topology["components"], topology["boundary_loops"]) == (1, 0)
    kept = np.delete(vertices[:count], [9, 1200], axis=0)
    own = {tuple(p) for p in made.vertices}
    assert all(tuple(p) in own for p in kept)
    assert np.linalg.norm(made.vertices, axis=1).max() < 1.01
    assert made.origin.shape == (len(made.faces),) and made.origin.max() < len(faces)


def test_without_options_only_duplicates_and_the_like_go() -> None:
    vertices, faces = spoiled()
    made = rtfmesh.repair((vertices, faces))
    new_vertices, new_faces = made
    assert len(new_vertices) == len(vertices) - 1
    assert len(new_faces) == len(faces)
    assert (made.origin == np.arange(len(faces))).all()
    assert "Repaired: " in repr(made)
    with pytest.raises(rtfmesh.InputError, match="weld"):
        rtfmesh.repair(vertices, faces, weld=2.0)
    with pytest.raises(rtfmesh.InputError, match="fill_holes"):
        rtfmesh.repair(vertices, faces, fill_holes="much")
    with pytest.raises(TypeError, match="did you mean 'fill_holes'"):
        rtfmesh.repair(vertices, faces, fill_hole="5%")  # type: ignore[call-arg]
