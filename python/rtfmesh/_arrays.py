"""Arguments as the arrays that the native module takes."""

from __future__ import annotations

import os
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ._errors import InputError

Vertices = NDArray[np.float64]
Faces = NDArray[np.uint32]


def real_number(value: Any, name: str) -> float:
    """A number; what is out of range is found where it is used."""
    if isinstance(value, (bool, np.bool_, str)):
        raise InputError(f"`{name}` is {value!r}; give a number")
    try:
        return float(value)
    except (TypeError, ValueError):
        raise InputError(f"`{name}` is of type {type(value).__name__}; give a number") from None
    except OverflowError:
        raise InputError(f"`{name}` is too large; give a number below 1.8e308") from None


def truth(value: Any, name: str) -> bool:
    """True or False, and nothing that only counts as one."""
    if not isinstance(value, (bool, np.bool_)):
        raise InputError(f"`{name}` is {short(value)}; use True or False")
    return bool(value)


def one_of(value: Any, name: str, words: Sequence[str]) -> str:
    """One of some words."""
    if not isinstance(value, str) or value not in words:
        raise InputError(f"`{name}` {short(value)} is unknown; use {', '.join(words)}")
    return value


def whole_numbers(value: Any, name: str, count: int) -> list[int]:
    """So many whole numbers."""
    is_list = isinstance(value, (list, tuple, np.ndarray)) and dimensions(value) is not None
    array = np.asarray(value) if is_list else np.empty(0)
    if array.shape != (count,) or array.dtype.kind not in "iu" or array.min() < 0:
        raise InputError(f"`{name}` is {short(value)}; give {count} whole numbers")
    return [int(number) for number in array]


def short(value: Any) -> str:
    """The value as a message shows it: whole if it is short, else its type."""
    if isinstance(value, (str, int, float, type(None))) or type(value).__module__ == "numpy":
        text = repr(value)
        if len(text) <= 60 and "\n" not in text:
            return text
    if isinstance(value, (list, tuple)) and len(value) <= 4 and len(repr(value)) <= 60:
        return repr(value)
    return f"of type {type(value).__name__}"


def as_array(value: Any, name: str) -> NDArray[Any]:
    """The value as an array, whatever it was."""
    if isinstance(value, (str, bytes, os.PathLike)):
        hint = "read the file with rtfmesh.read first" if name in ("vertices", "points") else "give an array"
        raise InputError(f"`{name}` is {short(value)}; {hint}")
    try:
        return np.asarray(value)
    except (TypeError, ValueError) as error:
        if isinstance(value, (list, tuple)) and dimensions(value) is None:
            text = f"`{name}` has rows of different lengths; give rows of equal length"
            raise InputError(text) from None
        raise InputError(f"`{name}` is not an array: {error}") from error


def dimensions(value: object) -> int | None:
    """How many dimensions the value has as an array; None if its rows differ in length."""
    try:
        return np.ndim(value)  # type: ignore[arg-type]
    except ValueError:
        return None


def real_numbers(value: ArrayLike, name: str, shape: tuple[int | None, ...]) -> NDArray[np.float64]:
    """Real numbers in contiguous float64; None in `shape` stands for any length."""
    array = as_array(value, name)
    if array.ndim == 0 and array.dtype.kind == "O":
        kind = type(value).__name__
        raise InputError(f"`{name}` has values of type object: it is of type {kind}; give an array")
    if array.dtype.kind not in "fiu":
        raise InputError(f"`{name}` has values of type {array.dtype}; give real numbers")
    check_shape(array, name, shape)
    return np.ascontiguousarray(array, dtype=np.float64)


def finite(array: NDArray[np.float64], name: str) -> NDArray[np.float64]:
    """The rows of an array, if all of their values are finite."""
    if not np.isfinite(array).all():
        row = int(np.flatnonzero(~np.isfinite(array).all(axis=1))[0])
        raise InputError(f"`{name}` has a value in row {row} that is not finite; repair or remove such rows")
    return array


def with_extent(array: NDArray[np.float64], name: str) -> NDArray[np.float64]:
    """The rows of an array, unless there are none, or all are equal."""
    if not len(array):
        raise InputError(f"`{name}` is empty; give a row for each point")
    if (array == array[0]).all():
        raise InputError(f"`{name}` has the same point in all rows; give points of a surface")
    return array


def indices(value: ArrayLike, name: str, columns: int, count: int) -> Faces:
    """Indices below `count` in contiguous uint32, this many in each row."""
    array = as_array(value, name)
    if array.dtype.kind not in "iu":
        raise InputError(f"`{name}` has values of type {array.dtype}; give integers, indices of vertices")
    check_shape(array, name, (None, columns))
    if array.size and (array.min() < 0 or array.max() >= count):
        row = int(np.flatnonzero(((array < 0) | (array >= count)).any(axis=1))[0])
        text = (
            f"`{name}` has {array[row].tolist()} in row {row}; give indices of the {count} vertices, from 0"
        )
        raise InputError(text)
    return np.ascontiguousarray(array, dtype=np.uint32)


def check_shape(array: NDArray[Any], name: str, shape: tuple[int | None, ...]) -> None:
    """Raises `InputError` for another shape."""
    fits = array.ndim == len(shape) and all(
        w is None or w == n for w, n in zip(shape, array.shape, strict=True)
    )
    if not fits:
        wanted = ", ".join("N" if length is None else str(length) for length in shape)
        wanted += "," if len(shape) == 1 else ""
        raise InputError(f"`{name}` has shape {array.shape}; give one of shape ({wanted})")


def mesh_arrays(
    vertices: ArrayLike, faces: ArrayLike, names: tuple[str, str] = ("vertices", "faces")
) -> tuple[Vertices, Faces]:
    """Vertices (V, 3) and faces (F, 3), checked."""
    positions = finite(real_numbers(vertices, names[0], (None, 3)), names[0])
    return positions, indices(faces, names[1], 3, len(positions))


def surface_arrays(
    vertices: ArrayLike, faces: ArrayLike, names: tuple[str, str] = ("vertices", "faces")
) -> tuple[Vertices, Faces]:
    """As `mesh_arrays`, of a mesh that is not empty."""
    positions, triangles = mesh_arrays(vertices, faces, names)
    if not len(positions):
        raise InputError(f"`{names[0]}` is empty; give a mesh with vertices and faces")
    if not len(triangles):
        raise InputError(f"`{names[1]}` is empty; rtfmesh.reconstruct makes a surface of points")
    return positions, triangles
