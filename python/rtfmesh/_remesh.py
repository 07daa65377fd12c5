"""Remeshing."""

from __future__ import annotations

import inspect
import json
import os
import threading
import warnings
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import _native
from ._arrays import Vertices, mesh_arrays, real_numbers, short, truth
from ._attributes import Attributes, Carrier, Given, read_attributes
from ._errors import DeviceError, InputError, MeshWarning, in_python
from ._objects import MeshLike, given_mesh, given_points, with_count
from ._options import Options
from ._progress import Callback, Native, shown
from ._result import Cells, Correspondence, Result
from ._volume import Volume, grid_of, volume_of
from ._words import (
    is_word,
    label_names,
    take_features,
    take_fixed_points,
    take_kept,
    take_sizing,
    word,
    words,
)

if TYPE_CHECKING:
    from typing_extensions import Unpack


# What is known of points without faces: normals, whether to close all holes, the size of holes to close, and
# what the points show.
Points = tuple["Vertices | None", bool, "str | None", str]


@dataclass
class Request:
    """A run as the native module takes it, but for mesh and options."""

    attributes: Given
    points: Points | None
    values: tuple[Any, ...] | None
    sizing: Vertices | None
    features: NDArray[np.float64] | None
    fixed_points: NDArray[np.float64] | None
    keep: NDArray[np.uint32] | None
    correspondence: tuple[bool, bool]
    distances: bool
    cells: bool
    progress: Native | None


class Remesher:
    """A device with its compiled kernels, for any number of meshes.

    `device` is an index or name as `devices` has them, "cpu" or "gpu"; by default RTFMESH_DEVICE, or the best
    GPU, or the CPU. `device_memory` is the maximum device memory in MiB. With `timings`, reports contain the
    time of every kernel, which slows small meshes down. Threads may share a remesher and take turns
    on its device, or have one each. A forked process opens the device again for itself, or gets a
    `DeviceError` if the parent has used a GPU's driver.

    Raises `DeviceError` without a usable device.
    """

    def __init__(
        self, device: str | int | None = None, *, device_memory: int | None = None, timings: bool = False
    ) -> None:
        if device_memory is not None and not (
            isinstance(device_memory, (int, np.integer)) and 0 < device_memory <= 1 << 30
        ):
            raise InputError(f"`device_memory` {device_memory!r} is out of range; use 1 to 2^30 MiB")
        name = None if device is None else str(device)
        self._wanted = name, device_memory, truth(timings, "timings")
        self._open = os.getpid(), _native.Device(*self._wanted)

    @property
    def _device(self) -> _native.Device:
        """The device that this process has opened."""
        process, device = self._open
        if process != os.getpid():
            device = _native.Device(*self._wanted)
            self._open = os.getpid(), device
        return device

    @property
    def device(self) -> dict[str, Any]:
        """The device, as in `devices`."""
        info: dict[str, Any] = json.loads(self._device.info())
        return info

    def __enter__(self) -> Remesher:
        return self

    def __exit__(self, *_: object) -> None:
        """Does nothing: the device is closed with the last use of the remesher."""

    def __repr__(self) -> str:
        return f"<rtfmesh.Remesher on {self.device['name']}>"

    def remesh(
        self,
        vertices: ArrayLike | MeshLike,
        faces: ArrayLike | int | str | None = None,
        n: int | str | None = None,
        *,
        attributes: Attributes | Mapping[str, Any] | bool | None = None,
        correspondence: bool = True,
        distances: bool = False,
        cells: bool = False,
        progress: bool | Callback = False,
        **options: Unpack[Options],
    ) -> Result:
        """As `rtfmesh.remesh`, on this device."""
        told = Told(correspondence=correspondence, distances=distances, progress=progress, cells=cells)
        faces, n = with_count(vertices, faces, n)
        given = given_mesh(vertices, faces, attributes)
        return warned(self._run(given.vertices, given.faces, n, given.attributes, told, dict(options)))

    def reconstruct(
        self,
        points: ArrayLike | MeshLike,
        n: int | str | None = None,
        *,
        normals: ArrayLike | None = None,
        closed: bool = False,
        fill_holes: float | str | None = None,
        points_as: str = "auto",
        attributes: Attributes | Mapping[str, Any] | bool | None = None,
        distances: bool = False,
        progress: bool | Callback = False,
        **options: Unpack[Options],
    ) -> Result:
        """As `rtfmesh.reconstruct`, on this device."""
        told = Told(correspondence=False, distances=distances, progress=progress)
        at, normals, given = given_points(points, normals, attributes)
        known = (normals, closed, fill_holes, points_as)
        return warned(self._reconstruct(at, n, known, given, told, dict(options)))

    def _reconstruct(
        self,
        points: ArrayLike,
        n: int | str | None,
        known: tuple[ArrayLike | None, bool, float | str | None, str],
        attributes: Attributes,
        told: Told,
        wanted: dict[str, Any],
    ) -> Result:
        normals, closed, fill_holes, points_as = known
        positions = real_numbers(points, "points", (None, 3))
        for name in ("features", "keep", "only"):
            if not is_word(wanted.get(name)):
                raise InputError(f"`{name}` needs faces, which points do not have; remove it")
        asked = (
            None if normals is None else real_numbers(normals, "normals", (len(positions), 3)),
            truth(closed, "closed"),
            None if fill_holes is None else word("fill_holes", fill_holes),
            word("points_as", points_as),
        )
        faces = np.empty((0, 3), np.uint32)
        result = self._run(positions, faces, n, attributes, told, wanted, asked)
        # They would be on a surface that nobody has.
        return replace(result, correspondence=None, face_correspondence=None)

    def contour(
        self,
        values: ArrayLike,
        n: int | str | None = None,
        *,
        iso: float | None = None,
        labels: bool | int | Sequence[int] = False,
        inside: str | None = None,
        spacing: ArrayLike | None = None,
        origin: ArrayLike | None = None,
        affine: ArrayLike | None = None,
        closed: bool = False,
        keep_specks: bool = False,
        distances: bool = False,
        progress: bool | Callback = False,
        **options: Unpack[Options],
    ) -> Result:
        """As `rtfmesh.contour`, on this device."""
        told = Told(correspondence=False, distances=distances, progress=progress)
        volume = volume_of(grid_of(values, spacing, origin, affine), iso, labels, inside, closed, keep_specks)
        return warned(self._contour(volume, n, told, dict(options)))

    def _contour(self, volume: Volume, n: int | str | None, told: Told, wanted: dict[str, Any]) -> Result:
        for name in ("features", "sizing", "fixed_points", "keep", "only"):
            if not is_word(wanted.get(name)):
                raise InputError(f"`{name}` needs a mesh, and a volume is not one; remove it")
        nothing = np.empty((0, 3)), np.empty((0, 3), np.uint32)
        result = self._run(*nothing, n, Attributes(), told, wanted, volume=volume)
        return replace(result, correspondence=None, face_correspondence=None)

    def _run(
        self,
        vertices: ArrayLike,
        faces: ArrayLike,
        n: int | str | None,
        attributes: Attributes,
        told: Told,
        wanted: dict[str, Any],
        points: Points | None = None,
        volume: Volume | None = None,
    ) -> Result:
        positions, triangles = mesh_arrays(vertices, faces)
        if points is None and volume is None and len(positions) and not len(triangles):
            raise InputError("`faces` has no faces; rtfmesh.reconstruct makes a surface of points")
        sizing = take_sizing(wanted, positions)
        features = take_features(wanted, positions)
        fixed = take_fixed_points(wanted)
        kept = take_kept(wanted, len(positions), triangles)
        function = "contour" if volume else "remesh" if points is None else "reconstruct"
        line = words(n, wanted, function)
        values = volume.native() if volume else None
        keep = label_names(wanted.get("keep_labels"))
        carrier = Carrier.of(attributes, len(positions), len(triangles), False if volume else keep)
        with shown(told.progress) as callback:
            places = (told.correspondence, False)
            request = Request(
                carrier.given,
                points,
                values,
                sizing,
                features,
                fixed,
                kept,
                places,
                told.distances,
                told.cells,
                callback,
            )
            done = _native.remesh(self._device, (positions, triangles), line, request)
        (new_vertices, new_faces), columns, of_vertices, of_faces, text, cells = done
        found: dict[str, Any] = json.loads(text)
        # Of files, which there are none of.
        del found["input_file"], found["output_file"]
        for told_as in ("warnings", "notes"):
            found[told_as] = [in_python(text) for text in found[told_as]]
        of_labels = carrier.labels.warning() if carrier.labels else None
        if of_labels:
            found["warnings"].append(of_labels)
            found["warning_codes"].append("labels")
        return Result(
            new_vertices,
            new_faces,
            found,
            Correspondence(*of_vertices) if len(of_vertices[0]) else None,
            Correspondence(*of_faces) if len(of_faces[0]) else None,
            # Those of a volume come from the values.
            read_attributes(columns)
            if volume
            else carrier.carried(columns, len(new_vertices), len(new_faces)),
            None if cells is None else Cells(*cells),
        )


@dataclass
class Told:
    """What a caller is to be told of a run and its result."""

    correspondence: bool
    distances: bool
    progress: bool | Callback
    cells: bool = False

    def __post_init__(self) -> None:
        self.correspondence = truth(self.correspondence, "correspondence")
        self.distances = truth(self.distances, "distances")
        self.cells = truth(self.cells, "cells")


def warned(result: Result, stacklevel: int = 3) -> Result:
    """The result, after its warnings have been shown as those of the line that called this package."""
    for warning in result.report["warnings"]:
        warnings.warn(warning, MeshWarning, stacklevel=stacklevel)
    return result


_remeshers: dict[tuple[Any, ...], Remesher] = {}
_opening = threading.Lock()


def _forget_locks() -> None:
    """Makes a new lock in a forked process, where the thread that held the old one does not exist."""
    global _opening
    _opening = threading.Lock()


if hasattr(os, "register_at_fork"):
    os.register_at_fork(after_in_child=_forget_locks)


def _remesher(device: str | int | None, device_memory: int | None, timings: bool) -> tuple[Any, Remesher]:
    """The remesher that calls for this device share: opening one takes longer than a small mesh."""
    key = (device, device_memory, timings, os.environ.get("RTFMESH_DEVICE"))
    with _opening:
        if key not in _remeshers:
            _remeshers[key] = Remesher(device, device_memory=device_memory, timings=timings)
        return key, _remeshers[key]


def on_device(
    remesher: Remesher | None,
    device: str | int | None,
    device_memory: int | None,
    told: Told,
    run: Callable[[Remesher], Result],
) -> Result:
    """What `run` gives with a remesher, or with that which calls for this device share."""
    if remesher is None:
        return _on_shared(device, device_memory, told.distances, run)
    for name, given in (("device", device), ("device_memory", device_memory)):
        if given is not None:
            raise InputError(f"`{name}` and `remesher` exclude each other; remove one")
    if not isinstance(remesher, Remesher):
        raise InputError(f"`remesher` is {short(remesher)}; give a rtfmesh.Remesher")
    return run(remesher)


def _on_shared(
    device: str | int | None, device_memory: int | None, timings: bool, run: Callable[[Remesher], Result]
) -> Result:
    """What `run` gives with the remesher that calls for this device share."""
    key, remesher = _remesher(device, device_memory, timings)
    try:
        return run(remesher)
    except DeviceError:
        # It may be lost, and a lost device stays lost.
        with _opening:
            _remeshers.pop(key, None)
        raise


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
        a `Mesh`, a `Result`, a pair, or a mesh of trimesh, PyVista, meshio or Open3D, whose attributes come
        along; `n` may follow it at once.
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
        All options of the command line under their names, with underscores: `edge_length=0.5` or "1%",
        `ratio`, `max_deviation`, `quality="best"`, `feature_angle=30`, `keep_uv=True`, `seed=7`,
        `time_limit=60` ... `Options` lists them. `sizing` may also be an array of shape (V,) to which edge
        lengths are in proportion, and `features` an array of shape (L, 2): edges to keep, by their vertices.

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
        _on_shared(
            device,
            device_memory,
            told.distances,
            lambda remesher: remesher._run(given.vertices, given.faces, n, given.attributes, told, wanted),
        )
    )


def reconstruct(
    points: ArrayLike | MeshLike,
    n: int | str | None = None,
    *,
    normals: ArrayLike | None = None,
    closed: bool = False,
    fill_holes: float | str | None = None,
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
    fill_holes
        Close holes up to this size, the diagonal of the box around one: in the points' units, or as "1%" of
        the points' own diagonal. Gaps of up to six distances between points are closed in any case.
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
        given. `sizing` may be an array of shape (P,).

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
    known, wanted = (normals, closed, fill_holes, points_as), dict(options)
    return warned(
        _on_shared(
            device,
            device_memory,
            told.distances,
            lambda remesher: remesher._reconstruct(at, n, known, given, told, wanted),
        )
    )


def contour(
    values: ArrayLike,
    n: int | str | None = None,
    *,
    iso: float | None = None,
    labels: bool | int | Sequence[int] = False,
    inside: str | None = None,
    spacing: ArrayLike | None = None,
    origin: ArrayLike | None = None,
    affine: ArrayLike | None = None,
    closed: bool = False,
    keep_specks: bool = False,
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
        The value on the surface.
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
        Whether parts stay that are so small beside the largest that they are noise. A note counts those that
        are left out.
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
    return warned(
        _on_shared(
            device, device_memory, told.distances, lambda remesher: remesher._contour(volume, n, told, wanted)
        )
    )


def _with_options(function: Callable[..., Any]) -> None:
    """Puts all options into the signature, for `help` and the completion of notebooks."""
    signature = inspect.signature(function)
    own = [one for one in signature.parameters.values() if one.kind is not one.VAR_KEYWORD]
    names = {one.name for one in own}
    options = [
        inspect.Parameter(name, inspect.Parameter.KEYWORD_ONLY, default=None, annotation=kind)
        for name, kind in Options.__annotations__.items()
        if name not in names
    ]
    function.__signature__ = signature.replace(parameters=[*own, *options])  # type: ignore[attr-defined]


for _function in (remesh, reconstruct, contour, Remesher.remesh, Remesher.reconstruct, Remesher.contour):
    _with_options(_function)
