"""What the surface that is baked looks like at any place: colours, materials, normals."""

from __future__ import annotations

import json
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .._arrays import Faces, Vertices
from .._attributes import NORMALS, Attributes, role
from ._frames import Vectors, corner_normals, face_normals, gradients, unit
from ._pictures import Floats, Picture, to_linear

# glTF's number for a picture that repeats.
REPEAT = 10497
# What is left out of materials, with a note.
LEFT_OUT = ("occlusionTexture",)
# An extension of textures that is heard, as the others are not.
TRANSFORM = "KHR_texture_transform"


@dataclass
class Texture:
    """A picture as a material lays it onto the surface."""

    picture: Picture
    wrap: tuple[int, int]
    matrix: NDArray[np.float64]
    """From texture coordinates with a 1, v downwards, to those of the picture, (2, 3)."""

    def at(self, uv: NDArray[np.float64], level: NDArray[np.int64]) -> Floats:
        """Values at texture coordinates (N, 2), v upwards."""
        rows = np.column_stack([uv[:, 0], 1.0 - uv[:, 1], np.ones(len(uv))])
        return self.picture.at(rows @ self.matrix.T, level, self.wrap)


@dataclass
class Material:
    """A material of glTF, as far as it is baked."""

    colour: Floats = field(default_factory=lambda: np.ones(4, np.float32))
    """Light of red, green and blue, and opacity."""
    colour_texture: Texture | None = None
    metallic: float = 1.0
    roughness: float = 1.0
    surface_texture: Texture | None = None
    normal_texture: Texture | None = None
    normal_scale: float = 1.0
    emissive: Floats = field(default_factory=lambda: np.zeros(3, np.float32))
    emissive_texture: Texture | None = None
    alpha: str = "opaque"
    cutoff: float = 0.5
    double_sided: bool = False


@dataclass
class Look:
    """What a surface looks like at N places."""

    colour: Floats
    """Light and opacity, (N, 4)."""
    surface: Floats
    """Metalness and roughness, (N, 2)."""
    emissive: Floats
    """Light, (N, 3)."""
    normal: Vectors
    """Unit normals, (N, 3)."""


@dataclass
class Source:
    """A surface with its look."""

    vertices: Vertices
    faces: Faces
    uv: NDArray[np.float64] | None
    materials: list[Material]
    of_face: NDArray[np.int64]
    """The material of each face."""
    colours: Floats | None
    """Light and opacity of the vertices, (V, 4)."""
    face_colours: Floats | None
    """Of the faces, (F, 4)."""
    normals: Vectors
    """Of the corners, (F, 3, 3)."""
    notes: list[str]

    @classmethod
    def of(cls, vertices: Vertices, faces: Faces, attributes: Attributes, is_linear: bool) -> Source:
        """Of a mesh; `is_linear` tells whether the colours of its vertices are light, as in glTF."""
        notes: list[str] = []
        # What has no material is no metal, though glTF says so.
        default = Material(metallic=0.0)
        found = _materials(attributes, default, notes)
        label = attributes.face.get("material")
        if found and label is not None:
            # The number after that of the last stands for none.
            of_face = np.minimum(np.asarray(label).ravel().astype(np.int64), len(found))
        else:
            of_face = np.full(len(faces), len(found), dtype=np.int64)
        normals = _normals(attributes.vertex)
        return cls(
            vertices,
            faces,
            None if attributes.uv is None else np.asarray(attributes.uv, dtype=np.float64),
            [*found, default],
            of_face,
            _colours(attributes.vertex, is_linear),
            _colours(attributes.face, is_linear),
            corner_normals(vertices, faces) if normals is None else unit(normals.astype(np.float64))[faces],
            notes,
        )

    def used(self) -> list[Material]:
        """The materials that faces have."""
        return [self.materials[number] for number in np.unique(self.of_face)]

    def look(self, face: NDArray[np.integer], weights: Vectors, size: NDArray[np.float64]) -> Look:
        """The look at places of faces, weights of corners (N, 3), where details below `size` are mixed."""
        count, of_face = len(face), self.of_face[face]
        numbers = np.unique(of_face)
        look = Look(
            np.ones((count, 4), np.float32),
            np.ones((count, 2), np.float32),
            np.zeros((count, 3), np.float32),
            unit(_mixed(self.normals[face], weights)),
        )
        for number in numbers:
            chosen = np.flatnonzero(of_face == number)
            self._paint(look, self.materials[number], chosen, face[chosen], weights[chosen], size[chosen])
        if self.colours is not None:
            look.colour *= _mixed(self.colours[self.faces[face]], weights)
        if self.face_colours is not None:
            look.colour *= self.face_colours[face]
        for number in numbers:
            material = self.materials[number]
            if material.alpha == "blend":
                continue
            own = of_face == number
            is_seen = material.alpha == "opaque" or look.colour[own, 3] >= material.cutoff
            look.colour[own, 3] = np.where(is_seen, 1.0, 0.0)
        return look

    def _paint(
        self,
        look: Look,
        material: Material,
        rows: NDArray[np.int64],
        face: NDArray[np.integer],
        weights: Vectors,
        size: NDArray[np.float64],
    ) -> None:
        """Fills rows of a look from one material."""
        look.colour[rows] = material.colour
        look.surface[rows] = material.metallic, material.roughness
        look.emissive[rows] = material.emissive
        if self.uv is None:
            return
        corners = self.uv[face]
        uv = _mixed(corners, weights)

        def value(texture: Texture) -> Floats:
            return texture.at(uv, self._levels(texture, face, size))

        if material.colour_texture:
            look.colour[rows] *= value(material.colour_texture)
        if material.surface_texture:
            found = value(material.surface_texture)
            look.surface[rows] *= found[:, [2, 1]]
        if material.emissive_texture:
            look.emissive[rows] *= value(material.emissive_texture)[:, :3]
        if material.normal_texture:
            bent = value(material.normal_texture)[:, :3].astype(np.float64) * 2.0 - 1.0
            bent[:, :2] *= material.normal_scale
            look.normal[rows] = self._bent(bent, look.normal[rows], face)

    def _bent(self, found: Vectors, normal: Vectors, face: NDArray[np.integer]) -> Vectors:
        """Normals that the vectors of a picture (N, 3), in tangent space, stand for."""
        assert self.uv is not None
        along, up = gradients(self.vertices[self.faces[face]], self.uv[face])
        # In pictures, green grows upwards, as v does here.
        along = unit(along - normal * (along * normal).sum(axis=1, keepdims=True))
        third = np.cross(normal, along)
        side = np.where((third * up).sum(axis=1) < 0, -1.0, 1.0)[:, None]
        bent = found[:, :1] * along + found[:, 1:2] * third * side + found[:, 2:] * normal
        # Without texture coordinates there is no tangent.
        return np.where(np.abs(along).sum(axis=1, keepdims=True) > 0, unit(bent), normal)

    def _levels(
        self, texture: Texture, face: NDArray[np.integer], size: NDArray[np.float64]
    ) -> NDArray[np.int64]:
        """How often pictures are halved so that a pixel is as large as a detail, rounded down."""
        assert self.uv is not None
        # Most faces have many texels.
        own, of_texel = np.unique(face, return_inverse=True)
        uv = self.uv[own]
        first, second = (uv[:, 1:] - uv[:, :1]).transpose(1, 0, 2) @ texture.matrix[:, :2].T
        width, height = texture.picture.shape()
        pixels = np.abs(first[:, 0] * second[:, 1] - first[:, 1] * second[:, 0]) * width * height
        area = np.linalg.norm(face_normals(self.vertices, self.faces[own]), axis=1)
        ratio = np.divide(pixels, area, out=np.zeros_like(area), where=area > 0)[of_texel]
        levels: NDArray[np.int64] = np.floor(np.log2(np.maximum(np.sqrt(ratio) * size, 1.0))).astype(np.int64)
        return levels


def _mixed(values: NDArray[Any], weights: Vectors) -> NDArray[Any]:
    """Values of corners (N, 3, C) at places with these weights (N, 3)."""
    mixed: NDArray[Any] = np.einsum("nk,nkc->nc", weights.astype(values.dtype), values)
    return mixed


def _normals(arrays: dict[str, NDArray[Any]]) -> NDArray[Any] | None:
    """The normals among arrays of the vertices, (V, 3)."""
    found = (array for name, array in arrays.items() if name.lower() in NORMALS and array.ndim == 2)
    return next((array for array in found if array.shape[1] == 3), None)


def _colours(arrays: dict[str, NDArray[Any]], is_linear: bool) -> Floats | None:
    """Colours as light and opacity, (N, 4)."""
    found = next((array for name, array in arrays.items() if _is_colour(name, array)), None)
    if found is None:
        return None
    # Integers of 16 bits go up to 65535, others are bytes in a wider type, as are floats beyond 1.
    largest = 65535.0 if found.dtype == np.uint16 else 255.0
    is_float = found.dtype.kind == "f"
    if is_float and not (len(found) and found.max() > 1.0):
        largest = 1.0
    shades = np.ones((len(found), 4), dtype=np.float32)
    shades[:, : found.shape[1]] = np.clip(found / largest, 0.0, 1.0)
    if not is_linear:
        shades[:, :3] = to_linear(shades[:, :3])
    return shades


def _is_colour(name: str, array: NDArray[Any]) -> bool:
    return array.ndim == 2 and role(name, array.shape[1], array.dtype) == "colour"


def _materials(attributes: Attributes, default: Material, notes: list[str]) -> list[Material]:
    """The materials that `read` found, with a default for those that could not be read."""
    described = attributes.materials.json() if attributes.materials is not None else None
    if described is None or attributes.materials is None:
        return []
    document, images = json.loads(described), attributes.materials.images()
    pictures: dict[tuple[int, bool], Picture] = {}
    left_out: set[str] = set()

    def texture(reference: dict[str, Any] | None, is_colour: bool) -> Texture | None:
        if reference is None:
            return None
        own = document["textures"][reference["index"]]
        source = own.get("source")
        if source is None:
            left_out.update(own.get("extensions", {}))
            return None
        if (source, is_colour) not in pictures:
            pictures[source, is_colour] = Picture.decode(images[source], is_colour)
        sampler = document["samplers"][own["sampler"]] if "sampler" in own else {}
        wrap = sampler.get("wrapS", REPEAT), sampler.get("wrapT", REPEAT)
        extensions = reference.get("extensions", {})
        left_out.update(set(extensions) - {TRANSFORM})
        return Texture(pictures[source, is_colour], wrap, _transform(extensions.get(TRANSFORM, {})))

    def material(own: dict[str, Any] | None) -> Material:
        if own is None:
            return default
        surface, normal = own.get("pbrMetallicRoughness", {}), own.get("normalTexture")
        left_out.update(name for name in LEFT_OUT if name in own)
        left_out.update(own.get("extensions", {}))
        return Material(
            np.array(surface.get("baseColorFactor", [1.0] * 4), np.float32),
            texture(surface.get("baseColorTexture"), True),
            surface.get("metallicFactor", 1.0),
            surface.get("roughnessFactor", 1.0),
            texture(surface.get("metallicRoughnessTexture"), False),
            texture(normal, False),
            (normal or {}).get("scale", 1.0),
            np.array(own.get("emissiveFactor", [0.0] * 3), np.float32),
            texture(own.get("emissiveTexture"), True),
            own.get("alphaMode", "OPAQUE").lower(),
            own.get("alphaCutoff", 0.5),
            own.get("doubleSided", False),
        )

    made = [material(own) for own in document["materials"]]
    if left_out:
        notes.append(f"{', '.join(sorted(left_out))} of materials is left out")
    return made


def _transform(own: dict[str, Any]) -> NDArray[np.float64]:
    """What `KHR_texture_transform` does to texture coordinates, (2, 3)."""
    turn = own.get("rotation", 0.0)
    scale, offset = own.get("scale", [1.0, 1.0]), own.get("offset", [0.0, 0.0])
    cosine, sine = np.cos(turn), np.sin(turn)
    return np.array(
        [
            [cosine * scale[0], sine * scale[1], offset[0]],
            [-sine * scale[0], cosine * scale[1], offset[1]],
        ]
    )
