"""Places of points on meshes."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from . import _native
from ._arrays import finite, real_number, real_numbers
from ._errors import InputError
from ._objects import MeshLike, arrays_of
from ._result import Correspondence
from ._words import keywords


@keywords
def locate(
    mesh: MeshLike, points: ArrayLike, normals: ArrayLike | None = None, *, margin: float = 0.0
) -> Correspondence:
    """Finds the nearest point of a mesh for each of N points.

    `mesh` is a pair (vertices, faces) or an object as in `remesh`, `points` has shape (N, 3). With `normals`,
    shape (N, 3), of any length, the nearest point is on a triangle that faces as the normal does, unless one
    that faces away is nearer by more than `margin`, in the mesh's units: so points on thin walls find their
    own side.

    `interpolate` of what is returned carries values of the mesh's vertices over to the points.

    Raises `InputError`.
    """
    arrays = arrays_of(mesh, "mesh")
    places = [finite(real_numbers(points, "points", (None, 3)), "points")]
    if normals is not None:
        places.append(finite(real_numbers(normals, "normals", (len(places[0]), 3)), "normals"))
    width = real_number(margin, "margin")
    if not 0.0 <= width < np.inf:
        raise InputError(f"`margin` is {width:g}; give a length, 0 or above")
    return Correspondence(*_native.locate(arrays, places[0], places[1] if len(places) > 1 else None, width))
