"""Remeshing."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any, Literal, overload

from numpy.typing import ArrayLike

from ._attributes import Attributes
from ._grid_values import grid_values
from ._objects import MeshLike, given_mesh, given_points, with_count
from ._progress import Callback
from ._remesher import Told, on_shared, warned
from ._result import LocatedResult, Result
from ._volume import grid_of, volume_of
from ._words import keywords

if TYPE_CHECKING:
    from typing_extensions import Unpack

    from ._options import Options


@overload
def remesh(
    vertices: ArrayLike | MeshLike,
    faces: ArrayLike | int | str | None = None,
    n: int | str | None = None,
    *,
    attributes: Attributes | Mapping[str, Any] | bool | None = None,
    correspondence: Literal[True] = True,
    distances: bool = False,
    cells: bool = False,
    progress: bool | Callback = False,
    device: str | int | None = None,
    device_memory: int | None = None,
    **options: Unpack[Options],
) -> LocatedResult: ...


@overload
def remesh(
    vertices: ArrayLike | MeshLike,
    faces: ArrayLike | int | str | None = None,
    n: int | str | None = None,
    *,
    attributes: Attributes | Mapping[str, Any] | bool | None = None,
    correspondence: bool,
    distances: bool = False,
    cells: bool = False,
    progress: bool | Callback = False,
    device: str | int | None = None,
    device_memory: int | None = None,
    **options: Unpack[Options],
) -> Result: ...


@keywords
def remesh(
    vertices: ArrayLike | MeshLike,
    faces: ArrayLike | int | str | None = None,
    n: int | str | None = None,
    *,
    attributes: Attributes | Mapping[str, Any] | bool | None = None,
    correspondence: bool = True,
    distances: bool = False,
    cells: bool = False,
    progress: bool | Callback = False,
    device: str | int | None = None,
    device_memory: int | None = None,
    **options: Unpack[Options],
) -> Result:
    """Remeshes a surface into well-shaped triangles, with exactly `n` vertices.

    Parameters
    ----------
    vertices
        Positions, shape (V, 3): any real numbers, in any units. Or in place of vertices and faces one object:
        a `Mesh`, a `Result`, a pair, or a mesh of trimesh, PyVista, VTK, meshio or Open3D, whose attributes
        come along; `n` may follow it at once.
    faces
        Indices of vertices, shape (F, 3): any integers. Duplicates and faces without area may be among them.
    n
        Number of vertices, at least 4, also as "10k". Without it `edge_length`, `ratio` or `max_deviation`
        says how many; without those too, as many as the input has.
    attributes
        Colours, labels and the like to carry over: an `Attributes`, or a dict such as
        ``{"vertex": {"rgb": (V, 3)}, "face": {"label": (F,)}, "uv": (F, 3, 2)}``. False carries none of an
        object's.
    correspondence
        Whether to find where the vertices of the result lie on the input.
    distances
        Whether the report, which there always is, has the distances to the input and the time of each kernel.
        They take a little time.
    cells
        Whether the result has the cells of its vertices, as `--cells` writes them.
    progress
        True shows a bar, if tqdm is installed. A function is called with a `Progress` up to 20 times a
        second, and may return "finish" to end the run early with a valid mesh, or "cancel" to stop it.
    device, device_memory
        As in `Remesher`. The device stays open for the next call.
    **options
        All options of the command line under their names, with underscores, such as `edge_length="1%"`,
        `quality="best"` or `keep_uv=True`: see below, or `help(rtfmesh.Options)`.

    Returns
    -------
    A `Result`. The same input, options and device give the same bytes.

    Raises
    ------
    InputError
        An argument or the mesh cannot be used; the message says which, and what to do.
    DeviceError
        There is no usable Vulkan device, or too little memory (`OutOfMemoryError`).
    Cancelled
        The progress callback said so. After Ctrl-C it is KeyboardInterrupt, within a second.

    Warns
    -----
    MeshWarning
        Something is wrong with the result, such as a part of the input that it leaves out.
    """
    told = Told(correspondence=correspondence, distances=distances, progress=progress, cells=cells)
    faces, n = with_count(vertices, faces, n)
    given, wanted = given_mesh(vertices, faces, attributes), dict(options)
    return warned(
        on_shared(
            device,
            device_memory,
            told.distances,
            lambda remesher: remesher._run(given.vertices, given.faces, n, given.attributes, told, wanted),
        )
    )


@keywords
def reconstruct(
    points: ArrayLike | MeshLike,
    n: int | str | None = None,
    *,
    normals: ArrayLike | None = None,
    closed: bool = False,
    points_as: str = "auto",
    attributes: Attributes | Mapping[str, Any] | bool | None = None,
    distances: bool = False,
    progress: bool | Callback = False,
    device: str | int | None = None,
    device_memory: int | None = None,
    **options: Unpack[Options],
) -> Result:
    """Makes a surface of points without faces, in well-shaped triangles with exactly `n` vertices.

    A surface is laid through the points, and remeshed. Where they end, it ends, and sharp edges become round
    within the distance between points.

    Parameters
    ----------
    points
        Positions, shape (P, 3): any real numbers, in any units; 10 at least. Or one object with points and no
        faces, as in `remesh`, with its normals and attributes.
    n
        Number of vertices, at least 4, also as "10k". Without it `edge_length`, `ratio` (of the number of
        points) or `max_deviation` says how many; without those too, as many as there are points.
    normals
        Outward normals, shape (P, 3), of any length; a zero or NaN one is unknown. If any is, all are found
        from the points, which sheets closer than two distances between points are too close for.
    closed
        Whether to close all holes.
    points_as
        What the points show: "terrain", seen along z, has one height at each place, of ground and roofs,
        without trees and noise; "object" has a surface through all points; "auto" is a terrain if the points
        look like one. A "classification" in `attributes` decides with LAS classes.
    attributes
        Values of the points to carry over, by those of the nearest: an `Attributes` or a dict such as
        ``{"vertex": {"rgb": (P, 3), "label": (P,)}}``.
    distances
        As in `remesh`; they are those to the surface through the points.
    progress, device, device_memory
        As in `remesh`.
    **options
        As in `remesh`. There are no sharp edges unless `feature_angle` is
        given. `sizing` may be an array of shape (P,). `fill_holes="5%"` closes holes up to this size, the
        diagonal of the box around one; gaps of up to six distances between points are closed in any case.

    Returns
    -------
    A `Result` without correspondence. `report["notes"]` tells what became of the points.

    Raises
    ------
    InputError
        An argument cannot be used, or no surface goes through the points. The rest is as in `remesh`.

    Warns
    -----
    MeshWarning
        As `remesh`.
    """
    told = Told(correspondence=False, distances=distances, progress=progress)
    at, normals, given = given_points(points, normals, attributes)
    known, wanted = (normals, closed, points_as), dict(options)
    return warned(
        on_shared(
            device,
            device_memory,
            told.distances,
            lambda remesher: remesher._reconstruct(at, n, known, given, told, wanted),
        )
    )


@keywords
def contour(
    values: ArrayLike,
    n: int | str | None = None,
    *,
    iso: float | Sequence[float] | None = None,
    labels: bool | int | Sequence[int] = False,
    inside: str | None = None,
    spacing: ArrayLike | None = None,
    origin: ArrayLike | None = None,
    affine: ArrayLike | None = None,
    closed: bool = False,
    keep_specks: bool = False,
    attributes: Attributes | Mapping[str, Any] | bool | None = None,
    distances: bool = False,
    progress: bool | Callback = False,
    device: str | int | None = None,
    device_memory: int | None = None,
    **options: Unpack[Options],
) -> Result:
    """Makes a surface of values on a grid, in well-shaped triangles with exactly `n` vertices.

    Either the surface where the values are `iso`, as of a density, an image or a signed distance, or the
    borders between `labels`, as of a segmentation: all in one mesh, with the curves in which they meet.

    Parameters
    ----------
    values
        Shape (X, Y, Z), of real numbers, which are rounded to float32. NaN stands for no value. Labels are
        whole numbers from 0, which is outside.
    n
        Number of vertices, at least 4, also as "10k". Without it `edge_length`, `ratio` (of the vertices of a
        surface as fine as the grid) or `max_deviation` says how many; without those too, as many as that has.
    iso
        The value on the surface, or several such as [100, 300]: then the surfaces of all are in one mesh with
        `n` vertices together, and `attributes.face["iso"]` has the value of each face.
    labels
        Whether values are labels; a number or several: only these, as if all others were 0. `attributes.face`
        then has those on both sides of each face, as "label_behind" and "label_before".
    inside
        With `iso`, where the object is: "above" or "below". By default, where less of the grid's border is.
    spacing
        Distances of values along the three axes; 1, 1, 1 by default.
    origin
        The place of the first value; 0, 0, 0 by default.
    affine
        In place of `spacing` and `origin`: the 4 x 4 matrix that takes (i, j, k, 1) to the place of
        `values[i, j, k]`, as nibabel has it.
    closed
        Whether the surface ends flat where the grid ends, or is open there.
    keep_specks
        Whether noise stays: parts that are very small beside the largest, and handles. A note counts the
        parts that are left out; where there are too many handles, the values are smoothed, with a warning.
    attributes
        Further values of the grid for the vertices: an `Attributes`, or a dict such as
        ``{"vertex": {"dose": (X, Y, Z), "rgb": (X, Y, Z, 3)}}``. Floating-point numbers and colours are
        interpolated between the eight values around a vertex; others are those of the nearest.
    distances
        As in `remesh`; they are those to the surface in the grid.
    progress, device, device_memory
        As in `remesh`.
    **options
        As in `remesh`, but for arrays in `sizing` and `features`. There are no sharp edges unless
        `feature_angle` is given.

    Returns
    -------
    A `Result` without correspondence. `report["notes"]` tells what became of the values.

    Raises
    ------
    InputError
        An argument cannot be used, or there is no such surface. The rest is as in `remesh`.

    Warns
    -----
    MeshWarning
        As `remesh`.
    """
    told = Told(correspondence=False, distances=distances, progress=progress)
    grid, wanted = grid_of(values, spacing, origin, affine), dict(options)
    volume = volume_of(grid, iso, labels, inside, closed, keep_specks)
    carried = grid_values(attributes, grid.size, grid.frame)
    return warned(
        on_shared(
            device,
            device_memory,
            told.distances,
            lambda remesher: remesher._contour(volume, n, told, wanted, carried),
        )
    )
