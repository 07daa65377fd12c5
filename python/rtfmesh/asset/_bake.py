"""What a surface looks like, baked into pictures for another mesh."""

from __future__ import annotations

import os
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .._arrays import Faces, Vertices
from .._locate import locate
from ._atlas import Texels
from ._frames import Vectors, face_normals, in_tangent_space, tangents, unit, vertex_normals
from ._pictures import Floats, beside, painted, png, to_srgb
from ._source import Look, Source

# Texels whose places are found in one go, and those that a thread paints in one go.
CHUNK = 1 << 22
PIECE = 1 << 17
# A triangle of the source that faces the other way counts only if it is nearer by this share of an edge.
OTHER_SIDE = 0.5
# If a larger share of the source faces the other way, its triangles have no common side.
MOST_TURNED = 0.2
# The third coordinate of a baked normal is at least this, since pictures hold no normals that point inwards.
LEAST_UP = 0.05


@dataclass
class Target:
    """The mesh that pictures are baked for."""

    vertices: Vertices
    faces: Faces
    uv: NDArray[np.float64]
    """Shape (F, 3, 2)."""
    normals: Vectors
    """Of the vertices, (V, 3)."""

    @classmethod
    def of(cls, vertices: Vertices, faces: Faces, uv: NDArray[np.float64]) -> Target:
        """A mesh with texture coordinates and smooth normals."""
        return cls(vertices, faces, uv, vertex_normals(vertices, faces))


@dataclass
class Baked:
    """Pictures as PNG, and what their material is."""

    colour: bytes
    surface: bytes | None
    """Roughness in green and metalness in blue; None if they are the same everywhere."""
    normal: bytes | None
    emissive: bytes | None
    metallic: float
    roughness: float
    alpha: str
    double_sided: bool


def bake(source: Source, target: Target, texels: Texels, with_normals: bool) -> Baked:
    """Bakes the look of a source for the texels of a mesh."""
    finder = _Finder(source, target)
    look, normal = _look(finder, texels, with_normals)
    materials = source.used()
    near = beside(texels.index, texels.side)

    def picture(values: Floats) -> bytes:
        return png(painted(values, texels.index, near, texels.side))

    alpha = _alpha([material.alpha for material in materials])
    colour = to_srgb(look.colour[:, :3])
    if alpha != "opaque":
        colour = np.column_stack([colour, look.colour[:, 3]])
    return Baked(
        picture(colour),
        picture(_packed(look.surface)) if np.ptp(look.surface, axis=0).max() > 0 else None,
        picture((normal * 0.5 + 0.5).astype(np.float32)) if with_normals else None,
        picture(to_srgb(look.emissive)) if look.emissive.max() > 0 else None,
        float(look.surface[0, 0]),
        float(look.surface[0, 1]),
        alpha,
        any(material.double_sided for material in materials),
    )


def _alpha(modes: list[str]) -> str:
    """What opacity means where several materials become one."""
    return next((mode for mode in ("blend", "mask") if mode in modes), "opaque")


def _packed(surface: Floats) -> Floats:
    """Metalness and roughness where glTF has them."""
    return np.column_stack([np.ones(len(surface), np.float32), surface[:, 1], surface[:, 0]])


class _Finder:
    """Finds places on the source for places on the mesh."""

    def __init__(self, source: Source, target: Target) -> None:
        self.source, self.target = source, target
        corners = target.vertices[target.faces]
        self.margin = OTHER_SIDE * float(np.linalg.norm(np.roll(corners, 1, axis=1) - corners, axis=2).mean())
        self.source_normals = face_normals(source.vertices, source.faces)
        normals = face_normals(target.vertices, target.faces)
        near = locate((source.vertices, source.faces), corners.mean(axis=1))
        turned = (self.source_normals[near.triangles] * normals).sum(axis=1) < 0
        area = np.linalg.norm(normals, axis=1)
        self.has_sides = area[turned].sum() <= MOST_TURNED * area.sum()

    def places(self, at: Vectors, normals: Vectors) -> tuple[NDArray[np.integer], Vectors]:
        """Faces of the source under points with normals (N, 3), and weights (N, 3)."""
        found = locate(
            (self.source.vertices, self.source.faces),
            at,
            normals if self.has_sides else None,
            margin=self.margin,
        )
        return found.triangles, found.barycentrics


def _look(finder: _Finder, texels: Texels, with_normals: bool) -> tuple[Look, Vectors]:
    """The look of the source at all texels, and its normals in the mesh's tangent space."""
    target, count = finder.target, len(texels.index)
    size = _sizes(target, texels.side)
    tangent, side = tangents(target.vertices, target.faces, target.uv, target.normals)
    whole = Look(
        np.empty((count, 4), np.float32),
        np.empty((count, 2), np.float32),
        np.empty((count, 3), np.float32),
        np.empty((0, 3)),
    )
    bent = np.empty((count if with_normals else 0, 3))

    def paint(part: slice, normal: Vectors, under: NDArray[np.integer], places: Vectors) -> None:
        face, weights = texels.face[part], texels.weights[part, :, None]
        look = finder.source.look(under, places, size[face])
        whole.colour[part], whole.surface[part] = look.colour, look.surface
        whole.emissive[part] = look.emissive
        if with_normals:
            # Where the source is turned over, so are its normals.
            turned = (finder.source_normals[under] * normal).sum(axis=1) < 0
            own = np.where(turned[:, None], -look.normal, look.normal)
            along = unit((tangent[face] * weights).sum(axis=1))
            found = in_tangent_space(own, normal, along, side[face])
            found[:, 2] = np.maximum(found[:, 2], LEAST_UP)
            bent[part] = unit(found)

    # Each has rows of its own, so that the number of threads changes nothing.
    with ThreadPoolExecutor(os.cpu_count()) as pool:
        for begin in range(0, count, CHUNK):
            chunk = slice(begin, begin + CHUNK)
            corners, weights = target.faces[texels.face[chunk]], texels.weights[chunk, :, None]
            at = (target.vertices[corners] * weights).sum(axis=1)
            normal = unit((target.normals[corners] * weights).sum(axis=1))
            under, places = finder.places(at, normal)
            work = [
                pool.submit(
                    paint,
                    slice(begin + first, begin + first + len(normal[first : first + PIECE])),
                    normal[first : first + PIECE],
                    under[first : first + PIECE],
                    places[first : first + PIECE],
                )
                for first in range(0, len(at), PIECE)
            ]
            for one in work:
                one.result()
    return whole, bent


def _sizes(target: Target, side: int) -> NDArray[np.float64]:
    """How wide a texel is on each face, (F,)."""
    (du, dv), (eu, ev) = (target.uv[:, 1] - target.uv[:, 0]).T, (target.uv[:, 2] - target.uv[:, 0]).T
    texels = np.abs(du * ev - eu * dv) * side * side
    area = np.linalg.norm(face_normals(target.vertices, target.faces), axis=1)
    sizes: NDArray[np.float64] = np.sqrt(np.divide(area, texels, out=np.zeros_like(area), where=texels > 0))
    return sizes
