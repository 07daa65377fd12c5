"""Remeshing for the data sets of VTK, without PyVista.

from vtkmodules.vtkIOXML import vtkXMLPolyDataReader
from rtfmesh.vtk import remesh

reader = vtkXMLPolyDataReader()
reader.SetFileName("scan.vtp")
reader.Update()
even = remesh(reader.GetOutput(), 10_000)
"""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray
from vtkmodules.util.numpy_support import numpy_to_vtk, numpy_to_vtkIdTypeArray, vtk_to_numpy
from vtkmodules.vtkCommonCore import vtkDataArray, vtkPoints, vtkStringArray
from vtkmodules.vtkCommonDataModel import (
    vtkCellArray,
    vtkCompositeDataSet,
    vtkDataObject,
    vtkDataSet,
    vtkDataSetAttributes,
    vtkFieldData,
    vtkImageData,
    vtkPointSet,
    vtkPolyData,
)
from vtkmodules.vtkCommonExecutionModel import vtkAlgorithm
from vtkmodules.vtkFiltersCore import vtkTriangleFilter
from vtkmodules.vtkFiltersGeometry import vtkCompositeDataGeometryFilter, vtkDataSetSurfaceFilter

from ._attributes import Attributes, brings_own
from ._errors import InputError
from ._files import Mesh
from ._objects import Shape
from ._progress import Callback
from ._remesher import Remesher, Told, on_device, warned
from ._result import Result
from ._seams import Split, split_at_seams
from ._words import keywords

if TYPE_CHECKING:
    from typing_extensions import Unpack

    from ._options import Options

# Marks cells and points that others compute or that are not shown; on a new surface it would hide triangles.
GHOSTS = "vtkGhostType"
# The kinds of active arrays that a result keeps, as far as it has the arrays.
ACTIVE = (
    vtkDataSetAttributes.SCALARS,
    vtkDataSetAttributes.VECTORS,
    vtkDataSetAttributes.NORMALS,
    vtkDataSetAttributes.TENSORS,
)


def output_of(step: Any, data: Any) -> Any:
    """What a filter makes of a data set."""
    step.SetInputDataObject(data)
    step.Update()
    return step.GetOutput()


def surface_in(data: Any, name: str) -> vtkPolyData:
    """The surface of a data set, or of all blocks of a composite one."""
    if isinstance(data, vtkAlgorithm):
        raise InputError(f"`{name}` is a {data.GetClassName()}; call its Update() and give its GetOutput()")
    if isinstance(data, vtkImageData):
        remedy = "rtfmesh.contour takes its values as an array, and vtkGeometryFilter gives its border"
        raise InputError(f"`{name}` is a {data.GetClassName()}, which is a volume and no surface; {remedy}")
    if isinstance(data, vtkPolyData):
        return data
    if isinstance(data, vtkDataSet):
        return output_of(vtkDataSetSurfaceFilter(), data)
    if isinstance(data, vtkCompositeDataSet):
        return output_of(vtkCompositeDataGeometryFilter(), data)
    what = data.GetClassName() if isinstance(data, vtkDataObject) else type(data).__name__
    raise InputError(
        f"`{name}` is a {what}, which has no surface; give a vtkPolyData, or another vtkDataSet with one"
    )


def triangles_of(surface: vtkPolyData) -> tuple[NDArray[Any], NDArray[Any]]:
    """The triangles (F, 3) of a surface, and for each the number of the cell that it is a part of (F,).

    Polygons and strips are split; vertices and lines that are cells of their own are left out.
    """
    polygons, strips = surface.GetPolys(), surface.GetStrips()
    # Vertices and lines come first.
    others = surface.GetNumberOfVerts() + surface.GetNumberOfLines()
    if strips.GetNumberOfCells() or (polygons.GetNumberOfCells() and polygons.IsHomogeneous() != 3):
        # With vertices among the cells vtkTriangleFilter confuses the data of cells.
        bare, step = vtkPolyData(), vtkTriangleFilter()
        bare.SetPoints(surface.GetPoints())
        bare.SetPolys(polygons)
        bare.SetStrips(strips)
        add_array(bare.GetCellData(), "cell", np.arange(bare.GetNumberOfCells()))
        split = output_of(step, bare)
        polygons, cells = split.GetPolys(), vtk_to_numpy(split.GetCellData().GetArray("cell"))
    else:
        cells = np.arange(polygons.GetNumberOfCells())
    return vtk_to_numpy(polygons.GetConnectivityArray()).reshape(-1, 3), others + cells


def points_of(data: vtkPointSet) -> NDArray[Any]:
    """The points (V, 3) of a data set, which may have none."""
    points = data.GetPoints()
    return np.empty((0, 3)) if points is None else vtk_to_numpy(points.GetData())


def arrays_in(data: vtkFieldData) -> dict[str, NDArray[Any]]:
    """The arrays of numbers or strings by name, with a row for each point or cell."""
    found = {}
    for place in range(data.GetNumberOfArrays()):
        array = data.GetAbstractArray(place)
        name = array.GetName() or f"array {place}"
        if name == GHOSTS:
            continue
        if isinstance(array, vtkStringArray):
            words = np.array([array.GetValue(k) for k in range(array.GetNumberOfValues())], dtype=str)
            width = array.GetNumberOfComponents()
            found[name] = words.reshape(-1, width) if width > 1 else words
        elif isinstance(array, vtkDataArray):
            found[name] = vtk_to_numpy(array)
    return found


def texture_name(surface: vtkPolyData) -> str:
    """The name of active texture coordinates; empty if there are none with two numbers for each point."""
    active = surface.GetPointData().GetTCoords()
    return active.GetName() or "" if active is not None and active.GetNumberOfComponents() == 2 else ""


def attributes_of(surface: vtkPolyData, faces: NDArray[Any], cells: NDArray[Any]) -> Attributes:
    """The arrays of a surface for the triangles of these cells; texture coordinates at corners."""
    vertex = arrays_in(surface.GetPointData())
    uv = vertex.pop(texture_name(surface), None)
    face = {name: array[cells] for name, array in arrays_in(surface.GetCellData()).items()}
    return Attributes(vertex, face, None if uv is None else uv[faces])


def of_points(data: vtkPointSet) -> Shape:
    """The parts of points without faces; active normals are called so, whatever their name."""
    vertex = arrays_in(data.GetPointData())
    active = data.GetPointData().GetNormals()
    if active is not None and active.GetName() in vertex:
        vertex = {"Normals": vertex.pop(active.GetName()), **vertex}
    return Shape(points_of(data), np.empty((0, 3), np.uint32), Attributes(vertex))


def shape_of(data: Any, name: str) -> Shape:
    """The parts of a surface, of points, or of the surface of any other data set."""
    if isinstance(data, vtkPointSet) and data.GetNumberOfCells() == 0:
        return of_points(data)
    surface = surface_in(data, name)
    if surface.GetNumberOfCells() == surface.GetNumberOfVerts():
        return of_points(surface)
    faces, cells = triangles_of(surface)
    return Shape(points_of(surface), faces, attributes_of(surface, faces, cells))


def add_array(data: vtkFieldData, name: str, values: NDArray[Any]) -> None:
    """Adds an array with a row for each point or cell."""
    flat = values.reshape(len(values), int(np.prod(values.shape[1:], dtype=int)))
    if flat.dtype.kind in "USO":
        array = vtkStringArray()
        array.SetNumberOfComponents(flat.shape[1])
        for word in flat.ravel():
            array.InsertNextValue(str(word))
    else:
        if flat.dtype.kind == "b":
            flat = flat.astype(np.uint8)
        elif flat.dtype.kind == "f" and flat.dtype not in (np.float32, np.float64):
            flat = flat.astype(np.float64)
        array = numpy_to_vtk(np.ascontiguousarray(flat), deep=True)
    array.SetName(name)
    data.AddArray(array)


def surface_of(mesh: Mesh | Result, split: Split, uv_name: str) -> vtkPolyData:
    """A mesh with its arrays."""
    made, points, triangles = vtkPolyData(), vtkPoints(), vtkCellArray()
    vertices = np.ascontiguousarray(mesh.vertices[split.vertices])
    points.SetData(numpy_to_vtk(vertices, deep=True))
    corners = np.ascontiguousarray(split.faces, dtype=np.int64).ravel()
    triangles.SetData(3, numpy_to_vtkIdTypeArray(corners, deep=True))
    made.SetPoints(points)
    made.SetPolys(triangles)
    for name, array in mesh.attributes.vertex.items():
        add_array(made.GetPointData(), name, array[split.vertices])
    for name, array in mesh.attributes.face.items():
        add_array(made.GetCellData(), name, array)
    if split.uv is not None:
        add_array(made.GetPointData(), uv_name, split.uv)
        made.GetPointData().SetActiveTCoords(uv_name)
    return made


def keep_active(made: vtkDataSetAttributes, source: vtkDataSetAttributes) -> None:
    """Makes the arrays active that are active in the source, where they are there."""
    for kind in ACTIVE:
        active = source.GetAbstractAttribute(kind)
        if active is not None and active.GetName() and made.HasArray(active.GetName()):
            made.SetActiveAttribute(active.GetName(), kind)


def poly_data(mesh: Mesh | Result) -> vtkPolyData:
    """A mesh or result of rtfmesh as a new `vtkPolyData` with its attributes.

    Attributes of the V vertices and F faces become point data and cell data; booleans become `unsigned char`,
    strings a `vtkStringArray`. Texture coordinates become the active ones, "TCoords", and vertices on seams
    are there once for each side, beyond V. A `Result` also gives its report, as `remesh` does.

    Raises `InputError` if `mesh` is neither an `rtfmesh.Mesh` nor an `rtfmesh.Result`.
    """
    if not isinstance(mesh, (Mesh, Result)):
        raise InputError(f"`mesh` is a {type(mesh).__name__}; give an rtfmesh.Mesh or rtfmesh.Result")
    made = surface_of(mesh, split_at_seams(mesh, True), "TCoords")
    if isinstance(mesh, Result):
        add_report(made, mesh)
    return made


def add_report(made: vtkPolyData, result: Result) -> None:
    """Adds the report as JSON to the field data."""
    made.GetFieldData().RemoveArray("rtfmesh")
    add_array(made.GetFieldData(), "rtfmesh", np.array([json.dumps(result.report)]))


@keywords
def remesh(
    poly_data: vtkPolyData | vtkDataSet | vtkCompositeDataSet,
    n: int | str | None = None,
    *,
    attributes: bool = True,
    distances: bool = False,
    progress: bool | Callback = False,
    device: str | int | None = None,
    device_memory: int | None = None,
    remesher: Remesher | None = None,
    **options: Unpack[Options],
) -> vtkPolyData:
    """A new surface of exactly `n` points with well-shaped triangles; `poly_data` stays as it is.

    Polygons and strips are triangulated on the way; vertices and lines among the cells are left out. Any
    other `vtkDataSet` but an image, such as a `vtkUnstructuredGrid`, and composite data sets give their
    surface. Point data and cell data come along as `rtfmesh.Attributes` says, active texture coordinates and
    field data too; scalars, vectors, normals and tensors stay active. `attributes=False` leaves point data
    and cell data behind. With `keep_uv=True` points on texture seams are there once for each side, beyond
    `n`. The report is JSON in the field data, a `vtkStringArray` named "rtfmesh". `remesher` is a
    `rtfmesh.Remesher` to use; all other arguments and what is raised are as in `rtfmesh.remesh`.
    """
    has_no_cells = isinstance(poly_data, vtkPointSet) and poly_data.GetNumberOfCells() == 0
    surface = vtkPolyData() if has_no_cells else surface_in(poly_data, "poly_data")
    points = poly_data if has_no_cells else surface
    if points.GetNumberOfPoints() and surface.GetNumberOfCells() == surface.GetNumberOfVerts():
        raise InputError("`poly_data` has points and no faces; use rtfmesh.reconstruct")
    faces, cells = triangles_of(surface)
    told = Told(correspondence=False, distances=distances, progress=progress)
    given = attributes_of(surface, faces, cells) if brings_own(attributes) else Attributes()
    wanted = dict(options)

    def run(remesher: Remesher) -> Result:
        return remesher._run(points_of(surface), faces, n, given, told, wanted)

    result = warned(on_device(remesher, device, device_memory, told, run))
    made = surface_of(result, split_at_seams(result, bool(options.get("keep_uv"))), texture_name(surface))
    for own, source in (
        (made.GetPointData(), surface.GetPointData()),
        (made.GetCellData(), surface.GetCellData()),
    ):
        keep_active(own, source)
    made.GetFieldData().DeepCopy(poly_data.GetFieldData())
    add_report(made, result)
    return made
