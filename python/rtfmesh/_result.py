"""What a run gives."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ._arrays import Faces, Vertices, as_array, check_shape, indices
from ._attributes import Attributes
from ._errors import InputError


@dataclass(frozen=True, eq=False)
class Correspondence:
    """Where N points of a result lie on the input."""

    triangles: NDArray[np.uint32]
    """The input's face under each point, shape (N,)."""
    barycentrics: NDArray[np.float64]
    """The weights of that face's corners, each 0 to 1 and together 1, shape (N, 3)."""

    def interpolate(self, faces: ArrayLike, values: ArrayLike) -> NDArray[Any]:
        """Values at the vertices of the input, shape (V, ...), linearly interpolated at the points, (N, ...).

        `faces` are the input's, as they were remeshed.
        """
        check_shape(np.asarray(self.triangles), "triangles", (None,))
        check_shape(np.asarray(self.barycentrics), "barycentrics", (len(self.triangles), 3))
        array = as_array(values, "values")
        if array.ndim == 0 or array.dtype.kind not in "fiubc":
            have = f"shape {array.shape} and values of type {array.dtype}"
            raise InputError(f"`values` has {have}; give numbers, a row for each vertex of the input")
        triangles = indices(faces, "faces", 3, len(array))
        if self.triangles.size and self.triangles.max() >= len(triangles):
            have = f"{len(triangles)} rows, and the input had more than {self.triangles.max()}"
            raise InputError(f"`faces` has {have}; give those that were remeshed")
        corners = array[triangles[self.triangles]]
        interpolated: NDArray[Any] = np.einsum("nk,nk...->n...", self.barycentrics, corners)
        return interpolated


@dataclass(frozen=True, eq=False)
class Cells:
    """The cells of a result's vertices as P polygons, each a flat part of one cell."""

    kind: str
    """"tangent" for faces in tangent planes, "exact" for Voronoi cells on the input."""
    vertices: Vertices
    """Corners of all polygons, shape (C, 3)."""
    corners: NDArray[np.uint32]
    """Indices of vertices: those of polygon k are corners[starts[k]:starts[k + 1]]."""
    starts: NDArray[np.uint32]
    """Shape (P + 1,)."""
    cells: NDArray[np.uint32]
    """The vertex of the result whose cell each polygon is a part of, ascending, shape (P,)."""

    def polygons(self) -> list[NDArray[np.uint32]]:
        """The corners of each polygon."""
        return np.split(self.corners, self.starts[1:-1])


@dataclass(frozen=True, eq=False)
class Result:
    """A new mesh of N vertices and M faces."""

    vertices: Vertices
    """Positions in the input's units, shape (N, 3)."""
    faces: Faces
    """Indices of vertices, counter-clockwise seen from outside, shape (M, 3)."""
    report: dict[str, Any]
    """What the command line's --report has: options, device, topology, quality, warnings, timings."""
    correspondence: Correspondence | None
    """Where the vertices lie on the input; None with `correspondence=False` unless attributes needed it, and
    of points and volumes."""
    face_correspondence: Correspondence | None
    """Where the centres of the faces lie on it, if attributes of faces or texture were carried."""
    attributes: Attributes
    """The input's attributes for this mesh."""
    cells: Cells | None = None
    """The cells of the vertices, with `cells=True`."""

    def __iter__(self) -> Iterator[Any]:
        """Vertices and faces: `vertices, faces = result`."""
        return iter((self.vertices, self.faces))

    def _repr_html_(self) -> str:
        """A picture and the most important figures, for notebooks."""
        from ._notebook import html

        output = self.report["output"]
        quality, distances = output["quality"], output["distances"]
        figures = {
            "vertices": len(self.vertices),
            "faces": len(self.faces),
            "mean quality": f"{quality['mean_quality']:.3f}",
            "smallest angle": f"{quality['min_angle']:.1f}°",
        }
        if distances:
            figures["RMS distance"] = f"{distances['rms']:.4f} % of the diagonal"
        figures.update({f"warning {k + 1}": text for k, text in enumerate(self.report["warnings"])})
        return html(self, figures)

    def __repr__(self) -> str:
        quality = self.report["output"]["quality"]
        shape = f"rtfmesh.Result: {len(self.vertices)} vertices, {len(self.faces)} faces"
        return f"<{shape}, quality {quality['mean_quality']:.3f}, angles from {quality['min_angle']:.1f}°>"


@dataclass(frozen=True, eq=False, repr=False)
class LocatedResult(Result):
    """A result with its correspondence, as `remesh` gives it unless `correspondence=False`."""

    correspondence: Correspondence
    """Where the vertices lie on the input."""
