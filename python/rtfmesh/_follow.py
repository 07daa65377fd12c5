"""Results that follow their inputs to other poses."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import _native
from ._arrays import real_numbers
from ._errors import InputError
from ._objects import MeshLike, arrays_of
from ._words import keywords


@keywords
def follow(mesh: MeshLike, result: MeshLike, poses: ArrayLike) -> NDArray[np.float64]:
    """Carries a result over to other poses of its input; as `rtfmesh follow`.

    `mesh` is the mesh that was remeshed and `result` its result, each a pair (vertices, faces) or an object
    as in `remesh`. `poses` has shape (F, V, 3): the vertices of `mesh` in each of F poses, in the same order.

    Returns an array of shape (F, N, 3), the vertices of `result` in each pose. Each is at the same place on
    the surface, on the same features.

    Raises `InputError`.
    """
    arrays = arrays_of(mesh, "mesh")
    positions = real_numbers(poses, "poses", (None, len(arrays[0]), 3))
    if not np.isfinite(positions).all():
        raise InputError("`poses` has values that are not finite; remove these poses")
    return _native.follow(arrays, arrays_of(result, "result"), positions)
