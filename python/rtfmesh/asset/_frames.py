"""Normals of surfaces, and the tangent space of texture coordinates."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from .._arrays import Faces, Vertices

Vectors = NDArray[np.float64]

# Corners whose triangle turns by less than this from the vertex's normal are smooth.
SMOOTH = np.cos(np.radians(40.0))


def unit(vectors: Vectors) -> Vectors:
    """Vectors of length 1; those without a length stay."""
    length = np.linalg.norm(vectors, axis=-1, keepdims=True)
    found: Vectors = np.divide(vectors, length, out=np.zeros_like(vectors), where=length > 0)
    return found


def face_normals(vertices: Vertices, faces: Faces) -> Vectors:
    """Normals (F, 3), as long as twice the area."""
    a, b, c = vertices[faces.T]
    return np.cross(b - a, c - a)


def angles(vertices: Vertices, faces: Faces) -> NDArray[np.float64]:
    """The angles of triangles in radians, shape (F, 3)."""
    corners = vertices[faces]
    sides = unit(np.roll(corners, -1, axis=1) - corners)
    cosines = -(sides * np.roll(sides, 1, axis=1)).sum(axis=2)
    found: NDArray[np.float64] = np.arccos(np.clip(cosines, -1.0, 1.0))
    return found


def summed(values: Vectors, index: NDArray[np.integer], count: int) -> Vectors:
    """The sums of rows (N, 3) with the same index, shape (count, 3)."""
    columns = [np.bincount(index, values[:, k], minlength=count) for k in range(3)]
    return np.stack(columns, axis=1)


def vertex_normals(vertices: Vertices, faces: Faces) -> Vectors:
    """Unit normals (V, 3), the mean of the triangles around by their angles."""
    normals = unit(face_normals(vertices, faces))
    weighted = normals[:, None, :] * angles(vertices, faces)[..., None]
    return unit(summed(weighted.reshape(-1, 3), faces.ravel(), len(vertices)))


def corner_normals(vertices: Vertices, faces: Faces) -> Vectors:
    """Unit normals of the corners (F, 3, 3): smooth but at sharp edges, whatever shares vertices."""
    _, same = np.unique(vertices, axis=0, return_inverse=True)
    merged = same.ravel()[faces]
    own = unit(face_normals(vertices, faces))
    weighted = own[:, None, :] * angles(vertices, faces)[..., None]
    smooth = unit(summed(weighted.reshape(-1, 3), merged.ravel(), int(merged.max()) + 1))[merged]
    is_smooth = (smooth * own[:, None, :]).sum(axis=2) > SMOOTH
    return np.where(is_smooth[..., None], smooth, own[:, None, :])


def gradients(corners: Vectors, uv: NDArray[np.float64]) -> tuple[Vectors, Vectors]:
    """How triangles (N, 3, 3) lie along u and v, (N, 3) each; 0 where they have no area in the picture."""
    along, across = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    (du, dv), (eu, ev) = (uv[:, 1] - uv[:, 0]).T, (uv[:, 2] - uv[:, 0]).T
    area = (du * ev - eu * dv)[:, None]
    by_u = along * ev[:, None] - across * dv[:, None]
    by_v = across * du[:, None] - along * eu[:, None]
    divided = [np.divide(by, area, out=np.zeros_like(by), where=area != 0) for by in (by_u, by_v)]
    return divided[0], divided[1]


def tangents(
    vertices: Vertices, faces: Faces, uv: NDArray[np.float64], normals: Vectors
) -> tuple[Vectors, NDArray[np.float64]]:
    """Unit tangents of the corners (F, 3, 3), and the side of the third axis, 1 or -1 (F,).

    As MikkTSpace has them: the mean of the triangles around a vertex that share its texture coordinates, by
    their angles, in the plane of its normal.
    """
    along, across = gradients(vertices[faces], uv)
    # In a mirrored triangle, the third axis is the other way round.
    side = np.where((np.cross(along, across) * face_normals(vertices, faces)).sum(axis=1) < 0, -1.0, 1.0)
    rows = np.column_stack([faces.ravel(), uv.reshape(-1, 2), np.repeat(side, 3)])
    _, of_corner = np.unique(rows, axis=0, return_inverse=True)
    of_corner = of_corner.ravel()
    normal = normals[faces]
    flat = unit(along)[:, None, :]
    flat = unit(flat - normal * (flat * normal).sum(axis=2, keepdims=True))
    weighted = flat * angles(vertices, faces)[..., None]
    mean = summed(weighted.reshape(-1, 3), of_corner, int(of_corner.max()) + 1)[of_corner].reshape(-1, 3, 3)
    mean = unit(mean - normal * (mean * normal).sum(axis=2, keepdims=True))
    return mean, side


def in_tangent_space(
    vectors: Vectors, normal: Vectors, tangent: Vectors, side: NDArray[np.float64]
) -> Vectors:
    """Vectors (N, 3) along tangent, third axis and normal, each (N, 3)."""
    third = np.cross(normal, tangent) * side[:, None]
    # The axes are not quite orthogonal where they were interpolated.
    whole = (normal * np.cross(tangent, third)).sum(axis=1)
    parts = [np.cross(third, normal), np.cross(normal, tangent), np.cross(tangent, third)]
    found = np.stack([(vectors * part).sum(axis=1) for part in parts], axis=1)
    parted: Vectors = np.divide(found, whole[:, None], out=np.zeros_like(found), where=whole[:, None] != 0)
    return parted
