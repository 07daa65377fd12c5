"""Measures, features and pictures of meshes, and the devices of this machine."""

from __future__ import annotations

import json
import os
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import _native
from ._arrays import Faces, Vertices, one_of, real_number, surface_arrays, truth, whole_numbers
from ._errors import InputError, OutputError
from ._objects import MeshLike, arrays_of, given_mesh, is_pair, reference_of, with_count
from ._selections import with_argument
from ._words import check_needs, count, is_word, keywords, take_features

# The most vertices that a plan is made for.
MAX_COUNT = 2**32 - 1


def degrees(feature_angle: Any) -> float:
    """The least angle of sharp edges."""
    angle = real_number(feature_angle, "feature_angle")
    if not 0 < angle <= 180:
        problem = f"`feature_angle` {angle:g} is out of range"
        raise InputError(f"{problem}; use a number above 0 and at most 180 degrees")
    return angle


def devices() -> list[dict[str, Any]]:
    """The Vulkan devices of this machine, as `rtfmesh devices --json` lists them: index, name, kind, driver,
    limits, under "missing" why one cannot be used, and what the self-test of its driver found.

    Raises `DeviceError` without a Vulkan driver; where none has a device the list is empty.
    """
    found: list[dict[str, Any]] = json.loads(_native.devices(True))
    return found


def untested_devices() -> list[dict[str, Any]]:
    """As `devices`, but none is opened: the self-test of a driver that was never used has no result."""
    found: list[dict[str, Any]] = json.loads(_native.devices(False))
    return found


@keywords
def measure(
    vertices: ArrayLike | MeshLike,
    faces: ArrayLike | None = None,
    *,
    against: MeshLike | NDArray[Any] | None = None,
    accuracy: float | None = None,
    energy: bool = False,
    features: bool = False,
    feature_angle: float = 40.0,
) -> dict[str, Any]:
    """Measures a mesh: triangle quality, topology, self-intersections; as `rtfmesh measure --json`.

    The mesh is vertices (V, 3) and faces (F, 3), or in place of both one object, as in `remesh`.

    With `against`, another mesh, also the distances between both, in percent of that one's diagonal:
    certified intervals for the Hausdorff distance, each as narrow as `accuracy` asks for (1e-6 to 0.5 of its
    upper end; 0.01 by default), and root mean squares of samples. `energy` adds how evenly the vertices cover
    it, and `features` the distances between boundaries and edges that turn by `feature_angle` degrees.

    Points, an array of shape (P, 3) or a mesh without faces, may stand for that mesh: "points" then has the
    distances from them to the mesh and back, and their spacing, in percent of their diagonal.

    Raises `InputError`.
    """
    shape = given_mesh(vertices, faces)
    mesh = surface_arrays(shape.vertices, shape.faces)
    other = None if against is None else reference_of(against)
    wanted = ("energy", truth(energy, "energy")), ("features", truth(features, "features"))
    for name, given in (("accuracy", accuracy is not None), *wanted):
        if given and other is None:
            raise InputError(f"`{name}` needs `against`; remove one, or add the other")
        if given and other is not None and not len(other[1]):
            remedy = f"remove `{name}`, or make a surface of the points with rtfmesh.reconstruct"
            raise InputError(f"`{name}` needs a mesh as `against`, and that has only points; {remedy}")
    angle = degrees(feature_angle)
    gap = None if accuracy is None else real_number(accuracy, "accuracy")
    found: dict[str, Any] = json.loads(
        _native.measure(mesh, other, gap, bool(energy), angle if features else None)
    )
    return found


@keywords
def inspect(
    vertices: ArrayLike | MeshLike,
    faces: ArrayLike | int | str | None = None,
    n: int | str | None = None,
    *,
    feature_angle: float = 40.0,
    features: ArrayLike | str | os.PathLike[str] | None = None,
) -> dict[str, Any]:
    """Finds a mesh's topology, its repairs, and its curves, corners and patches; as `rtfmesh inspect --json`.

    The mesh is vertices and faces, or one object, as in `remesh`. `n` is the number of vertices to remesh to,
    also as "10k", which decides how short curves may be; by default the mesh's.
    Edges that turn by at least `feature_angle` degrees are curves, and those of `features`: an array of shape
    (L, 2) of the vertices of edges, or an OBJ file with lines.

    Raises `InputError`.
    """
    faces, n = with_count(vertices, faces, n)
    shape = given_mesh(vertices, faces)
    mesh = surface_arrays(shape.vertices, shape.faces)
    vertices_wanted = None if n is None else count(n)
    if vertices_wanted is not None and not 1 <= vertices_wanted <= MAX_COUNT:
        least_or_most = "at least 1" if vertices_wanted < 1 else f"at most {MAX_COUNT}"
        raise InputError(f"`n` is {n}; give {least_or_most}")
    angle = degrees(feature_angle)
    check_needs({"features": features})
    lines = take_features({"features": features}, mesh[0])
    file = Path(features) if features is not None and is_word(features) else None  # type: ignore[arg-type]
    try:
        found: dict[str, Any] = json.loads(_native.inspect(mesh, vertices_wanted, angle, lines, file))
    except InputError as error:
        raise with_argument(error, {"features": features}) from None
    # Of files, which there are none of.
    del found["notes"], found["attributes"]
    return found


@dataclass
class Drawing:
    """How the native module draws."""

    color: str
    against: tuple[Vertices, Faces] | None
    curves: bool
    edges: bool
    size: tuple[int, int]
    azimuth: float
    elevation: float
    zoom: float
    z_up: bool
    png: bool


@keywords
def render(
    meshes: MeshLike | Sequence[MeshLike],
    path: str | os.PathLike[str] | None = None,
    *,
    color: str = "plain",
    against: MeshLike | None = None,
    curves: bool = False,
    edges: bool = True,
    size: tuple[int, int] = (720, 540),
    azimuth: float = 25.0,
    elevation: float = 15.0,
    zoom: float = 1.0,
    z_up: bool = False,
) -> NDArray[np.uint8] | None:
    """Draws a mesh, or several side by side: flat shaded, seen by the camera that frames the first.

    `meshes` is a pair (vertices, faces), an object as in `remesh`, or a list of such. `color`
    is "plain", "quality" (light for equilateral triangles, dark for slivers) or "distance" (from `against`).
    `curves` draws sharp edges and boundaries, `edges` those of all triangles. `size` is the width and height
    of each panel in pixels; `azimuth` and `elevation` are the camera's angles in degrees; `z_up` says that z
    points up, not y.

    Returns an array of shape (height, width, 4): red, green, blue and opacity, 0 to 255. With `path`, which
    must end in .png, it writes that file instead and returns None.

    Raises `InputError`; `OutputError` where the file cannot be written.
    """
    # A pair of arrays is a tuple, and so may be a pair of meshes.
    is_many = isinstance(meshes, (list, tuple)) and not is_pair(meshes)
    listed: list[Any] = list(meshes) if is_many else [meshes]  # type: ignore[arg-type]
    if not listed:
        raise InputError("`meshes` is empty; give at least one mesh")
    found = [arrays_of(mesh, f"meshes[{place}]") for place, mesh in enumerate(listed)]
    other = None if against is None else arrays_of(against, "against")
    one_of(color, "color", ("plain", "quality", "distance"))
    if (other is None) == (color == "distance"):
        raise InputError("`color` 'distance' and `against` work only together; give both or neither")
    if path is not None and not isinstance(path, (str, os.PathLike)):
        raise InputError(f"`path` is of type {type(path).__name__}; give the name of a .png file")
    if path is not None and Path(path).suffix.lower() != ".png":
        raise InputError(f"`path` {os.fspath(path)} does not end in .png; give the name of a .png file")
    width, height = whole_numbers(size, "size", 2)
    drawing = Drawing(
        color,
        other,
        truth(curves, "curves"),
        truth(edges, "edges"),
        (width, height),
        real_number(azimuth, "azimuth"),
        real_number(elevation, "elevation"),
        real_number(zoom, "zoom"),
        truth(z_up, "z_up"),
        path is not None,
    )
    pixels = _native.render(found, drawing)
    if path is None:
        return pixels.reshape(height, width * len(found), 4)
    try:
        Path(path).write_bytes(pixels.tobytes())
    except OSError as error:
        raise OutputError(f"{os.fspath(path)}: {error.strerror}; choose another file or folder") from error
    return None


def png(mesh: MeshLike, size: tuple[int, int]) -> bytes:
    """A picture of a mesh as `render` draws it, as the bytes of a PNG."""
    drawing = Drawing("plain", None, False, True, size, 25.0, 15.0, 1.0, False, True)
    return _native.render([arrays_of(mesh, "mesh")], drawing).tobytes()
