"""Whole meshes in place of arrays, of this package and of others."""

import subprocess
import sys
from types import SimpleNamespace

import numpy as np
import pytest
from conftest import same

import rtfmesh


def of_trimesh(mesh):
    trimesh = pytest.importorskip("trimesh")
    return trimesh.Trimesh(mesh.vertices, mesh.faces, process=False)


def of_pyvista(mesh):
    pyvista = pytest.importorskip("pyvista")
    return pyvista.PolyData.from_regular_faces(mesh.vertices, mesh.faces.astype(int))


def of_meshio(mesh):
    meshio = pytest.importorskip("meshio")
    return meshio.Mesh(mesh.vertices, [("triangle", mesh.faces.astype(int))])


def of_vtk(mesh):
    return pytest.importorskip("rtfmesh.vtk").poly_data(mesh)


def of_open3d(mesh):
    """Looks as one, since Open3D is large."""
    return SimpleNamespace(vertices=mesh.vertices, triangles=mesh.faces.astype(np.int32))


def of_scene(mesh):
    trimesh = pytest.importorskip("trimesh")
    return trimesh.Scene([of_trimesh(mesh)])


KINDS = {
    "mesh": lambda mesh: mesh,
    "pair": lambda mesh: (mesh.vertices, mesh.faces),
    "trimesh": of_trimesh,
    "scene": of_scene,
    "pyvista": of_pyvista,
    "meshio": of_meshio,
    "vtk": of_vtk,
    "open3d": of_open3d,
}


@pytest.mark.parametrize("make", KINDS.values(), ids=KINDS)
def test_all_functions_take_whole_meshes(torus, remesher, tmp_path, make):
    mesh = make(torus)
    arrays = torus.vertices, torus.faces
    expected = remesher.remesh(*arrays, 300)
    for result in (
        rtfmesh.remesh(mesh, 300),
        rtfmesh.remesh(mesh, "0.3k"),
        rtfmesh.remesh(mesh, n=300),
        remesher.remesh(mesh, 300),
    ):
        assert isinstance(result, rtfmesh.Result) and same(result, expected)
    assert rtfmesh.measure(mesh) == rtfmesh.measure(*arrays)
    assert rtfmesh.measure(expected, against=mesh) == rtfmesh.measure(*expected, against=arrays)
    assert rtfmesh.inspect(mesh, "1k") == rtfmesh.inspect(*arrays, 1000)
    picture = rtfmesh.render(torus, size=(80, 60))
    assert np.array_equal(rtfmesh.render(mesh, size=(80, 60)), picture)
    assert rtfmesh.render([mesh, mesh], size=(80, 60)).shape == (60, 160, 4)
    rtfmesh.write(tmp_path / "a.ply", mesh)
    rtfmesh.write(tmp_path / "b.ply", *arrays)
    assert (tmp_path / "a.ply").read_bytes() == (tmp_path / "b.ply").read_bytes()


def test_results_and_meshes_unpack(torus, remesher):
    result = remesher.remesh(torus, 300)
    vertices, faces = result
    assert vertices is result.vertices and faces is result.faces
    vertices, faces = torus
    assert vertices is torus.vertices and faces is torus.faces
    assert len(remesher.remesh(result, 200).vertices) == 200


def test_attributes_of_an_object_come_along_unless_others_are_given(torus, remesher, tmp_path):
    heights = torus.vertices[:, 2].copy()
    mesh = rtfmesh.Mesh(torus.vertices, torus.faces, rtfmesh.Attributes({"height": heights}))
    result = remesher.remesh(mesh, 300)
    assert np.allclose(result.attributes.vertex["height"], result.vertices[:, 2], atol=0.05)
    assert remesher.remesh(mesh, 300, attributes=False).attributes.vertex == {}
    other = remesher.remesh(mesh, 300, attributes={"vertex": {"twice": 2 * heights}})
    assert list(other.attributes.vertex) == ["twice"]
    rtfmesh.write(tmp_path / "a.ply", result)
    back = rtfmesh.read(tmp_path / "a.ply").attributes.vertex
    assert np.array_equal(back["height"], result.attributes.vertex["height"])


def test_points_come_with_their_normals(sphere, tmp_path, remesher):
    rng = np.random.default_rng(1)
    points = rng.normal(size=(3000, 3))
    points /= np.linalg.norm(points, axis=1)[:, None]
    np.savetxt(tmp_path / "a.xyz", np.hstack([points, points]))
    cloud = rtfmesh.read(tmp_path / "a.xyz", points=True)
    assert len(cloud.faces) == 0 and list(cloud.attributes.vertex) == ["normal"]
    expected = remesher.reconstruct(cloud.vertices, 300, normals=cloud.attributes.vertex["normal"])
    assert same(remesher.reconstruct(cloud, 300), expected)
    assert same(rtfmesh.reconstruct(cloud, 300), expected)
    like_open3d = SimpleNamespace(points=points)
    assert len(rtfmesh.reconstruct(like_open3d, 300).vertices) == 300
    assert rtfmesh.measure(expected, against=like_open3d)["points"]
    with pytest.raises(rtfmesh.InputError, match="`points` has faces"):
        rtfmesh.reconstruct(sphere, 300)
    with pytest.raises(rtfmesh.InputError, match="`faces` is empty"):
        rtfmesh.remesh(cloud, 300)
    with pytest.raises(rtfmesh.InputError, match=r"`faces` is missing; .* rtfmesh\.reconstruct"):
        rtfmesh.remesh(points, 300)
    with pytest.raises(rtfmesh.InputError, match="`faces` is given with a whole mesh"):
        rtfmesh.remesh(sphere, sphere.faces, 300)


def test_other_data_sets_of_pyvista_have_surfaces(remesher):
    pyvista = pytest.importorskip("pyvista")
    grid = pyvista.ImageData(dimensions=(6, 6, 6)).cast_to_unstructured_grid()
    grid.cell_data["layer"] = (grid.cell_centers().points[:, 2] > 2.5).astype(np.int32)
    result = remesher.remesh(grid, 600)
    assert set(result.attributes.face) == {"layer"} and result.attributes.vertex == {}
    assert len(remesher.remesh(pyvista.Sphere().separate_cells(), 600).vertices) == 600
    blocks = pyvista.MultiBlock([pyvista.Sphere(), pyvista.Cube(center=(3, 0, 0))])
    assert rtfmesh.measure(blocks)["topology"]["components"] == 2


def test_modules_for_other_packages_need_no_import_of_their_own():
    text = """
import sys, rtfmesh
assert {"trimesh", "pyvista", "meshio", "ray", "vtk"} <= set(dir(rtfmesh))
assert not {"trimesh", "pyvista", "meshio", "ray", "vtk", "vtkmodules"} & set(sys.modules)
print(rtfmesh.trimesh.remesh.__module__, rtfmesh.meshio.remesh.__module__)
try:
    rtfmesh.nothing
except AttributeError as error:
    print(error)
"""
    pytest.importorskip("trimesh"), pytest.importorskip("meshio")
    done = subprocess.run([sys.executable, "-c", text], capture_output=True, text=True, timeout=60)
    assert done.stdout.splitlines() == [
        "rtfmesh.trimesh rtfmesh.meshio",
        "module 'rtfmesh' has no attribute 'nothing'",
    ], done.stderr


def test_runs_say_what_they_were_in_the_mesh_that_they_make(torus, remesher):
    pyvista, trimesh = pytest.importorskip("pyvista"), pytest.importorskip("trimesh")
    meshio = pytest.importorskip("meshio")
    wanted = {"distances": True, "device": "cpu", "device_memory": 4096}
    poly, tri, other = of_pyvista(torus), of_trimesh(torus), of_meshio(torus)
    poly["height"], tri.vertex_attributes["height"] = [torus.vertices[:, 2].copy() for _ in "ab"]
    other.point_data["height"] = torus.vertices[:, 2].copy()
    made = [
        poly.rtfmesh.remesh(300, **wanted),
        rtfmesh.trimesh.remesh(tri, 300, **wanted),
        rtfmesh.meshio.remesh(other, 300, **wanted),
    ]
    reports = [made[0].user_dict["rtfmesh"], made[1].metadata["rtfmesh"], made[2].info["rtfmesh"]]
    for report in reports:
        assert report["output"]["vertices"] == 300 and report["output"]["distances"]["rms"] > 0
    assert "height" in made[0].point_data and "height" in made[1].vertex_attributes
    assert "height" in made[2].point_data
    bare = [
        poly.rtfmesh.remesh(300, attributes=False, remesher=remesher).point_data,
        rtfmesh.trimesh.remesh(tri, 300, attributes=False, remesher=remesher).vertex_attributes,
        rtfmesh.meshio.remesh(other, 300, attributes=False, remesher=remesher).point_data,
    ]
    assert [len(arrays) for arrays in bare] == [0, 0, 0]
    assert isinstance(made[0], pyvista.PolyData) and isinstance(made[1], trimesh.Trimesh)
    assert isinstance(made[2], meshio.Mesh)
    with pytest.raises(rtfmesh.InputError, match="`device` and `remesher` exclude each other"):
        poly.rtfmesh.remesh(300, device="cpu", remesher=remesher)
    with pytest.raises(rtfmesh.InputError, match="`remesher` is 5"):
        poly.rtfmesh.remesh(300, remesher=5)


def test_active_vectors_and_normals_stay_active(remesher):
    pyvista = pytest.importorskip("pyvista")
    ball = pyvista.Sphere()
    ball["flow"] = ball.points.copy()
    ball.set_active_vectors("flow")
    ball.point_data.active_normals_name = "Normals"
    even = ball.rtfmesh.remesh(500, remesher=remesher)
    assert even.active_vectors_name == "flow" and even.point_data.active_normals_name == "Normals"


def test_any_data_set_of_pyvista_has_the_accessor(remesher):
    pyvista = pytest.importorskip("pyvista")
    image = pyvista.ImageData(dimensions=(6, 6, 6))
    for mesh in (
        image.cast_to_unstructured_grid(),
        image.cast_to_structured_grid(),
        image.cast_to_rectilinear_grid(),
        image.cast_to_structured_grid().cast_to_explicit_structured_grid(),
        pyvista.MultiBlock([pyvista.Cube(), pyvista.Cube(center=(3, 0, 0))]),
    ):
        even = mesh.rtfmesh.remesh(400, remesher=remesher)
        assert even.n_points == 400 and even.is_manifold
        assert not [name for name in even.array_names if name.startswith("vtkOriginal")]
        assert mesh.rtfmesh.measure()["topology"]["boundary_loops"] == 0
        assert mesh.rtfmesh.inspect("1k")["curves"]


def test_scenes_and_sets_of_cells_come_along(torus, remesher):
    trimesh, meshio = pytest.importorskip("trimesh"), pytest.importorskip("meshio")
    scene = trimesh.Scene([of_trimesh(torus), trimesh.creation.box().apply_translation([9, 0, 0])])
    even = rtfmesh.trimesh.remesh(scene, 600, remesher=remesher)
    assert len(even.vertices) == 600 and even.body_count == 2
    right = np.flatnonzero(torus.vertices[torus.faces].mean(axis=1)[:, 0] > 0)
    cells = [("triangle", torus.faces.astype(int)), ("line", [[0, 1]])]
    mesh = meshio.Mesh(torus.vertices, cells, cell_sets={"right": [right, []]})
    even = rtfmesh.meshio.remesh(mesh, 600, remesher=remesher)
    (found,) = even.cell_sets["right"]
    middle = even.points[even.cells[0].data].mean(axis=1)[:, 0]
    is_in = np.isin(np.arange(len(middle)), found)
    far = np.abs(middle) > 0.1
    assert (is_in == (middle > 0))[far].all() and set(even.cell_data) == set()


def test_report_is_no_argument_any_more(torus, remesher):
    for wrong in (True, "x.json"):
        with pytest.raises(rtfmesh.InputError, match=r"`report` is not an argument.* distances=True"):
            remesher.remesh(torus, 300, report=wrong)


def test_remeshers_may_be_used_as_contexts(torus):
    with rtfmesh.Remesher() as remesher:
        assert len(remesher.remesh(torus, 300).vertices) == 300
