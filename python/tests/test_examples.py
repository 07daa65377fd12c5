"""The example that fills a surface with tetrahedra."""

import importlib.util
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from conftest import program

import rtfmesh

meshio = pytest.importorskip("meshio")
pytest.importorskip("gmsh")

PATH = Path(__file__).parents[1] / "examples/tetrahedra.py"


@pytest.fixture(scope="module")
def example():
    """The example as a module."""
    spec = importlib.util.spec_from_file_location("tetrahedra", PATH)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def run(*words):
    """The example as a program."""
    command = [sys.executable, str(PATH), *map(str, words)]
    return subprocess.run(command, capture_output=True, text=True, timeout=300)


def rows(corners):
    """Triangles as a set, whatever their order and their first corners."""
    return {tuple(row) for row in np.sort(corners, axis=1).tolist()}


def test_tetrahedra_keep_the_triangles_and_groups_of_the_surface(example, tmp_path):
    # Both triangles of each side of a cube differ, so that borders run across its sides, too.
    box = rtfmesh.sample("box")
    corners = box.vertices[box.faces]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    half = 2 * np.argmax(np.abs(normals), axis=1) + np.arange(12) % 2
    names = ["x first", "x second", "y first", "y second", "z first", "z second"]
    box.attributes.face["half"] = half.astype(np.int32)
    box.attributes.label_names["half"] = names
    result = example.remesh(box, 500)
    example.fill(result, str(tmp_path / "box.msh"))
    made = meshio.read(tmp_path / "box.msh", file_format="gmsh")
    assert {*made.field_data} == {*names, "volume"}
    # The nodes of the surface are the result's vertices, bit by bit, and others are inside.
    places = {tuple(point): number for number, point in enumerate(result.vertices.tolist())}
    number = np.array([places.get(tuple(point), -1) for point in made.points.tolist()])
    assert sorted(number[number >= 0]) == list(range(500))
    assert (np.abs(made.points[number < 0] - 0.5) < 0.5).all()
    tetrahedra, triangles = made.cells_dict["tetra"], made.cells_dict["triangle"]
    assert rows(number[triangles]) == rows(result.faces) and len(triangles) == len(result.faces)
    sides, counts = np.unique(
        np.sort(np.concatenate([np.delete(tetrahedra, k, axis=1) for k in range(4)]), axis=1),
        axis=0,
        return_counts=True,
    )
    assert counts.max() == 2 and rows(number[sides[counts == 1]]) == rows(result.faces)
    a, b, c, d = (made.points[tetrahedra[:, k]] for k in range(4))
    volumes = np.einsum("ij,ij->i", np.cross(b - a, c - a), d - a) / 6
    assert volumes.min() > 0 and volumes.sum() == pytest.approx(1)
    for place, name in enumerate(names):
        (physical, _) = made.field_data[name]
        own = made.points[triangles[made.cell_data_dict["gmsh:physical"]["triangle"] == physical]]
        assert np.abs(np.abs(own[:, :, place // 2] - 0.5) - 0.5).max() < 1e-9
        # Half of two sides.
        areas = np.linalg.norm(np.cross(own[:, 1] - own[:, 0], own[:, 2] - own[:, 0]), axis=1) / 2
        assert areas.sum() == pytest.approx(1)
    # Nodes are Gmsh's of all patches, and not of one.
    assert len({tag for dimension, tag in made.point_data["gmsh:dim_tags"].tolist() if dimension == 2}) == 6
    angles = example.dihedral_angles(made.points, tetrahedra)
    assert angles.shape == (len(tetrahedra), 6) and angles.min() > 5


def test_labels_of_one_name_are_one_group_and_those_without_a_name_have_their_numbers(example):
    box = rtfmesh.sample("box")
    box.attributes.face["half"] = np.repeat(np.array([0, 1, 2, -1], np.int32), 3)
    box.attributes.label_names["half"] = ["wall", "wall"]
    found = {name: faces.tolist() for name, faces in example.patches_of(box).items()}
    assert found == {"half -1": [9, 10, 11], "wall": [0, 1, 2, 3, 4, 5], "half 2": [6, 7, 8]}


def test_dihedral_angles_are_those_of_known_tetrahedra(example):
    regular = np.array([[1, 1, 1], [1, -1, -1], [-1, 1, -1], [-1, -1, 1]], float)
    corner = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]], float)
    cells = np.array([[0, 1, 2, 3]])
    assert example.dihedral_angles(regular, cells) == pytest.approx(np.degrees(np.arccos(1 / 3)))
    angles = np.sort(example.dihedral_angles(corner, cells)[0])
    assert angles == pytest.approx([*[np.degrees(np.arccos(1 / 3**0.5))] * 3, 90, 90, 90])


def test_the_program_says_what_is_in_the_file(tmp_path):
    program("sample", "genus3", tmp_path / "part.stl")
    done = run(tmp_path / "part.stl", tmp_path / "volume.msh", 800)
    assert done.returncode == 0, done.stderr
    counts, angles, groups = done.stdout.splitlines()
    made = meshio.read(tmp_path / "volume.msh", file_format="gmsh")
    tetrahedra = len(made.cells_dict["tetra"])
    # A closed surface of genus 3 has 2 * (V + 4) triangles.
    assert counts == f"{len(made.points)} points, 1608 triangles, {tetrahedra} tetrahedra"
    assert angles.startswith("dihedral angles from ") and groups == "groups: surface, volume"


@pytest.mark.parametrize(
    ("model", "text"),
    [
        ("open-hemisphere", "not closed; use `rtfmesh repair --fill-holes`"),
        ("two-components", "2 components; give each body"),
    ],
)
def test_surfaces_that_enclose_no_volume_are_refused(model, text, tmp_path):
    program("sample", model, tmp_path / "part.ply")
    done = run(tmp_path / "part.ply", tmp_path / "volume.msh", 500)
    assert done.returncode == 1 and text in done.stderr and not (tmp_path / "volume.msh").exists()


def test_surfaces_that_intersect_themselves_are_refused(tmp_path):
    # A tube around a figure of eight.
    u, v = np.meshgrid(
        *[np.linspace(0, 2 * np.pi, count, endpoint=False) for count in (80, 16)], indexing="ij"
    )
    along = np.stack([np.cos(u), np.cos(2 * u), 0 * u], axis=-1)
    side = np.cross(along / np.linalg.norm(along, axis=-1, keepdims=True), [0, 0, 1])
    middle = np.stack([np.sin(u), np.sin(u) * np.cos(u), 0 * u], axis=-1)
    at = middle + 0.15 * (np.cos(v)[..., None] * side + np.sin(v)[..., None] * [0, 0, 1])
    corner = np.arange(80 * 16).reshape(80, 16)
    a, b, c, d = (np.roll(corner, shift, (0, 1)).ravel() for shift in ((0, 0), (-1, 0), (-1, -1), (0, -1)))
    faces = np.concatenate([np.column_stack([a, b, c]), np.column_stack([a, c, d])])
    rtfmesh.write(tmp_path / "part.ply", at.reshape(-1, 3), faces)
    done = run(tmp_path / "part.ply", tmp_path / "volume.msh", 800)
    assert done.returncode == 1 and "faces intersect others" in done.stderr, done.stdout + done.stderr
