"""Values on a grid, as the native module takes them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ._arrays import as_array, check_shape, real_number, real_numbers, short
from ._errors import InputError


@dataclass(frozen=True)
class Grid:
    """Values at nodes, and where these are."""

    values: NDArray[np.float32]
    """Those along the first axis side by side, shape (X * Y * Z,)."""
    size: tuple[int, int, int]
    """X, Y, Z: nodes along each axis, at least 2."""
    frame: list[list[float]]
    """The place of node i, j, k is this 4 x 4 matrix times (i, j, k, 1)."""


@dataclass(frozen=True)
class Volume:
    """A grid, and which surface in it is wanted."""

    grid: Grid
    iso: list[float]
    """The values on the surfaces; none for the borders of labels."""
    inside: str | None
    closed: bool
    keep_specks: bool

    def native(self) -> tuple[Any, ...]:
        """As the native module takes it."""
        grid = self.grid
        return grid.values, grid.size, grid.frame, self.iso, self.inside, self.closed, self.keep_specks


def grid_of(
    values: ArrayLike, spacing: ArrayLike | None, origin: ArrayLike | None, affine: ArrayLike | None
) -> Grid:
    """A grid of `values`, shape (X, Y, Z), checked."""
    array = as_array(values, "values")
    if array.dtype.kind not in "fiub":
        raise InputError(f"`values` has values of type {array.dtype}; give real numbers")
    check_shape(array, "values", (None, None, None))
    if min(array.shape) < 2:
        raise InputError(f"`values` has shape {array.shape}; give at least two along each axis")
    x, y, z = array.shape
    flat = np.asarray(array.ravel(order="F"), np.float32)
    return Grid(np.ascontiguousarray(flat), (x, y, z), frame_of(spacing, origin, affine))


def frame_of(
    spacing: ArrayLike | None, origin: ArrayLike | None, affine: ArrayLike | None
) -> list[list[float]]:
    """The matrix from a node's indices to its place."""
    if affine is None:
        lengths = np.ones(3) if spacing is None else real_numbers(spacing, "spacing", (3,))
        if not (np.isfinite(lengths).all() and (lengths > 0).all()):
            raise InputError(f"`spacing` is {spacing!r}; give three lengths above 0")
        frame = np.diag([*lengths, 1.0])
        if origin is not None:
            frame[:3, 3] = real_numbers(origin, "origin", (3,))
            if not np.isfinite(frame).all():
                raise InputError(f"`origin` is {origin!r}; give three finite numbers")
    else:
        if spacing is not None:
            raise InputError("`affine` already contains the spacing; remove `spacing`")
        if origin is not None:
            raise InputError("`affine` already contains the origin; remove `origin`")
        frame = real_numbers(affine, "affine", (4, 4))
        is_affine = np.isfinite(frame).all() and np.array_equal(frame[3], [0, 0, 0, 1])
        if not is_affine or np.linalg.det(frame[:3, :3]) == 0:
            raise InputError("`affine` must be an invertible matrix with last row 0, 0, 0, 1")
    rows: list[list[float]] = frame.tolist()
    return rows


def volume_of(
    grid: Grid,
    iso: float | Sequence[float] | None,
    labels: bool | int | Sequence[int],
    inside: str | None,
    closed: bool,
    keep_specks: bool,
) -> Volume:
    """The surface that is asked for, checked."""
    if not isinstance(labels, (bool, np.bool_)):
        grid, labels = only(grid, labels), True
    for name, value in (("closed", closed), ("keep_specks", keep_specks)):
        if not isinstance(value, (bool, np.bool_)):
            raise InputError(f"`{name}` is of type {type(value).__name__}; use True or False")
    if (iso is None) != bool(labels):
        raise InputError("give either `iso`, the value on the surface, or `labels=True`")
    if labels and not grid.values.any():
        raise InputError("`values` are all 0, which is outside; give at least one label above 0")
    if labels and inside is not None:
        raise InputError("`inside` works only with `iso`; remove it")
    if inside is not None and not isinstance(inside, str):
        raise InputError(f"`inside` is {inside!r}; use 'above' or 'below'")
    return Volume(grid, isovalues(iso), inside, bool(closed), bool(keep_specks))


def isovalues(iso: float | Sequence[float] | None) -> list[float]:
    """One value or several, checked."""
    if iso is None:
        return []
    if isinstance(iso, str) or not hasattr(iso, "__len__") or getattr(iso, "ndim", 1) == 0:
        return [real_number(iso, "iso")]
    values = real_numbers(iso, "iso", (None,))
    if not values.size:
        raise InputError("`iso` is empty; give a number or several, such as [100, 300]")
    if len(np.unique(values)) < len(values):
        raise InputError(f"`iso` is {short(iso)}; give each value once")
    return [float(value) for value in values]


def only(grid: Grid, labels: int | Sequence[int]) -> Grid:
    """The grid with 0 in place of all other labels."""
    try:
        wanted = np.atleast_1d(np.asarray(labels))
    except ValueError:
        wanted = np.empty(0)
    if wanted.ndim != 1 or wanted.dtype.kind not in "iu" or not wanted.size or wanted.min() < 1:
        raise InputError(f"`labels` is {short(labels)}; give True, or labels above 0 such as [1, 2]")
    found = np.isin(grid.values, wanted)
    missing = wanted[~np.isin(wanted, grid.values[found])]
    if missing.size:
        raise InputError(f"`labels` has {missing[0]}, which is none of the values; leave it out")
    return replace(grid, values=np.where(found, grid.values, np.float32(0)))
