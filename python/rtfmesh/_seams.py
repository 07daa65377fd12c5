"""Texture coordinates of corners, for packages that have them at vertices."""

from __future__ import annotations

import warnings
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from ._arrays import Faces
from ._errors import MeshWarning
from ._result import Result

if TYPE_CHECKING:
    from ._files import Mesh


@dataclass
class Split:
    """A mesh whose vertices each have one pair of texture coordinates."""

    vertices: NDArray[np.intp]
    """The vertex of the result that each vertex is, shape (N,)."""
    faces: Faces
    """Shape (M, 3)."""
    uv: NDArray[Any] | None
    """Shape (N, 2)."""


def split_at_seams(result: Mesh | Result, keep_uv: bool) -> Split:
    """The result with a vertex for each pair of texture coordinates that there is at it, if seams were kept.

    If not, each vertex stays one, and has the coordinates of one of its faces; a warning says so where that
    matters.
    """
    count, uv = len(result.vertices), result.attributes.uv
    if uv is None:
        return Split(np.arange(count), result.faces, None)
    corners = result.faces.ravel().astype(np.intp)
    flat = uv.reshape(-1, 2)
    rows = np.column_stack([corners, flat])
    _, first, of_corner = np.unique(rows, axis=0, return_index=True, return_inverse=True)
    if keep_uv:
        return Split(corners[first], of_corner.reshape(-1, 3).astype(np.uint32), flat[first])
    vertices, one = np.unique(corners, return_index=True)
    if len(first) > len(vertices):
        text = "texture coordinates jump where faces cross seams; keep_uv=True puts vertices on these"
        warnings.warn(text, MeshWarning, stacklevel=4)
    at_vertices = np.zeros((count, 2), dtype=flat.dtype)
    at_vertices[vertices] = flat[one]
    return Split(np.arange(count), result.faces, at_vertices)
