"""Reading and writing mesh files."""

from __future__ import annotations

import difflib
import os
import warnings
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Protocol

from numpy.typing import ArrayLike

from . import _native
from ._arrays import Faces, Vertices, mesh_arrays, short, truth
from ._attributes import Attributes, Carrier, for_files, read_attributes
from ._errors import Error, InputError, MeshWarning
from ._objects import MeshLike, given_mesh, is_object
from ._words import keywords


@dataclass(frozen=True, eq=False)
class Mesh:
    """A mesh as read from a file: triangulated, but not cleaned."""

    vertices: Vertices
    """Positions in the file's units, shape (V, 3)."""
    faces: Faces
    """Indices of vertices, shape (F, 3)."""
    attributes: Attributes
    """Colours, texture coordinates, labels and the like."""
    notes: list[str] = field(default_factory=list)
    """What was left out of the file or changed."""

    def __iter__(self) -> Iterator[Any]:
        """Vertices and faces: `vertices, faces = mesh`."""
        return iter((self.vertices, self.faces))

    def _repr_html_(self) -> str:
        """A picture and the counts, for notebooks."""
        from ._notebook import html

        return html(self, {"vertices": len(self.vertices), "faces": len(self.faces)})

    def __repr__(self) -> str:
        return f"<rtfmesh.Mesh: {len(self.vertices)} vertices, {len(self.faces)} faces>"


# What is said of a name like that of a file in memory.
NAMELESS = "the file name has no extension"


def path_of(path: Any) -> Path:
    """The path of a file."""
    if not isinstance(path, (str, os.PathLike)):
        order = " first, then the mesh" if is_object(path) else ""
        raise InputError(f"`path` is of type {type(path).__name__}; give the name of a file{order}")
    return Path(path)


def checked(format: Any) -> str | None:
    """The name of a format, whose being known is the native module's business."""
    if format is not None and not isinstance(format, str):
        raise InputError(f"`format` is {short(format)}; give an extension such as 'ply'")
    return format


class SupportsRead(Protocol):
    """An open file, or something like one."""

    def read(self) -> str | bytes: ...


@keywords
def read(
    path: str | os.PathLike[str] | SupportsRead,
    *,
    format: str | None = None,
    materials: bool = False,
    points: bool = False,
) -> Mesh:
    """Reads OBJ, PLY, STL, OFF, glTF, MEDIT .mesh, 3MF or VTK's .vtp, .vtu and .vtk, plain or gzipped.

    What a file contains counts more than its name; `format` stands for what its name would say. `materials`
    reads materials of glTF, OBJ and 3MF and their images too, which `write` puts into a .glb. With `points`,
    files may have points without faces, as PCD (.pcd), LAS (.las, .laz), E57 (.e57) and lines of numbers
    (.xyz, .txt, .csv, .asc, .pts) do: `faces` is empty then, and `attributes.vertex` may have a "normal".

    `path` may also be an open file or a `BytesIO`; other files that its content refers to are not found then.

    Raises `InputError` with the place in the file.
    """
    wanted = checked(format), truth(materials, "materials"), truth(points, "points")
    if not isinstance(path, (str, os.PathLike)) and hasattr(path, "read"):
        return _read_object(path, wanted)
    arrays, attributes, notes = _native.read(path_of(path), *wanted)
    return Mesh(*arrays, read_attributes(attributes), notes)


def _read_object(file: SupportsRead, wanted: tuple[str | None, bool, bool]) -> Mesh:
    """Reads what an open file has, by way of one on disk."""
    # Takes a while to import.
    from tempfile import TemporaryDirectory

    content = file.read()
    if not isinstance(content, (str, bytes, bytearray, memoryview)):
        raise InputError(f"`path` has a read() that gives {short(content)}; give a file with text or bytes")
    data = content.encode() if isinstance(content, str) else bytes(content)
    if not data:
        raise InputError("`path` has nothing left to read; rewind it with seek(0), or give another file")
    own = getattr(file, "name", "")
    # Of a file without a name, the content or `format` says what it is.
    name = Path(own).name if isinstance(own, str) else ""
    with TemporaryDirectory() as folder:
        path = Path(folder) / (name or "file")
        path.write_bytes(data)
        try:
            arrays, attributes, notes = _native.read(path, *wanted)
        except Error as error:
            text = str(error).replace(f"{folder}{os.sep}", "")
            if not name:
                text = text.replace("file: ", "`path`: ", 1).replace(
                    NAMELESS, "the content is of no known format"
                )
            raise type(error)(text) from None
    notes = [note for note in notes if name or NAMELESS not in note]
    return Mesh(*arrays, read_attributes(attributes), notes)


@keywords
def write(
    path: str | os.PathLike[str],
    vertices: ArrayLike | MeshLike,
    faces: ArrayLike | None = None,
    *,
    attributes: Attributes | Mapping[str, Any] | bool | None = None,
    format: str | None = None,
) -> None:
    """Writes OBJ, OFF, MEDIT, PLY, 3MF, VTP, VTU, VTK (float64), STL or GLB (float32), with .gz packed.

    `vertices` has shape (V, 3), `faces` (F, 3), or both are one object, which is written with its attributes;
    `attributes` as in `remesh`. The name's extension decides on the format unless `format` does. The file is
    written whole or not at all.

    Raises `InputError`, or `OutputError` where it cannot be written. Warns (`MeshWarning`) of what the format
    cannot hold.
    """
    path, format = path_of(path), checked(format)
    shape = given_mesh(vertices, faces, attributes)
    mesh = mesh_arrays(shape.vertices, shape.faces)
    given = Carrier.of(for_files(shape.attributes), len(mesh[0]), len(mesh[1])).given
    for note in _native.write(path, mesh, given, format):
        warnings.warn(f"{os.fspath(path)}: {note}", MeshWarning, stacklevel=3)


@keywords
def sample(name: str) -> Mesh:
    """A built-in model, such as "genus3" or "torus"; an `InputError` for another name lists them."""
    if not isinstance(name, str):
        raise InputError(f"`name` is {short(name)}; give a word such as 'genus3'")
    try:
        return Mesh(*_native.sample(name), Attributes())
    except InputError as error:
        names = str(error).partition("choose one of ")[2].split(", ")
        close = difflib.get_close_matches(name.lower(), names, 1)
        meant = f"there is no built-in model {name!r}; did you mean {close[0]!r}?" if close else error
        raise InputError(f"`name`: {meant}") from None
