"""Remeshing for the meshes of meshio, and so for the file formats that it reads.

import meshio
from rtfmesh.meshio import remesh

even = remesh(meshio.read("part.vtu"), 10_000)
"""

from __future__ import annotations

import copy
from typing import TYPE_CHECKING, Any

import meshio
import numpy as np
from numpy.typing import NDArray

from ._attributes import Alias, Attributes, brings_own, called
from ._errors import InputError
from ._objects import Shape
from ._progress import Callback
from ._remesher import Remesher, Told, on_device, warned
from ._result import Result
from ._words import keywords

if TYPE_CHECKING:
    from typing_extensions import Unpack

    from ._options import Options

SURFACES = ("triangle", "quad", "polygon")
CURVES = ("vertex", "line")
# What the names of sets travel under.
SET = "cell set of meshio: "


def split(polygons: NDArray[Any], points: NDArray[Any]) -> NDArray[Any]:
    """The triangles of P polygons with K corners each, shape (P, K - 2, 3).

    Each is a fan around the corner that sees most of the polygon from its front, so that quads which are not
    convex do not fold over.
    """
    count, corners = polygons.shape
    if corners == 3:
        return polygons[:, None, :]
    fans, worst = [], []
    for apex in range(corners):
        turned = np.roll(polygons, -apex, axis=1)
        fan = np.stack(
            [np.repeat(turned[:, :1], corners - 2, axis=1), turned[:, 1:-1], turned[:, 2:]], axis=2
        )
        a, b, c = (points[fan[:, :, corner]] for corner in range(3))
        areas = np.cross(b - a, c - a)
        # The sum is the same for all corners: the polygon's own.
        fronts = np.einsum("pkx,px->pk", areas, areas.sum(axis=1))
        fans.append(fan)
        worst.append(fronts.min(axis=1))
    best: NDArray[Any] = np.stack(fans)[np.argmax(worst, axis=0), np.arange(count)]
    return best


def triangles_of(mesh: meshio.Mesh, points: NDArray[Any]) -> tuple[NDArray[Any], dict[str, Any]]:
    """The mesh in triangles (F, 3), and its cells' data for them.

    Vertices and lines that are cells of their own are left out.
    """
    others = {block.type for block in mesh.cells} - {*SURFACES, *CURVES}
    if others:
        listed, known = ", ".join(sorted(others)), ", ".join(SURFACES)
        raise InputError(f"`mesh` has cells of type {listed}; give those of its surface as {known}")
    triangles, counts = [np.empty((0, 3), int)], {}
    for place, block in enumerate(mesh.cells):
        if block.type in CURVES:
            continue
        polygons = np.asarray(block.data)
        if polygons.ndim != 2 or polygons.shape[1] < 3 or polygons.dtype.kind not in "iu":
            raise InputError(f"`mesh.cells[{place}]` needs at least three corners per cell; give indices")
        if polygons.size and not 0 <= polygons.min() <= polygons.max() < len(points):
            raise InputError(f"`mesh.cells[{place}]` has indices of no point; there are {len(points)} points")
        triangles.append(split(polygons, points).reshape(-1, 3))
        counts[place] = polygons.shape[1] - 2
    data = {}
    for name, blocks in mesh.cell_data.items():
        arrays = [np.repeat(np.asarray(blocks[place]), count, axis=0) for place, count in counts.items()]
        if len({array.shape[1:] for array in arrays}) > 1:
            raise InputError(f"`mesh.cell_data['{name}']` has more columns in one block than in another")
        if arrays:
            data[name] = np.concatenate(arrays)
    return np.concatenate(triangles), data


def sets_of(mesh: meshio.Mesh) -> dict[str, NDArray[Any]]:
    """For each set of cells whether a triangle is of it."""
    found: dict[str, NDArray[Any]] = {}
    for name, blocks in mesh.cell_sets.items():
        parts = []
        for place, block in enumerate(mesh.cells):
            if block.type in CURVES:
                continue
            is_in = np.zeros(len(block.data), np.uint8)
            members = blocks[place] if place < len(blocks) else None
            if members is not None and len(members):
                is_in[np.asarray(members, dtype=int)] = 1
            parts.append(np.repeat(is_in, np.asarray(block.data).shape[1] - 2))
        found[Alias(SET + name, name)] = np.concatenate(parts) if parts else np.empty(0, np.uint8)
    return found


def points_of(mesh: meshio.Mesh) -> tuple[NDArray[Any], bool]:
    """The points in space, and whether they are given in the plane."""
    points = np.asarray(mesh.points, dtype=float)
    flat = points.ndim == 2 and points.shape[1] == 2
    if flat:
        points = np.column_stack([points, np.zeros(len(points))])
    if points.ndim != 2 or points.shape[1] != 3:
        raise InputError(f"`mesh.points` has shape {points.shape}; give (V, 3) or (V, 2)")
    return points, flat


def shape_of(mesh: Any, name: str) -> Shape:
    """The parts of a mesh."""
    if not isinstance(mesh, meshio.Mesh):
        raise InputError(f"`{name}` is a {type(mesh).__name__}, not a meshio.Mesh")
    points, _ = points_of(mesh)
    faces, face = triangles_of(mesh, points)
    # Data with the name of a set keeps it.
    sets = {called(name): array for name, array in sets_of(mesh).items()}
    face = {**sets, **face}
    return Shape(points, faces, Attributes(dict(mesh.point_data), face))


@keywords
def remesh(
    mesh: meshio.Mesh,
    n: int | str | None = None,
    *,
    attributes: bool = True,
    distances: bool = False,
    progress: bool | Callback = False,
    device: str | int | None = None,
    device_memory: int | None = None,
    remesher: Remesher | None = None,
    **options: Unpack[Options],
) -> meshio.Mesh:
    """A new mesh of exactly `n` points with well-shaped triangles; `mesh` stays as it is.

    Its cells must be triangles, quads or polygons, of which the latter are triangulated; vertices and lines
    among them, as Gmsh writes them, are left out. `point_data` and `cell_data` come along as
    `rtfmesh.Attributes` says, `cell_sets` as labels, `field_data` as it is; sets of points do not.
    `attributes=False` leaves all but `field_data` behind. Points in the plane, (V, 2), stay there. The report
    is in `info["rtfmesh"]`. `remesher` is a `rtfmesh.Remesher` to use; all other arguments and what is raised
    are as in `rtfmesh.remesh`.
    """
    if not isinstance(mesh, meshio.Mesh):
        raise InputError(f"`mesh` is a {type(mesh).__name__}, not a meshio.Mesh")
    points, flat = points_of(mesh)
    faces, face_data = triangles_of(mesh, points)
    face_data.update(sets_of(mesh))
    told, wanted = Told(correspondence=False, distances=distances, progress=progress), dict(options)
    given = Attributes(dict(mesh.point_data), face_data) if brings_own(attributes) else Attributes()

    def run(remesher: Remesher) -> Result:
        return remesher._run(points, faces, n, given, told, wanted)

    result = warned(on_device(remesher, device, device_memory, told, run))
    face = result.attributes.face
    return meshio.Mesh(
        result.vertices[:, :2] if flat else result.vertices,
        [("triangle", result.faces.astype(np.int64))],
        point_data=result.attributes.vertex,
        cell_data={name: [array] for name, array in face.items() if not name.startswith(SET)},
        cell_sets={
            name.removeprefix(SET): [np.flatnonzero(array)]
            for name, array in face.items()
            if name.startswith(SET)
        },
        field_data=copy.deepcopy(mesh.field_data),
        info={"rtfmesh": result.report},
    )
