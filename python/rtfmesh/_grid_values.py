"""Further values of a grid, at points in it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ._arrays import Vertices, as_array
from ._attributes import Attributes, role
from ._errors import InputError


@dataclass(frozen=True)
class GridValues:
    """Arrays with a value, or a row of values, for each node of a grid."""

    frame: list[list[float]]
    """As in `Grid`."""
    arrays: Mapping[str, NDArray[Any]]
    """By name: shape (X, Y, Z, ...)."""
    label_names: Mapping[str, list[str]] = field(default_factory=dict)
    """As in `Attributes`."""

    def at(self, points: Vertices) -> dict[str, NDArray[Any]]:
        """The arrays at points, each of shape (P, ...): interpolated or, for labels, of the nearest node."""
        inverse = np.linalg.inv(np.asarray(self.frame))
        places = points @ inverse[:3, :3].T + inverse[:3, 3]
        return {name: values_at(name, array, places) for name, array in self.arrays.items()}


def values_at(name: str, array: NDArray[Any], places: Vertices) -> NDArray[Any]:
    """The values of one array at places, which are in units of nodes; beyond the border, those at it."""
    last = np.asarray(array.shape[:3]) - 1
    places = places.clip(0, last)
    means = role(name, int(np.prod(array.shape[3:], dtype=int)), array.dtype)
    if array.dtype.kind not in "fc" and (means != "colour" or array.dtype.kind not in "iu"):
        nearest: NDArray[Any] = array[tuple(np.rint(places).astype(np.intp).T)]
        return nearest
    low = np.minimum(places.astype(np.intp), np.maximum(last - 1, 0))
    fraction = places - low
    found: NDArray[Any] = np.zeros((len(places), *array.shape[3:]), np.result_type(array.dtype, np.float64))
    for corner in np.ndindex(2, 2, 2):
        weights = np.where(corner, fraction, 1 - fraction).prod(axis=1).reshape(-1, *[1] * (array.ndim - 3))
        values = array[tuple(np.minimum(low + corner, last).T)]
        # A value that is not finite counts only where it has a weight.
        with np.errstate(invalid="ignore"):
            found += np.where(weights > 0, weights * values, 0)
    if means == "normal":
        lengths = np.linalg.norm(found, axis=1, keepdims=True)
        found = np.divide(found, lengths, out=found, where=lengths > 0)
    return (np.rint(found) if array.dtype.kind in "iu" else found).astype(array.dtype)


def grid_values(
    attributes: Attributes | Mapping[str, Any] | bool | None,
    size: tuple[int, int, int],
    frame: list[list[float]],
    grid: str = "`values`",
) -> list[GridValues]:
    """The attributes of nodes that an argument has, checked; `grid` is what messages call the grid."""
    given = Attributes.of(attributes)
    of_faces = {"face": given.face or None, "uv": given.uv, "materials": given.materials}
    for name, value in of_faces.items():
        if value is not None:
            raise InputError(f"`attributes.{name}` needs faces, which a volume does not have; remove it")
    arrays = {}
    for name, value in given.vertex.items():
        array = as_array(value, f"attributes.vertex['{name}']")
        if array.shape[:3] != size:
            have = f"shape {array.shape}, but {grid} has {size}"
            remedy = "give an array of shape (X, Y, Z, ...)"
            if array.ndim == 1 and array.size == np.prod(size):
                remedy = "give array.reshape((X, Y, Z), order='F') if x changes fastest"
            raise InputError(f"`attributes.vertex['{name}']` has {have}; {remedy}")
        if array.dtype.kind not in "biufcUS":
            raise InputError(
                f"`attributes.vertex['{name}']` has values of type {array.dtype}; give numbers or strings"
            )
        arrays[str(name)] = array
    names = {name: of for name, of in given.label_names.items() if name in arrays}
    return [GridValues(frame, arrays, names)] if arrays else []
