"""Meshes of this package and of others as one argument, in place of vertices and faces."""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ._arrays import (
    Faces,
    Vertices,
    dimensions,
    finite,
    mesh_arrays,
    real_numbers,
    short,
    surface_arrays,
    with_extent,
)
from ._attributes import Attributes
from ._errors import InputError


class HasMesh(Protocol):
    """Anything with vertices (V, 3) and faces (F, 3): a `Mesh`, a `Result`, a trimesh.Trimesh."""

    @property
    def vertices(self) -> Any: ...

    @property
    def faces(self) -> Any: ...


class HasPoints(Protocol):
    """Anything with points: a mesh of PyVista or meshio, a point cloud of Open3D."""

    @property
    def points(self) -> Any: ...


class HasTriangles(Protocol):
    """Anything with vertices (V, 3) and triangles (F, 3): a mesh of Open3D."""

    @property
    def vertices(self) -> Any: ...

    @property
    def triangles(self) -> Any: ...


class HasPointCount(Protocol):
    """Anything that counts its points as VTK does: a vtkPolyData or another data set."""

    def GetNumberOfPoints(self) -> int: ...


MeshLike = HasMesh | HasPoints | HasTriangles | HasPointCount | tuple[ArrayLike, ArrayLike]
WHAT = "an rtfmesh, trimesh, PyVista, VTK, meshio or Open3D mesh, or vertices and faces"


@dataclass
class Shape:
    """The parts of a mesh."""

    vertices: Any
    faces: Any
    attributes: Attributes = field(default_factory=Attributes)


def package(value: object) -> str:
    """The package that a class comes from, or one that it inherits from.

    PyVista's classes inherit from VTK's, and come first.
    """
    known = ("trimesh", "pyvista", "meshio", "open3d", "vtkmodules")
    names = [base.__module__.partition(".")[0] for base in type(value).__mro__]
    return next((name for name in names if name in known), names[0])


def is_pair(value: object) -> bool:
    """Whether this is (vertices, faces)."""
    if not (isinstance(value, (tuple, list)) and len(value) == 2):
        return False
    first = value[0]
    found = dimensions(first)
    if found is None and isinstance(first, (list, tuple)):
        # Either rows of different lengths, or a pair itself, of two meshes.
        return all(dimensions(row) in (0, 1) for row in first)
    return found == 2


def is_object(value: object) -> bool:
    """Whether this is a whole mesh, and no array."""
    if is_pair(value):
        return True
    if isinstance(value, (np.ndarray, list, tuple, str, bytes, os.PathLike)) or hasattr(value, "__array__"):
        return False
    if package(value) == "vtkmodules":
        # But for its arrays.
        return not hasattr(value, "GetNumberOfTuples")
    return any(
        hasattr(value, name) for name in ("vertices", "points", "to_mesh", "extract_surface", "combine")
    )


def shape_of(value: Any, name: str) -> Shape:
    """The vertices, faces and attributes of a mesh of any of these packages."""
    own = package(value)
    if is_pair(value):
        return Shape(*value)
    if own == "trimesh":
        from .trimesh import shape_of as of_trimesh

        return of_trimesh(value, name)
    if own == "pyvista":
        from .pyvista import shape_of as of_pyvista

        return of_pyvista(value, name)
    if own == "meshio":
        from .meshio import shape_of as of_meshio

        return of_meshio(value, name)
    if own == "vtkmodules":
        from .vtk import shape_of as of_vtk

        return of_vtk(value, name)
    if hasattr(value, "vertices") and hasattr(value, "faces"):
        attributes = getattr(value, "attributes", None)
        own_ones = attributes if isinstance(attributes, Attributes) else Attributes()
        return Shape(value.vertices, value.faces, own_ones)
    if hasattr(value, "vertices") and hasattr(value, "triangles"):
        return of_open3d(value)
    if hasattr(value, "points"):
        return of_cloud(value)
    raise InputError(f"`{name}` is {short(value)}, not a mesh; give {WHAT}")


def of_open3d(mesh: Any) -> Shape:
    """Of a triangle mesh of Open3D, with its colours."""
    colours = np.asarray(getattr(mesh, "vertex_colors", ()))
    vertex = {"colors": colours} if len(colours) else {}
    return Shape(np.asarray(mesh.vertices), np.asarray(mesh.triangles), Attributes(vertex))


def of_cloud(cloud: Any) -> Shape:
    """Of points such as Open3D's, with their normals and colours."""
    found = {name: np.asarray(getattr(cloud, name, ())) for name in ("normals", "colors")}
    vertex = {name: array for name, array in found.items() if array.ndim == 2 and len(array)}
    return Shape(np.asarray(cloud.points), np.empty((0, 3), np.uint32), Attributes(vertex))


def mesh_of(mesh: Any, name: str, others: str = "") -> Shape:
    """The parts of a whole mesh; `others` is what may stand for it besides."""
    if not is_object(mesh):
        raise InputError(f"`{name}` is {short(mesh)}, not a mesh; give {others}{WHAT}")
    return shape_of(mesh, name)


def arrays_of(mesh: Any, name: str) -> tuple[Vertices, Faces]:
    """The arrays of a mesh with faces, checked."""
    shape = mesh_of(mesh, name)
    positions, triangles = surface_arrays(shape.vertices, shape.faces, (f"{name}.vertices", f"{name}.faces"))
    return with_extent(positions, f"{name}.vertices"), triangles


def reference_of(against: Any) -> tuple[Vertices, Faces]:
    """What a mesh is compared with: another one, or points."""
    if is_object(against) or not isinstance(against, (np.ndarray, list)):
        shape = mesh_of(against, "against")
        names = "against.vertices", "against.faces"
        positions, triangles = mesh_arrays(shape.vertices, shape.faces, names)
        return with_extent(positions, names[0]), triangles
    points = finite(real_numbers(against, "against", (None, 3)), "against")
    return with_extent(points, "against"), np.empty((0, 3), np.uint32)


def given_mesh(vertices: Any, faces: Any, attributes: Any = None) -> Shape:
    """The mesh that a function's first two arguments are, with its attributes unless others are given."""
    if not is_object(vertices):
        if faces is None or isinstance(faces, (int, np.integer)):
            read = "read the file with rtfmesh.read first"
            is_path = isinstance(vertices, (str, bytes, os.PathLike))
            if is_path:
                raise InputError(f"`vertices` is {short(vertices)}; {read}")
            what = "rtfmesh.reconstruct makes a surface through points"
            raise InputError(f"`faces` is missing; give {WHAT}; {what}")
        return Shape(vertices, faces, Attributes.of(attributes))
    if faces is not None:
        raise InputError("`faces` is given with a whole mesh; remove it, or give arrays for both")
    return with_attributes(shape_of(vertices, "vertices"), attributes)


def with_attributes(shape: Shape, attributes: Any) -> Shape:
    """The mesh with these attributes in place of its own, if there are others."""
    if attributes is None or attributes is True:
        return shape
    return Shape(shape.vertices, shape.faces, Attributes.of(attributes))


def with_count(vertices: Any, faces: Any, n: Any) -> tuple[Any, Any]:
    """The faces and the count, where after a whole mesh the count is the second argument."""
    if faces is None or n is not None or not is_object(vertices) or dimensions(faces) != 0:
        return faces, n
    return None, faces


def given_points(
    points: Any, normals: Any, attributes: Attributes | Mapping[str, Any] | bool | None
) -> tuple[Any, NDArray[Any] | Any, Attributes]:
    """The points that an argument is, with the normals and attributes that come with them."""
    if not is_object(points) or is_pair(points):
        return points, normals, Attributes.of(attributes)
    shape = shape_of(points, "points")
    if len(shape.faces):
        raise InputError("`points` has faces; use rtfmesh.remesh, or give its vertices alone")
    vertex = dict(shape.attributes.vertex)
    own = [name for name in vertex if name.lower() in ("normal", "normals") and vertex[name].ndim == 2]
    found = [vertex.pop(name) for name in own]
    if normals is None and found:
        normals = found[0]
    brings = attributes is None or attributes is True
    return shape.vertices, normals, Attributes(vertex) if brings else Attributes.of(attributes)
