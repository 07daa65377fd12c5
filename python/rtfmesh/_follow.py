"""Results that follow their inputs to other poses."""

from __future__ import annotations

import warnings

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import _native
from ._arrays import Faces, Vertices, real_numbers
from ._errors import InputError, MeshWarning
from ._objects import MeshLike, arrays_of
from ._result import Correspondence
from ._words import keywords

# A result is nearer to its input than so many of its mean edge lengths; those of the built-in models are up
# to 0.44 away with 40 vertices.
FAR = 1.0


@keywords
def follow(mesh: MeshLike, result: MeshLike, poses: ArrayLike) -> NDArray[np.float64]:
    """Carries a result over to other poses of its input; as `rtfmesh follow`.

    `mesh` is the mesh that was remeshed and `result` its result, each a pair (vertices, faces) or an object
    as in `remesh`. `poses` has shape (F, V, 3): the vertices of `mesh` in each of F poses, in the same order.

    Returns an array of shape (F, N, 3), the vertices of `result` in each pose. Each is at the same place on
    the surface, on the same features.

    Raises `InputError`. Warns (`MeshWarning`) if `result` may have been made from another mesh.
    """
    arrays = arrays_of(mesh, "mesh")
    positions = real_numbers(poses, "poses", (None, len(arrays[0]), 3))
    if not np.isfinite(positions).all():
        raise InputError("`poses` has values that are not finite; remove these poses")
    moving = arrays_of(result, "result")
    found = _native.follow(arrays, moving, positions)
    far = distance(arrays, moving)
    if far > FAR:
        text = f"`result` is up to {far:.2g} edge lengths away from `mesh`"
        remedy = "give the mesh that it was made from, unless holes were filled or wrapped"
        warnings.warn(f"{text}; {remedy}", MeshWarning, stacklevel=3)
    return found


def distance(mesh: tuple[Vertices, Faces], result: tuple[Vertices, Faces]) -> float:
    """The largest distance of a result's vertices from a mesh, in mean edge lengths of the result."""
    vertices, faces = result
    places = Correspondence(*_native.locate(mesh, vertices, None, 0.0))
    offsets = vertices - places.interpolate(mesh[1], mesh[0])
    edges = vertices[faces] - vertices[np.roll(faces, 1, axis=1)]
    return float(np.linalg.norm(offsets, axis=1).max() / np.linalg.norm(edges, axis=2).mean())
