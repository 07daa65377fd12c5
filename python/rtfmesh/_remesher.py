"""A device with its compiled kernels, and runs on it."""

from __future__ import annotations

import json
import os
import re
import threading
import warnings
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, Literal, overload

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import _native
from ._arrays import Vertices, finite, mesh_arrays, real_numbers, short, surface_arrays, truth
from ._attributes import Attributes, Carrier, Given, read_attributes
from ._errors import DeviceError, InputError, MeshWarning, in_python
from ._grid_values import GridValues, grid_values
from ._objects import MeshLike, given_mesh, given_points, with_count
from ._options import Options
from ._progress import Callback, Native, shown
from ._result import Cells, Correspondence, LocatedResult, Result
from ._selections import with_argument
from ._volume import Volume, grid_of, volume_of
from ._words import (
    is_word,
    keywords,
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
Points = tuple["Vertices | None", bool, str]


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


def wanted_device(device: Any, device_memory: Any) -> tuple[str | None, int | None]:
    """The name of a device and its memory in MiB, as arguments say them; which there are is found later."""
    is_name = isinstance(device, (str, int, np.integer)) and not isinstance(device, bool)
    if device is not None and not is_name:
        remedy = "give an index or a name of rtfmesh.devices(), 'cpu' or 'gpu'"
        raise InputError(f"`device` is {short(device)}; {remedy}")
    is_count = isinstance(device_memory, (int, np.integer)) and not isinstance(device_memory, bool)
    if device_memory is not None and not is_count:
        raise InputError(f"`device_memory` is {short(device_memory)}; use 1 to 2^30 MiB")
    if device_memory is not None and not 0 < device_memory <= 1 << 30:
        raise InputError(f"`device_memory` {device_memory!r} is out of range; use 1 to 2^30 MiB")
    return None if device is None else str(device), device_memory


def opened(device: str | None, memory: int | None, timings: bool) -> _native.Device:
    """The device; where the environment has chosen it, errors say so."""
    try:
        return _native.Device(device, memory, timings)
    except DeviceError as error:
        if device is not None:
            raise
        raise type(error)(str(error).replace("`device` is", "RTFMESH_DEVICE is")) from None


class Remesher:
    """A device with its compiled kernels, for any number of meshes.

    `device` is an index or name as `devices` has them, "cpu" or "gpu"; by default RTFMESH_DEVICE, or the best
    GPU, or the CPU. `device_memory` is the maximum device memory in MiB. With `timings`, reports contain the
    time of every kernel, which slows small meshes down. Threads may share a remesher and take turns
    on its device, or have one each. A forked process opens the device again for itself, or gets a
    `DeviceError` if the parent has used a GPU's driver. A copy, such as one that was pickled for another
    process, opens it at its first use.

    Raises `DeviceError` without a usable device.
    """

    @keywords
    def __init__(
        self, device: str | int | None = None, *, device_memory: int | None = None, timings: bool = False
    ) -> None:
        self._wanted = *wanted_device(device, device_memory), truth(timings, "timings")
        self._open: tuple[int, _native.Device] | None = os.getpid(), opened(*self._wanted)

    def __getstate__(self) -> tuple[str | None, int | None, bool]:
        """What was asked for: a copy opens the device for itself when it first needs it."""
        return self._wanted

    def __setstate__(self, wanted: tuple[str | None, int | None, bool]) -> None:
        """See `__getstate__`."""
        self._wanted = wanted
        self._open = None

    @property
    def _device(self) -> _native.Device:
        """The device that this process has opened."""
        if self._open is None or self._open[0] != os.getpid():
            self._open = os.getpid(), opened(*self._wanted)
        return self._open[1]

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

    @overload
    def remesh(
        self,
        vertices: ArrayLike | MeshLike,
        faces: ArrayLike | int | str | None = None,
        n: int | str | None = None,
        *,
        attributes: Attributes | Mapping[str, Any] | bool | None = None,
        correspondence: Literal[True] = True,
        distances: bool = False,
        cells: bool = False,
        progress: bool | Callback = False,
        **options: Unpack[Options],
    ) -> LocatedResult: ...

    @overload
    def remesh(
        self,
        vertices: ArrayLike | MeshLike,
        faces: ArrayLike | int | str | None = None,
        n: int | str | None = None,
        *,
        attributes: Attributes | Mapping[str, Any] | bool | None = None,
        correspondence: bool,
        distances: bool = False,
        cells: bool = False,
        progress: bool | Callback = False,
        **options: Unpack[Options],
    ) -> Result: ...

    @keywords
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

    @keywords
    def reconstruct(
        self,
        points: ArrayLike | MeshLike,
        n: int | str | None = None,
        *,
        normals: ArrayLike | None = None,
        closed: bool = False,
        points_as: str = "auto",
        attributes: Attributes | Mapping[str, Any] | bool | None = None,
        distances: bool = False,
        progress: bool | Callback = False,
        **options: Unpack[Options],
    ) -> Result:
        """As `rtfmesh.reconstruct`, on this device."""
        told = Told(correspondence=False, distances=distances, progress=progress)
        at, normals, given = given_points(points, normals, attributes)
        known = (normals, closed, points_as)
        return warned(self._reconstruct(at, n, known, given, told, dict(options)))

    def _reconstruct(
        self,
        points: ArrayLike,
        n: int | str | None,
        known: tuple[ArrayLike | None, bool, str],
        attributes: Attributes,
        told: Told,
        wanted: dict[str, Any],
    ) -> Result:
        normals, closed, points_as = known
        positions = finite(real_numbers(points, "points", (None, 3)), "points")
        for name in ("features", "keep", "only"):
            if not is_word(wanted.get(name)):
                raise InputError(f"`{name}` needs faces, which points do not have; remove it")
        asked = (
            None if normals is None else real_numbers(normals, "normals", (len(positions), 3)),
            truth(closed, "closed"),
            word("points_as", points_as),
        )
        faces = np.empty((0, 3), np.uint32)
        result = self._run(positions, faces, n, attributes, told, wanted, asked)
        # They would be on a surface that nobody has.
        return replace(result, correspondence=None, face_correspondence=None)

    @keywords
    def contour(
        self,
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
        **options: Unpack[Options],
    ) -> Result:
        """As `rtfmesh.contour`, on this device."""
        told = Told(correspondence=False, distances=distances, progress=progress)
        grid = grid_of(values, spacing, origin, affine)
        volume = volume_of(grid, iso, labels, inside, closed, keep_specks)
        carried = grid_values(attributes, grid.size, grid.frame)
        return warned(self._contour(volume, n, told, dict(options), carried))

    def _contour(
        self,
        volume: Volume,
        n: int | str | None,
        told: Told,
        wanted: dict[str, Any],
        carried: Sequence[GridValues],
    ) -> Result:
        for name in ("features", "sizing", "fixed_points", "keep", "only"):
            if not is_word(wanted.get(name)):
                raise InputError(f"`{name}` needs a mesh, and a volume is not one; remove it")
        keep = wanted.get("keep_labels")
        if not isinstance(label_names(keep), bool):
            remedy = "use True for all borders between labels"
            raise InputError(f"`keep_labels` is {short(keep)}, and a volume has no arrays of faces; {remedy}")
        nothing = np.empty((0, 3)), np.empty((0, 3), np.uint32)
        result = self._run(*nothing, n, Attributes(), told, wanted, volume=volume)
        for values in carried:
            result.attributes.vertex.update(values.at(result.vertices))
            result.attributes.label_names.update(values.label_names)
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
        is_mesh = points is None and volume is None
        positions, triangles = (surface_arrays if is_mesh else mesh_arrays)(vertices, faces)
        named = dict(wanted)
        sizing = take_sizing(wanted, positions)
        features = take_features(wanted, positions)
        fixed = take_fixed_points(wanted)
        kept = take_kept(wanted, len(positions), triangles)
        line = words(n, wanted)
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
            try:
                done = _native.remesh(self._device, (positions, triangles), line, request)
            except InputError as error:
                source = "values" if volume else "points" if points else "faces"
                raise with_argument(error, named, source) from None
        (new_vertices, new_faces), columns, of_vertices, of_faces, text, cells = done
        found: dict[str, Any] = json.loads(text)
        # Of files, which there are none of.
        del found["input_file"], found["output_file"]
        for told_as in ("warnings", "notes"):
            found[told_as] = [in_python(text) for text in found[told_as]]
        of_labels = carrier.labels.warning() if carrier.labels else None
        warn_of_attributes(found, of_labels)
        kind: type[Result] = LocatedResult if told.correspondence else Result
        return kind(
            new_vertices,
            new_faces,
            found,
            # Attributes may have needed it.
            Correspondence(*of_vertices) if told.correspondence or len(of_vertices[0]) else None,
            Correspondence(*of_faces) if len(of_faces[0]) else None,
            # Those of a volume come from the values.
            read_attributes(columns)
            if volume
            else carrier.carried(columns, len(new_vertices), len(new_faces)),
            None if cells is None else Cells(*cells),
        )


def warn_of_attributes(report: dict[str, Any], of_labels: str | None) -> None:
    """Turns notes that an option has no effect into warnings, and adds the one on labels."""
    notes, report["notes"] = report["notes"], []
    for note in notes:
        option = re.match(r"`(\w+)` has no effect: [^;]*", note)
        # The warning knows which arrays count.
        if note.startswith("`keep_labels` keeps") or (of_labels and "has no labels" in note):
            continue
        if option is None:
            report["notes"].append(note)
            continue
        report["warnings"].append(f"{option[0]}; remove `{option[1]}`")
        report["warning_codes"].append("no-effect")
    if of_labels:
        report["warnings"].append(of_labels)
        report["warning_codes"].append("labels")


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


def warned(result: Result, stacklevel: int = 4) -> Result:
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
    key = (*wanted_device(device, device_memory), timings, os.environ.get("RTFMESH_DEVICE"))
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
        return on_shared(device, device_memory, told.distances, run)
    for name, given in (("device", device), ("device_memory", device_memory)):
        if given is not None:
            raise InputError(f"`{name}` and `remesher` exclude each other; remove one")
    if not isinstance(remesher, Remesher):
        raise InputError(f"`remesher` is {short(remesher)}; give a rtfmesh.Remesher")
    return run(remesher)


def on_shared(
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
