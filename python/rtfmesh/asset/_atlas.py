"""Texture coordinates of a mesh, and the texels of its triangles."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
import xatlas
from numpy.typing import NDArray

from .._arrays import Faces, Vertices

# Texels between charts, as a share of the picture's side.
GUTTER = 1 / 512
# At least so many, for pictures that are drawn smaller.
LEAST_GUTTER = 2
# Texels that are looked at in one go.
CHUNK = 1 << 22


@dataclass
class Atlas:
    """A mesh cut into charts that lie side by side in a square picture."""

    uv: NDArray[np.float64]
    """Texture coordinates of the faces' corners, shape (F, 3, 2); v grows upwards."""
    charts: int


@dataclass
class Texels:
    """The texels of a picture that triangles cover, and the places of their centres on these."""

    side: int
    index: NDArray[np.int64]
    """Row times side plus column, ascending, shape (T,)."""
    face: NDArray[np.int64]
    """Shape (T,)."""
    weights: NDArray[np.float64]
    """Of the face's corners, shape (T, 3)."""


def unwrap(vertices: Vertices, faces: Faces, side: int) -> Atlas:
    """Cuts a mesh into charts for a picture of this many texels a side."""
    atlas = xatlas.Atlas()
    # Its lengths are absolute, and small numbers are nothing to it.
    low, high = vertices.min(axis=0), vertices.max(axis=0)
    atlas.add_mesh(((vertices - low) / np.linalg.norm(high - low)).astype(np.float32), faces)
    packing = xatlas.PackOptions()
    packing.resolution = side
    packing.padding = max(LEAST_GUTTER, round(side * GUTTER))
    cutting = xatlas.ChartOptions()
    cutting.fix_winding = True
    atlas.generate(cutting, packing)
    _, corners, flat = atlas[0]
    # Width and height are near the side that was asked for, and not equal.
    size = np.array([atlas.width, atlas.height])
    uv = flat[corners].astype(np.float64) * size / size.max()
    uv[..., 1] = 1.0 - uv[..., 1]
    return Atlas(uv, int(atlas.chart_count))


def texels(uv: NDArray[np.float64], side: int) -> Texels:
    """The texels of triangles with these texture coordinates; each triangle has one at least."""
    corners = np.stack([uv[..., 0] * side, (1.0 - uv[..., 1]) * side], axis=2)
    own = np.full(side * side, -1, dtype=np.int64)
    weights = np.zeros((side * side, 3), dtype=np.float32)
    covered = np.zeros(len(uv), dtype=bool)
    for inside, index, found in _inside(corners, side):
        own[index], weights[index] = inside, found
        covered[inside] = True
    # Triangles between the centres of texels.
    for face in np.flatnonzero(~covered):
        column, row = np.clip(corners[face].mean(axis=0).astype(np.int64), 0, side - 1)
        texel = int(row) * side + int(column)
        if own[texel] < 0:
            own[texel], weights[texel] = face, 1.0 / 3.0
    index = np.flatnonzero(own >= 0)
    return Texels(side, index, own[index], weights[index].astype(np.float64))


def _inside(
    corners: NDArray[np.float64], side: int
) -> Iterator[tuple[NDArray[np.int64], NDArray[np.int64], NDArray[np.float64]]]:
    """Faces, texels whose centres lie in these, and weights, in chunks."""
    low = np.clip(np.ceil(corners.min(axis=1) - 0.5), 0, side).astype(np.int64)
    high = np.clip(np.floor(corners.max(axis=1) - 0.5), -1, side - 1).astype(np.int64)
    width, height = np.maximum(high - low + 1, 0).T
    counts = width * height
    ends = np.cumsum(counts)
    begin = 0
    while begin < len(corners):
        before = ends[begin - 1] if begin else 0
        end = max(int(np.searchsorted(ends, before + CHUNK, side="right")), begin + 1)
        own = np.repeat(np.arange(begin, end), counts[begin:end])
        starts = ends[begin:end] - counts[begin:end] - before
        local = np.arange(len(own)) - np.repeat(starts, counts[begin:end])
        wide = np.maximum(width[own], 1)
        column, row = low[own, 0] + local % wide, low[own, 1] + local // wide
        found = _weights(corners[own], np.stack([column, row], axis=1) + 0.5)
        is_inside = (found >= -1e-9).all(axis=1)
        yield own[is_inside], (row * side + column)[is_inside], found[is_inside]
        begin = end


def _weights(corners: NDArray[np.float64], at: NDArray[np.float64]) -> NDArray[np.float64]:
    """The weights of triangles' corners (N, 3, 2) at points (N, 2); below 0 where there is no area."""

    def doubled(p: NDArray[np.float64], q: NDArray[np.float64]) -> NDArray[np.float64]:
        area: NDArray[np.float64] = p[:, 0] * q[:, 1] - p[:, 1] * q[:, 0]
        return area

    a, b, c = corners[:, 0] - at, corners[:, 1] - at, corners[:, 2] - at
    parts = np.stack([doubled(b, c), doubled(c, a), doubled(a, b)], axis=1)
    whole = parts.sum(axis=1, keepdims=True)
    found: NDArray[np.float64] = np.divide(parts, whole, out=np.full_like(parts, -1.0), where=whole != 0)
    return found
