"""Data sets of VTK with their arrays, without PyVista."""

import json
import subprocess
import sys

import numpy as np
import pytest

import rtfmesh

pytest.importorskip("vtkmodules")
from vtkmodules.util.numpy_support import numpy_to_vtk, vtk_to_numpy
from vtkmodules.vtkCommonCore import vtkPoints, vtkStringArray
from vtkmodules.vtkCommonDataModel import (
    vtkCellArray,
    vtkImageData,
    vtkMultiBlockDataSet,
    vtkPolyData,
    vtkTable,
    vtkUnstructuredGrid,
)
from vtkmodules.vtkFiltersCore import vtkAppendFilter, vtkPolyDataNormals, vtkStripper, vtkTriangleFilter
from vtkmodules.vtkFiltersSources import (
    vtkCellTypeSource,
    vtkCubeSource,
    vtkCylinderSource,
    vtkPlaneSource,
    vtkSphereSource,
)

from rtfmesh.vtk import poly_data, remesh

TETRA, HEXAHEDRON = 10, 12


def made(step, data=None):
    """The output of a source or a filter."""
    if data is not None:
        step.SetInputData(data)
    step.Update()
    return step.GetOutput()


def ball(resolution=40):
    """A sphere of radius 0.5 with active normals."""
    source = vtkSphereSource()
    source.SetThetaResolution(resolution)
    source.SetPhiResolution(resolution)
    return made(source)


def points(data):
    """The points (V, 3)."""
    return vtk_to_numpy(data.GetPoints().GetData())


def triangles(data):
    """The triangles (F, 3); nothing else is in the surface."""
    assert data.GetNumberOfCells() == data.GetNumberOfPolys() and data.GetPolys().IsHomogeneous() == 3
    return vtk_to_numpy(data.GetPolys().GetConnectivityArray()).reshape(-1, 3)


def centres(data):
    """The centres (F, 3) of the triangles."""
    return points(data)[triangles(data)].mean(axis=1)


def add(data, name, values):
    """Adds an array, which becomes active if it is the first."""
    array = numpy_to_vtk(np.ascontiguousarray(values), deep=True)
    array.SetName(name)
    data.AddArray(array)


def array_of(data, name):
    """The values of an array."""
    assert data.HasArray(name), name
    return vtk_to_numpy(data.GetArray(name))


def words(values, name):
    """An array of strings."""
    array = vtkStringArray()
    array.SetName(name)
    for value in values:
        array.InsertNextValue(value)
    return array


def cloud(at):
    """Points without cells."""
    data, own = vtkPolyData(), vtkPoints()
    own.SetData(numpy_to_vtk(np.ascontiguousarray(at), deep=True))
    data.SetPoints(own)
    return data


def volume(data):
    """What closed triangles enclose."""
    a, b, c = (points(data)[triangles(data)[:, k]] for k in range(3))
    return np.einsum("ij,ij->i", a, np.cross(b, c)).sum() / 6


def test_arrays_of_points_and_cells_come_along_and_the_source_stays(remesher):
    source = ball()
    at, middle = points(source), centres(source)
    add(source.GetPointData(), "height", at[:, 2])
    add(source.GetPointData(), "flow", at)
    source.GetPointData().SetActiveScalars("height")
    source.GetPointData().SetActiveVectors("flow")
    add(source.GetCellData(), "side", (middle[:, 0] > 0).astype(np.int32))
    source.GetCellData().AddArray(words(["up" if z > 0 else "down" for z in middle[:, 2]], "half"))
    source.GetCellData().SetActiveScalars("side")
    source.GetFieldData().AddArray(words(["bracket"], "part"))
    # As readers of parallel files mark cells; on the result they would hide triangles.
    add(source.GetCellData(), "vtkGhostType", np.ones(len(middle), np.uint8))
    before = [at.copy(), triangles(source).copy()]
    even = remesh(source, 500, distances=True, remesher=remesher)
    assert even.IsA("vtkPolyData") and even.GetNumberOfPoints() == 500 and even.GetNumberOfCells() == 996
    at, middle = points(even), centres(even)
    point_data, cell_data = even.GetPointData(), even.GetCellData()
    assert np.abs(array_of(point_data, "height") - at[:, 2]).max() < 0.01
    assert np.abs(array_of(point_data, "flow") - at).max() < 0.01
    assert np.linalg.norm(array_of(point_data, "Normals"), axis=1) == pytest.approx(1, abs=1e-5)
    assert array_of(point_data, "height").dtype == np.float32
    side = array_of(cell_data, "side")
    assert side.dtype == np.int32 and (side == (middle[:, 0] > 0))[np.abs(middle[:, 0]) > 0.05].all()
    half = cell_data.GetAbstractArray("half")
    found = np.array([half.GetValue(k) for k in range(996)])
    assert ((found == "up") == (middle[:, 2] > 0))[np.abs(middle[:, 2]) > 0.05].all()
    assert not cell_data.HasArray("vtkGhostType")
    assert point_data.GetScalars().GetName() == "height" and point_data.GetVectors().GetName() == "flow"
    assert point_data.GetNormals().GetName() == "Normals" and cell_data.GetScalars().GetName() == "side"
    assert even.GetFieldData().GetAbstractArray("part").GetValue(0) == "bracket"
    report = json.loads(even.GetFieldData().GetAbstractArray("rtfmesh").GetValue(0))
    assert report["output"]["vertices"] == 500 and report["output"]["distances"]["rms"] > 0
    assert np.array_equal(points(source), before[0]) and np.array_equal(triangles(source), before[1])
    assert not source.GetFieldData().HasArray("rtfmesh")
    bare = remesh(even, 200, attributes=False, remesher=remesher)
    assert bare.GetPointData().GetNumberOfArrays() == bare.GetCellData().GetNumberOfArrays() == 0
    report = json.loads(bare.GetFieldData().GetAbstractArray("rtfmesh").GetValue(0))
    assert report["output"]["vertices"] == 200 and bare.GetFieldData().HasArray("part")


def test_results_and_meshes_become_poly_data(torus, remesher):
    data = poly_data(torus)
    assert np.array_equal(points(data), torus.vertices) and np.array_equal(triangles(data), torus.faces)
    assert data.GetFieldData().GetNumberOfArrays() == 0
    result = remesher.remesh(torus, 300)
    assert np.array_equal(points(poly_data(result)), result.vertices)
    assert np.array_equal(points(remesh(data, "0.3k", remesher=remesher)), result.vertices)
    report = json.loads(poly_data(result).GetFieldData().GetAbstractArray("rtfmesh").GetValue(0))
    assert report["output"] == result.report["output"]


def test_quads_polygons_and_strips_are_triangulated(remesher):
    plane = vtkPlaneSource()
    plane.SetResolution(12, 12)
    plane = made(plane)
    add(plane.GetCellData(), "row", np.repeat(np.arange(12), 12))
    even = remesh(plane, 200, remesher=remesher)
    rows = (12 * (centres(even)[:, 1] + 0.5)).astype(int)
    found = array_of(even.GetCellData(), "row")
    assert (
        even.GetNumberOfPoints() == 200 and np.abs(found - rows).max() <= 1 and set(found) == set(range(12))
    )
    cylinder = vtkCylinderSource()
    cylinder.SetResolution(30)
    cylinder = made(cylinder)
    cylinder.GetPointData().Initialize()
    lids = remesh(cylinder, 400, remesher=remesher)
    report = json.loads(lids.GetFieldData().GetAbstractArray("rtfmesh").GetValue(0))
    assert report["output"]["topology"]["boundary_loops"] == 0 and volume(lids) == pytest.approx(
        0.78, abs=0.01
    )
    stripper = vtkStripper()
    stripper.PassCellDataAsFieldDataOff()
    strips = made(stripper, ball())
    assert strips.GetNumberOfStrips() and not strips.GetNumberOfPolys()
    assert volume(remesh(strips, 300, remesher=remesher)) == pytest.approx(0.52, abs=0.01)


def test_vertices_and_lines_among_the_cells_are_left_out(remesher):
    mixed = made(vtkTriangleFilter(), made(vtkCubeSource()))
    others = vtkCellArray(), vtkCellArray()
    others[0].InsertNextCell(1, [0])
    others[0].InsertNextCell(1, [1])
    others[1].InsertNextCell(2, [0, 1])
    mixed.SetVerts(others[0])
    mixed.SetLines(others[1])
    mixed.GetCellData().Initialize()
    # VTK has cells of vertices first, then lines, then polygons.
    add(mixed.GetCellData(), "kind", np.array([0, 0, 1, *range(10, 22)]))
    mixed.GetPointData().Initialize()
    even = remesh(mixed, 200, remesher=remesher)
    kinds, middle = array_of(even.GetCellData(), "kind"), centres(even)
    assert even.GetNumberOfPoints() == 200 and set(kinds) == set(range(10, 22))
    # Two triangles are a side of the cube, and each side has its own.
    for axis in range(3):
        for sign in (-1, 1):
            own = kinds[np.abs(middle[:, axis] - 0.5 * sign) < 1e-6]
            assert len(own) and set(own) == {own.min(), own.min() + 1} and own.min() % 2 == 0


def test_texture_coordinates_come_along_and_seams_stay_if_they_are_to(remesher):
    u = np.linspace(0, 1, 41)
    grid = np.stack(np.meshgrid(u, u, indexing="ij"), axis=-1).reshape(-1, 2)
    angle = 2 * np.pi * grid[:, 0]
    at = np.column_stack([np.cos(angle), np.sin(angle), 3 * grid[:, 1]])
    corner = np.arange(41 * 41).reshape(41, 41)
    quads = [part.ravel() for part in (corner[:-1, :-1], corner[1:, :-1], corner[1:, 1:], corner[:-1, 1:])]
    tube, cells = cloud(at), vtkCellArray()
    for quad in np.column_stack(quads).tolist():
        cells.InsertNextCell(4, quad)
    tube.SetPolys(cells)
    add(tube.GetPointData(), "chart", grid)
    tube.GetPointData().SetActiveTCoords("chart")
    kept = remesh(tube, 500, keep_uv=True, remesher=remesher)
    assert kept.GetPointData().GetTCoords().GetName() == "chart"
    uv = array_of(kept.GetPointData(), "chart")
    assert kept.GetNumberOfPoints() > 500 and uv.shape == (kept.GetNumberOfPoints(), 2)
    place = np.column_stack([np.cos(2 * np.pi * uv[:, 0]), np.sin(2 * np.pi * uv[:, 0]), 3 * uv[:, 1]])
    assert np.abs(place - points(kept)).max() < 0.05
    assert np.ptp(uv[triangles(kept)][:, :, 0], axis=1).max() < 0.5, "a face crosses the seam"
    with pytest.warns(rtfmesh.MeshWarning, match="keep_uv=True"):
        assert remesh(tube, 500, remesher=remesher).GetNumberOfPoints() == 500
    result = rtfmesh.remesh(tube, 500, keep_uv=True)
    back = poly_data(result)
    assert len(result.vertices) == 500 and back.GetNumberOfPoints() == kept.GetNumberOfPoints()
    assert back.GetPointData().GetTCoords().GetName() == "TCoords"


def test_points_become_a_surface(remesher):
    source = ball(60)
    at = points(source)
    normals = array_of(source.GetPointData(), "Normals")
    for with_vertices in (False, True):
        data = cloud(at)
        add(data.GetPointData(), "height", at[:, 2])
        if with_vertices:
            cells = vtkCellArray()
            for place in range(len(at)):
                cells.InsertNextCell(1, [place])
            data.SetVerts(cells)
        result = remesher.reconstruct(data, 400)
        assert np.abs(np.linalg.norm(result.vertices, axis=1) - 0.5).max() < 0.01
        even = poly_data(result)
        assert even.GetNumberOfPoints() == 400 and volume(even) > 0.45
        assert np.abs(array_of(even.GetPointData(), "height") - points(even)[:, 2]).max() < 0.06
        assert rtfmesh.measure(ball(), against=data)["points"]["from_points"]["rms"] < 1
        # Active normals say which side is outside, whatever their name.
        add(data.GetPointData(), "inwards", -normals)
        data.GetPointData().SetActiveNormals("inwards")
        turned = poly_data(remesher.reconstruct(data, 400))
        assert volume(turned) < -0.45 and not turned.GetPointData().HasArray("inwards")
        with pytest.raises(rtfmesh.InputError, match=r"`poly_data` has points .* use rtfmesh\.reconstruct"):
            remesh(data, 100)
    with pytest.raises(rtfmesh.InputError, match="`points` has faces"):
        rtfmesh.reconstruct(source, 100)


def test_other_data_sets_give_their_surface(remesher):
    source = vtkCellTypeSource()
    source.SetCellType(HEXAHEDRON)
    source.SetBlocksDimensions(5, 5, 5)
    grid = made(source)
    assert grid.IsA("vtkUnstructuredGrid") and grid.GetNumberOfCells() == 125
    grid.GetPointData().Initialize()
    grid.GetCellData().Initialize()
    add(grid.GetCellData(), "layer", np.arange(125) // 25)
    even = remesh(grid, 600, remesher=remesher)
    assert even.GetNumberOfPoints() == 600 and volume(even) == pytest.approx(125)
    assert [even.GetCellData().GetArrayName(k) for k in range(even.GetCellData().GetNumberOfArrays())] == [
        "layer"
    ]
    assert even.GetPointData().GetNumberOfArrays() == 0
    layer, middle = array_of(even.GetCellData(), "layer"), centres(even)
    assert (layer == np.clip(middle[:, 2].astype(int), 0, 4))[np.abs(middle[:, 2] % 1 - 0.5) < 0.2].all()
    # Triangles in an unstructured grid, and several blocks.
    loose = made(vtkAppendFilter(), ball())
    assert loose.IsA("vtkUnstructuredGrid") and len(rtfmesh.remesh(loose, 300).vertices) == 300
    cube = vtkCubeSource()
    cube.SetCenter(3, 0, 0)
    blocks = vtkMultiBlockDataSet()
    blocks.SetBlock(0, ball())
    blocks.SetBlock(1, made(cube))
    assert rtfmesh.measure(blocks)["topology"]["components"] == 2
    assert remesh(blocks, 500, remesher=remesher).GetNumberOfPoints() == 500


def test_what_has_no_surface_is_refused_with_a_remedy():
    image = vtkImageData()
    image.SetDimensions(3, 3, 3)
    for call, name in ((rtfmesh.remesh, "vertices"), (remesh, "poly_data")):
        with pytest.raises(rtfmesh.InputError, match=rf"`{name}` is a vtkImageData, .* rtfmesh\.contour"):
            call(image, 100)
        with pytest.raises(rtfmesh.InputError, match=rf"`{name}` is a vtkSphereSource; .* GetOutput\(\)"):
            call(vtkSphereSource(), 100)
        with pytest.raises(rtfmesh.InputError, match=rf"`{name}` is a vtkTable, .* give a vtkPolyData"):
            call(vtkTable(), 100)
        for empty in (vtkPolyData(), vtkUnstructuredGrid()):
            with pytest.raises(rtfmesh.InputError, match="`vertices` is empty"):
                call(empty, 100)
    alone = vtkUnstructuredGrid()
    alone.SetPoints(ball().GetPoints())
    with pytest.raises(rtfmesh.InputError, match=r"`poly_data` has points .* use rtfmesh\.reconstruct"):
        remesh(alone, 100)
    with pytest.raises(rtfmesh.InputError, match="`against` is a vtkTable"):
        rtfmesh.measure(ball(), against=vtkTable())
    with pytest.raises(rtfmesh.InputError, match="`poly_data` is a int"):
        remesh(5, 100)
    with pytest.raises(rtfmesh.InputError, match=r"`mesh` is a .*; give an rtfmesh\.Mesh"):
        poly_data(ball())
    source = ball(8)
    points(source)[5] = np.nan
    with pytest.raises(rtfmesh.InputError, match="row 5"):
        remesh(source, 100)


def test_results_take_part_in_pipelines(remesher):
    normals = vtkPolyDataNormals()
    even = remesh(ball(), 300, remesher=remesher)
    again = made(normals, even)
    assert again.GetNumberOfPoints() == 300 and array_of(again.GetPointData(), "Normals").shape == (300, 3)
    mask = rtfmesh.Result(*rtfmesh.remesh(even, 200), {}, None, None, rtfmesh.Attributes())
    mask.attributes.vertex["inside"] = mask.vertices[:, 0] > 0
    mask.attributes.face["tensor"] = np.arange(9.0 * len(mask.faces)).reshape(-1, 3, 3)
    data = poly_data(mask)
    assert array_of(data.GetPointData(), "inside").dtype == np.uint8
    assert array_of(data.GetCellData(), "tensor").shape == (len(mask.faces), 9)


def test_surfaces_of_pyvista_stay_pyvistas(monkeypatch):
    pyvista = pytest.importorskip("pyvista")
    monkeypatch.setattr("rtfmesh.vtk.shape_of", None)
    assert len(rtfmesh.remesh(pyvista.Sphere(), 100).vertices) == 100
    with pytest.raises(TypeError):
        rtfmesh.remesh(ball(), 100)


def test_pyvista_is_not_imported():
    text = """
import sys, rtfmesh
from vtkmodules.vtkFiltersSources import vtkSphereSource
source = vtkSphereSource()
source.Update()
print(rtfmesh.vtk.remesh(source.GetOutput(), 100).GetNumberOfPoints(), "pyvista" in sys.modules)
"""
    done = subprocess.run([sys.executable, "-c", text], capture_output=True, text=True, timeout=60)
    assert done.stdout.split() == ["100", "False"], done.stderr
