"""Repairs without remeshing."""

from __future__ import annotations

import json
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import _native
from ._arrays import Faces, Vertices, surface_arrays
from ._objects import MeshLike, given_mesh
from ._words import keywords, words


@dataclass(frozen=True, eq=False)
class Repaired:
    """A repaired mesh of N vertices and M faces."""

    vertices: Vertices
    """Positions, shape (N, 3). Vertices that no repair moved are the input's, bit by bit, in its order."""
    faces: Faces
    """Indices of vertices, shape (M, 3). Those that fill holes come last."""
    origin: NDArray[np.uint32]
    """The input's face that each face comes from or, of those that fill holes, lies beside; shape (M,)."""
    repairs: dict[str, int]
    """What was repaired, as counts: those of `report["repaired"]`."""
    notes: list[str]
    """The same in words; empty if only duplicate or unused vertices went."""

    def __iter__(self) -> Iterator[Any]:
        """Vertices and faces: `vertices, faces = repaired`."""
        return iter((self.vertices, self.faces))

    def __repr__(self) -> str:
        return f"<rtfmesh.Repaired: {len(self.vertices)} vertices, {len(self.faces)} faces>"


@keywords
def repair(
    vertices: ArrayLike | MeshLike,
    faces: ArrayLike | None = None,
    *,
    weld: float | None = None,
    min_component: float | None = None,
    smooth_boundary: float | None = None,
    smooth_spikes: bool = False,
    fill_holes: float | str | None = None,
    outer: bool = False,
) -> Repaired:
    """Repairs a mesh without remeshing it; as `rtfmesh repair`.

    The mesh is vertices (V, 3) and faces (F, 3), or in place of both one object, as in `remesh`. Duplicate
    vertices and faces, faces without an area and cracks within rounding always go, and faces that disagree
    with their neighbours are turned. The options ask for more, with the same meaning as in `remesh`, such as
    `fill_holes="100%"` and `outer=True`. All else stays as it is. Attributes are not carried over; `origin`
    tells where each face comes from.

    Raises `InputError`.
    """
    shape = given_mesh(vertices, faces)
    options = {
        "weld": weld,
        "min_component": min_component,
        "smooth_boundary": smooth_boundary,
        "smooth_spikes": smooth_spikes,
        "fill_holes": fill_holes,
        "outer": outer,
    }
    found = _native.repair(surface_arrays(shape.vertices, shape.faces), words(None, options))
    (new, triangles), origin, repairs, notes = found
    return Repaired(new, triangles, origin, json.loads(repairs), notes)
