"""Surfaces of points without faces."""

import signal
import subprocess
import sys

import numpy as np
import pytest
from conftest import program, same

import rtfmesh


def on_sphere(count, seed=1):
    """Random points of the unit sphere."""
    points = np.random.default_rng(seed).normal(size=(count, 3))
    return points / np.linalg.norm(points, axis=1, keepdims=True)


def radii(result):
    """Distances of the vertices from the centre."""
    return np.linalg.norm(result.vertices, axis=1)


def boundary(result):
    """How many edges have a face on one side alone."""
    edges = np.sort(result.faces[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
    return int((np.unique(edges, axis=0, return_counts=True)[1] == 1).sum())


def volume(result):
    """Positive if faces look outward."""
    a, b, c = (result.vertices[result.faces[:, k]] for k in range(3))
    return np.einsum("ij,ij->i", a, np.cross(b, c)).sum() / 6


@pytest.fixture(scope="module")
def points():
    """A sphere's, even enough for a closed surface."""
    return on_sphere(4000)


def test_points_become_a_closed_surface_of_exactly_n_vertices(points, remesher):
    before = points.copy()
    result = rtfmesh.reconstruct(points, 500)
    assert isinstance(result, rtfmesh.Result) and result.vertices.shape == (500, 3)
    assert result.faces.shape == (996, 3) and boundary(result) == 0
    assert np.abs(radii(result) - 1).max() < 0.01 and volume(result) > 4
    assert result.correspondence is None and result.face_correspondence is None
    assert result.report["output"]["quality"]["min_angle"] > 30
    assert "a point cloud (4000 points" in result.report["notes"][0]
    assert np.array_equal(points, before)
    # The same from a remesher of one's own, from a list, and in float32 nearly.
    assert same(remesher.reconstruct(points.tolist(), 500), result)
    assert np.allclose(radii(remesher.reconstruct(points.astype(np.float32), 500)), 1, atol=0.01)


def test_normals_that_disagree_are_found_again_with_a_warning(points, remesher):
    signs = np.random.default_rng(2).choice([-1.0, 1.0], len(points))[:, None]
    with pytest.warns(rtfmesh.MeshWarning, match="opposite normals"):
        result = remesher.reconstruct(points, 500, normals=signs * points)
    assert same(result, remesher.reconstruct(points, 500))
    assert result.report["warning_codes"] == ["normals"]
    assert not any("disagree" in note for note in result.report["notes"])
    # Right ones are used, and so may be inward ones: they agree.
    assert not same(remesher.reconstruct(points, 500, normals=points), result)


def test_the_program_makes_the_same_of_a_file(points, tmp_path):
    normals = -points
    rows = np.hstack([points, normals])
    np.savetxt(tmp_path / "in.xyz", rows, header="x y z nx ny nz", comments="", fmt="%.17g")
    done = program("remesh", tmp_path / "in.xyz", tmp_path / "out.ply", "-n", 300, "--fill-holes", "2%", "-q")
    assert done.returncode == 0, done.stderr
    made = rtfmesh.read(tmp_path / "out.ply")
    cloud = rtfmesh.read(tmp_path / "in.xyz", points=True)
    assert cloud.faces.shape == (0, 3)
    (normal,) = cloud.attributes.vertex.values()
    assert np.allclose(normal, normals)
    result = rtfmesh.reconstruct(cloud.vertices, 300, normals=normal, fill_holes="2%")
    assert np.array_equal(made.vertices, result.vertices) and np.array_equal(made.faces, result.faces)
    # Normals that point inward turn the surface inside out.
    assert volume(result) < -4
    with pytest.raises(rtfmesh.InputError, match=r"with `points=True` and call rtfmesh\.reconstruct"):
        rtfmesh.read(tmp_path / "in.xyz")


def test_holes_stay_open_unless_they_are_to_close(points):
    bowl = points[points[:, 2] < 0.5]
    assert boundary(rtfmesh.reconstruct(bowl, 300)) > 10
    assert boundary(rtfmesh.reconstruct(bowl, 300, fill_holes=0.1)) > 10
    assert boundary(rtfmesh.reconstruct(bowl, 300, fill_holes=3)) == 0
    assert boundary(rtfmesh.reconstruct(bowl, 300, fill_holes="80%")) == 0
    assert boundary(rtfmesh.reconstruct(bowl, 300, closed=True)) == 0


def test_values_of_points_come_along(points):
    attributes = {
        "vertex": {"height": points[:, 2], "upper": points[:, 2] > 0, "name": (points[:, 0] > 0).astype(str)}
    }
    carried = rtfmesh.reconstruct(points, 400, attributes=attributes)
    vertex = carried.attributes.vertex
    z = carried.vertices[:, 2]
    assert list(vertex) == ["height", "upper", "name"]
    assert np.allclose(vertex["height"], z, atol=0.1)
    assert (vertex["upper"] == (z > 0))[np.abs(z) > 0.1].all()
    x = carried.vertices[:, 0]
    assert (vertex["name"] == (x > 0).astype(str))[np.abs(x) > 0.1].all()
    assert carried.correspondence is None


def test_sizes_are_those_of_the_points(points):
    assert len(rtfmesh.reconstruct(points, ratio=0.1).vertices) == 400
    assert len(rtfmesh.reconstruct(points[:900]).vertices) == 900
    lengths = np.where(points[:, 2] > 0, 1.0, 3.0)
    sized = rtfmesh.reconstruct(points, 600, sizing=lengths, attributes={"vertex": {"z": points[:, 2]}})
    assert list(sized.attributes.vertex) == ["z"]
    assert (sized.vertices[:, 2] > 0).sum() > 400


def test_points_seen_from_above_become_a_terrain_unless_an_object_is_asked_for():
    x, y = np.meshgrid(np.arange(50.0), np.arange(50.0))
    ground = np.stack([x, y, 0.1 * x], axis=-1).reshape(-1, 3)
    # A canopy over a part of the ground.
    points = np.vstack([ground, ground[ground[:, 0] < 20] + [0.4, 0.4, 9]])
    classes = np.repeat([2, 5], [len(ground), len(points) - len(ground)]).astype(np.uint8)
    made = rtfmesh.reconstruct(points, 400, attributes={"vertex": {"classification": classes}})
    assert made.vertices[:, 2].max() < 5.5 and (made.attributes.vertex["classification"] == 2).all()
    assert any("--points-as" in note or "`points_as`" in note for note in made.report["notes"])
    assert rtfmesh.reconstruct(points, 400, points_as="terrain").vertices[:, 2].max() < 5.5
    assert rtfmesh.reconstruct(points, 400, points_as="object").vertices[:, 2].max() > 8


@pytest.mark.parametrize(
    ("wrong", "part"),
    [
        ({"points": np.zeros((20, 2))}, "`points` has shape (20, 2); give one of shape (N, 3)"),
        ({"points": [[0, 0, 0]]}, "10"),
        ({"points": np.linspace(0, 1, 60).reshape(20, 3)}, "lie on lines"),
        ({"points": np.full((20, 3), np.nan)}, "finite"),
        ({"normals": np.zeros((5, 3))}, "`normals` has shape (5, 3)"),
        ({"closed": True, "fill_holes": 1}, "`closed` and `fill_holes` exclude each other"),
        ({"fill_holes": "wide"}, "invalid value 'wide' for `fill_holes`: give a length"),
        ({"fill_holes": -1}, "`fill_holes` -1 is out of range"),
        ({"fill_holes": True}, "`fill_holes` is True"),
        ({"points_as": "trees"}, "`points_as`: unknown kind trees; use auto, terrain or object"),
        ({"features": [[0, 1]]}, "`features` needs faces"),
        ({"attributes": {"vertex": {"a": [1]}}}, "give a row for each"),
        ({"attributes": {"face": {"a": [1]}}}, "there are 0 faces"),
        ({"n": 3}, "at least 4"),
    ],
)
def test_what_cannot_be_is_refused_with_a_remedy(points, wrong, part):
    with pytest.raises(rtfmesh.InputError) as raised:
        rtfmesh.reconstruct(**{"points": points, "n": 100, **wrong})
    assert part in str(raised.value)


def test_arguments_that_there_are_not(points):
    with pytest.raises(TypeError, match=r"reconstruct\(\) got an unexpected keyword argument 'sead'.*'seed'"):
        rtfmesh.reconstruct(points, 100, sead=1)
    with pytest.raises(TypeError, match=r"remesh\(\) got an unexpected keyword argument 'closed'"):
        rtfmesh.remesh(points, [[0, 1, 2]], 100, closed=True)


def test_a_function_is_told_of_the_surface_too(remesher):
    told = []
    remesher.reconstruct(on_sphere(60_000), 5000, quality="best", progress=told.append)
    assert {"surface", "last level"} <= {progress.phase for progress in told}
    with pytest.raises(rtfmesh.Cancelled):
        remesher.reconstruct(on_sphere(60_000), 500, progress=lambda progress: "cancel")


LONG = """
import signal, numpy as np, rtfmesh
signal.signal(signal.SIGINT, signal.default_int_handler)
points = np.random.default_rng(1).normal(size=(1_000_000, 3))
points /= np.linalg.norm(points, axis=1, keepdims=True)
def told(progress):
    assert progress.phase == "surface"
    print("running", flush=True)
    globals()["told"] = None
try:
    rtfmesh.reconstruct(points, 1000, progress=lambda p: told and told(p))
except KeyboardInterrupt:
    print("stopped")
"""


@pytest.mark.skipif(sys.platform == "win32", reason="Ctrl-C goes to all processes of a console there")
def test_ctrl_c_ends_it_while_the_surface_is_made():
    child = subprocess.Popen([sys.executable, "-c", LONG], stdout=subprocess.PIPE, text=True)
    assert child.stdout.readline() == "running\n"
    child.send_signal(signal.SIGINT)
    assert child.communicate(timeout=60)[0] == "stopped\n"
    assert child.returncode == 0
