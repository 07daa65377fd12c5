"""`mesh.rtfmesh` for the surfaces of PyVista 0.48 or later, which finds this module by itself.

import pyvista as pv

mesh = pv.read("scan.ply")
even = mesh.rtfmesh.remesh(10_000)
"""

from __future__ import annotations

import warnings
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np
import pyvista
from numpy.typing import ArrayLike, NDArray

from ._attributes import Attributes, brings_own
from ._errors import InputError, MeshWarning
from ._figures import inspect, measure
from ._grid_values import GridValues, grid_values
from ._objects import MeshLike, Shape
from ._progress import Callback
from ._remesher import Remesher, Told, on_device, warned
from ._result import Result
from ._seams import Split, split_at_seams
from ._volume import Grid, grid_of, volume_of
from ._words import keywords, keywords_of

if TYPE_CHECKING:
    from typing_extensions import Unpack

    from ._options import Options


def triangles_of(mesh: pyvista.PolyData) -> tuple[pyvista.PolyData, NDArray[Any]]:
    """The mesh in triangles, and their vertices (F, 3).

    Polygons and strips are split; vertices and lines that are cells of their own are left out.
    """
    others = mesh.n_verts + mesh.n_lines
    if others:
        whole, strips = mesh, mesh.strips if mesh.n_strips else None
        mesh = pyvista.PolyData(whole.points, faces=whole.faces, strips=strips)
        mesh.point_data.update(whole.point_data)
        # Vertices come first, then lines, polygons and strips.
        mesh.cell_data.update({name: whole.cell_data[name][others:] for name in whole.cell_data})
    if mesh.n_strips or not mesh.is_all_triangles:
        mesh = mesh.triangulate()
    return mesh, np.asarray(mesh.faces).reshape(-1, 4)[:, 1:]


def shape_of(mesh: Any, name: str) -> Shape:
    """The parts of a surface, of points, or of the surface of any other data set."""
    if isinstance(mesh, pyvista.MultiBlock):
        mesh = mesh.combine()
    if isinstance(mesh, pyvista.PointSet) or (isinstance(mesh, pyvista.PolyData) and is_of_points(mesh)):
        return Shape(np.asarray(mesh.points), np.empty((0, 3), np.uint32), attributes_of(mesh, None))
    if not isinstance(mesh, pyvista.DataSet):
        raise InputError(f"`{name}` is a {type(mesh).__name__}, not a surface")
    mesh, faces = triangles_of(surface_in(mesh))
    return Shape(np.asarray(mesh.points), faces, attributes_of(mesh, faces))


def surface_in(mesh: pyvista.DataSet) -> pyvista.PolyData:
    """The surface of a data set, without arrays that its making adds."""
    if isinstance(mesh, pyvista.PolyData):
        return mesh
    made = mesh.extract_surface(pass_pointid=False, pass_cellid=False, algorithm="dataset_surface")
    for name in ("vtkOriginalPointIds", "vtkOriginalCellIds"):
        for data in (made.point_data, made.cell_data):
            if name in data:
                del data[name]
    return made


def attributes_of(mesh: pyvista.PolyData | pyvista.PointSet, faces: NDArray[Any] | None) -> Attributes:
    """The arrays of a mesh in triangles; texture coordinates at corners."""
    uv = mesh.active_texture_coordinates if faces is not None else None
    uv_name = None if uv is None else mesh.point_data.active_texture_coordinates_name
    vertex = {name: np.asarray(mesh.point_data[name]) for name in mesh.point_data if name != uv_name}
    face = {} if faces is None else {name: np.asarray(mesh.cell_data[name]) for name in mesh.cell_data}
    return Attributes(vertex, face, None if uv is None else np.asarray(uv)[faces])


def is_of_points(mesh: pyvista.PolyData) -> bool:
    """Whether there is nothing in a mesh but points."""
    return bool(mesh.n_cells == mesh.n_verts)


def surface_of(result: Result, split: Split, source: pyvista.DataSet) -> pyvista.PolyData:
    """A result with its arrays and its report, and with what `source` has for all."""
    made = pyvista.PolyData.from_regular_faces(result.vertices[split.vertices], split.faces.astype(np.int64))
    for name, array in result.attributes.vertex.items():
        made.point_data[name] = array[split.vertices]
    for name, array in result.attributes.face.items():
        made.cell_data[name] = array
    for name in source.field_data:
        made.field_data[name] = source.field_data[name]
    for data, own in ((made.point_data, source.point_data), (made.cell_data, source.cell_data)):
        for kind in ("active_vectors_name", "active_normals_name"):
            if getattr(own, kind) in data:
                setattr(data, kind, getattr(own, kind))
    made.user_dict["rtfmesh"] = result.report
    active = source.active_scalars_info
    if active.name in (*made.point_data, *made.cell_data):
        made.set_active_scalars(active.name, preference=active.association.name.lower())
    return made


@keywords
def reconstruct(
    points: pyvista.PolyData | pyvista.PointSet,
    n: int | str | None,
    *,
    normals: ArrayLike | None = None,
    closed: bool = False,
    points_as: str = "auto",
    attributes: bool = True,
    distances: bool = False,
    progress: bool | Callback = False,
    device: str | int | None = None,
    device_memory: int | None = None,
    remesher: Remesher | None = None,
    **options: Unpack[Options],
) -> pyvista.PolyData:
    """See `PointsAccessor.reconstruct`."""
    active = points.point_data.active_normals
    own = None if active is None else points.point_data.active_normals_name
    data = points.point_data if brings_own(attributes) else {}
    vertex = {name: np.asarray(data[name]) for name in data if name != own}
    told = Told(correspondence=False, distances=distances, progress=progress)
    known = (active if normals is None else normals, closed, points_as)
    wanted = dict(options)

    def run(remesher: Remesher) -> Result:
        return remesher._reconstruct(points.points, n, known, Attributes(vertex), told, wanted)

    result = warned(on_device(remesher, device, device_memory, told, run), stacklevel=5)
    return surface_of(result, split_at_seams(result, False), points)


class WithoutFaces:
    """What is no surface yet: it lacks the methods of surfaces, and says which one makes a surface."""

    _maker: ClassVar[str]

    def __getattr__(self, name: str) -> Any:
        hint = f"; call {self._maker} first, which makes a surface" if hasattr(Accessor, name) else ""
        raise AttributeError(f"{type(self).__name__!r} object has no attribute {name!r}{hint}")


@pyvista.register_dataset_accessor("rtfmesh", pyvista.PointSet)
class PointsAccessor(WithoutFaces):
    """Makes surfaces of points, which stay as they are."""

    _maker = "`.rtfmesh.reconstruct(n)`"

    def __init__(self, points: pyvista.PointSet) -> None:
        self._points = points

    @keywords_of(reconstruct, "points")
    def reconstruct(self, n: int | str | None = None, **wanted: Any) -> pyvista.PolyData:
        """A surface of exactly `n` points, in well-shaped triangles, through these.

        Active normals are taken for outward ones, unless others are given as `normals`. The other arrays come
        along by the nearest point unless `attributes=False`, field data too. `closed`, `points_as` and all
        other arguments, and what is raised, are as in `rtfmesh.reconstruct`; `remesher` is a
        `rtfmesh.Remesher` to use.
        """
        return reconstruct(self._points, n, **wanted)


def nodes_of(image: pyvista.ImageData, is_of_points: bool) -> tuple[NDArray[Any], NDArray[np.float64]]:
    """How many values there are along each axis, and the matrix from their indices to their places.

    Values of cells are at the centres of these.
    """
    begin = np.eye(4)
    begin[:3, 3] = np.asarray(image.offset) + (0.0 if is_of_points else 0.5)
    size = np.asarray(image.dimensions) - (0 if is_of_points else 1)
    return size, np.asarray(image.index_to_physical_matrix) @ begin


def grid_of_image(image: pyvista.ImageData, scalars: str | None) -> tuple[Grid, str]:
    """The values of points or of cells, and what they are called."""
    active = image.active_scalars_info
    name = active.name if scalars is None else scalars
    if name not in (*image.point_data, *image.cell_data):
        raise InputError(f"there is no array {name!r} in this grid; name one as `scalars`")
    prefers_cells = scalars is None and active.association.name == "CELL"
    is_of_points = name in image.point_data and not prefers_cells
    array = np.asarray((image.point_data if is_of_points else image.cell_data)[name])
    if array.ndim != 1:
        raise InputError(
            f"'{name}' has {array.shape[1]} numbers for each value; give one with a single number"
        )
    size, affine = nodes_of(image, is_of_points)
    if size.min() < 1:
        raise InputError(f"the grid's dimensions are {image.dimensions}; give at least two values along each")
    return grid_of(array.reshape(size, order="F"), None, None, affine), name


def further_values(image: pyvista.ImageData, taken: str) -> list[GridValues]:
    """All arrays of an image but the one that is taken already; of two with one name, that of points."""
    found = []
    both = sorted((set(image.cell_data) & set(image.point_data)) - {taken, "vtkGhostType"})
    if both:
        warnings.warn(
            f"points and cells have arrays named {', '.join(both)}; the result has those of points",
            MeshWarning,
            stacklevel=4,
        )
    for data, is_of_points in ((image.cell_data, False), (image.point_data, True)):
        size, affine = nodes_of(image, is_of_points)
        arrays = {}
        for name in data:
            # Ghosts would hide points of the surface.
            if name not in (taken, "vtkGhostType"):
                array = np.asarray(data[name])
                arrays[name] = array.reshape((*size, *array.shape[1:]), order="F")
        found.append(GridValues(affine.tolist(), arrays))
    return found


@pyvista.register_dataset_accessor("rtfmesh", pyvista.ImageData)
class ImageAccessor(WithoutFaces):
    """Makes surfaces of values on a grid, which stays as it is."""

    _maker = "`.rtfmesh.contour(n, iso=...)`"

    def __init__(self, image: pyvista.ImageData) -> None:
        self._image = image

    @keywords
    def contour(
        self,
        n: int | str | None = None,
        *,
        scalars: str | None = None,
        iso: float | Sequence[float] | None = None,
        labels: bool | int | Sequence[int] = False,
        inside: str | None = None,
        closed: bool = False,
        keep_specks: bool = False,
        attributes: Attributes | Mapping[str, Any] | bool | None = None,
        distances: bool = False,
        progress: bool | Callback = False,
        device: str | int | None = None,
        device_memory: int | None = None,
        remesher: Remesher | None = None,
        **options: Unpack[Options],
    ) -> pyvista.PolyData:
        """The surface at a value, or the borders between labels, with exactly `n` points.

        `scalars` names the values, of points or else of cells; by default those that are active. Labels on
        both sides of a face come as arrays of cells, and so does "iso" where there are several values. All
        other arrays come along as arrays of points, interpolated as in `rtfmesh.contour`, unless
        `attributes=False` or others are given; field data comes along, too. `remesher` is a
        `rtfmesh.Remesher` to use; all other arguments and what is raised are as in `rtfmesh.contour`.
        """
        grid, name = grid_of_image(self._image, scalars)
        volume = volume_of(grid, iso, labels, inside, closed, keep_specks)
        carried = (
            further_values(self._image, name)
            if attributes is None or attributes is True
            else grid_values(attributes, grid.size, grid.frame, "the grid")
        )
        told = Told(correspondence=False, distances=distances, progress=progress)
        wanted = dict(options)

        def run(remesher: Remesher) -> Result:
            return remesher._contour(volume, n, told, wanted, carried)

        result = warned(on_device(remesher, device, device_memory, told, run))
        return surface_of(result, split_at_seams(result, False), self._image)


@pyvista.register_dataset_accessor("rtfmesh", pyvista.PolyData)
class Accessor:
    """Remeshes and measures a surface; none of its methods changes it."""

    def __init__(self, mesh: pyvista.PolyData) -> None:
        self._mesh = mesh

    @keywords
    def remesh(
        self,
        n: int | str | None = None,
        *,
        attributes: bool = True,
        distances: bool = False,
        progress: bool | Callback = False,
        device: str | int | None = None,
        device_memory: int | None = None,
        remesher: Remesher | None = None,
        **options: Unpack[Options],
    ) -> pyvista.PolyData:
        """A new surface of exactly `n` points with well-shaped triangles.

        Polygons are triangulated on the way. Arrays of points and cells come along as `rtfmesh.Attributes`
        says, texture coordinates and field data too; names of arrays in `sizing="property:NAME"` are those of
        points. `attributes=False` leaves arrays of points and cells behind. With `keep_uv=True` points on
        texture seams are there once for each side, beyond `n`. The report is in `user_dict["rtfmesh"]`.
        `remesher` is a `rtfmesh.Remesher` to use; all other arguments and what is raised are as in
        `rtfmesh.remesh`.
        """
        mesh, faces = triangles_of(self._mesh)
        uv_name = mesh.point_data.active_texture_coordinates_name
        told = Told(correspondence=False, distances=distances, progress=progress)
        given = attributes_of(mesh, faces) if brings_own(attributes) else Attributes()
        wanted = dict(options)

        def run(remesher: Remesher) -> Result:
            return remesher._run(mesh.points, faces, n, given, told, wanted)

        result = warned(on_device(remesher, device, device_memory, told, run))
        split = split_at_seams(result, bool(options.get("keep_uv")))
        made = surface_of(result, split, self._mesh)
        if split.uv is not None:
            made.point_data[uv_name] = split.uv
            made.point_data.active_texture_coordinates_name = uv_name
        return made

    @keywords_of(reconstruct, "points")
    def reconstruct(self, n: int | str | None = None, **wanted: Any) -> pyvista.PolyData:
        """As `PointsAccessor.reconstruct`, of points without faces."""
        mesh = self._mesh
        if not is_of_points(mesh):
            raise InputError(
                "`reconstruct` works only with points, and this has faces or lines; use `remesh`"
            )
        return reconstruct(mesh, n, **wanted)

    @keywords_of(measure, "vertices", "faces")
    def measure(self, against: MeshLike | NDArray[Any] | None = None, **wanted: Any) -> dict[str, Any]:
        """As `rtfmesh.measure`, of this surface; `against` is another one, or points."""
        return measure(self._mesh, against=against, **wanted)

    @keywords_of(inspect, "vertices", "faces")
    def inspect(self, n: int | str | None = None, **wanted: Any) -> dict[str, Any]:
        """As `rtfmesh.inspect`, of this surface."""
        return inspect(self._mesh, n=n, **wanted)


class SurfaceAccessor(Accessor):
    """Remeshes and measures the surface of a data set, which stays as it is."""

    def __init__(self, mesh: pyvista.DataSet | pyvista.MultiBlock) -> None:
        self._source = mesh

    @property
    def _mesh(self) -> pyvista.PolyData:
        source = self._source
        return surface_in(source.combine() if isinstance(source, pyvista.MultiBlock) else source)


for _kind in (
    pyvista.UnstructuredGrid,
    pyvista.StructuredGrid,
    pyvista.ExplicitStructuredGrid,
    pyvista.RectilinearGrid,
    pyvista.MultiBlock,
):
    pyvista.register_dataset_accessor("rtfmesh", _kind)(SurfaceAccessor)
