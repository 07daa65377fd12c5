"""Meshes with baked textures, as games and the web need them: `pip install rtfmesh[asset]`.

    from rtfmesh import asset

    made = asset.make("sculpt.glb", faces=20_000, texture=2048)
    made.write("sculpt-20k.glb")

The command `rtfmesh asset sculpt.glb sculpt-20k.glb --faces 20k --texture 2048` does the same.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from .. import _native
from .._arrays import Faces, Vertices, mesh_arrays, short, truth
from .._attributes import Attributes, rows
from .._attributes import texture as uv_array
from .._errors import InputError
from .._files import Mesh, path_of, read, write
from .._objects import MeshLike, mesh_of, with_attributes
from .._progress import Callback
from .._remesh import remesh
from .._words import count, keywords_without
from ._atlas import texels, unwrap
from ._bake import Target, bake
from ._source import Source

if TYPE_CHECKING:
    from typing_extensions import Unpack

    from .._options import Options

__all__ = ["Asset", "make"]

# Texels a side.
SIDES = (16, 8192)
# Triangles of the smallest closed surface.
FEWEST = 4
# What remeshing has that a new look makes no sense of, and what `faces` says here.
USELESS, SIZES = ("keep_uv", "correspondence", "cells"), ("n", "n_faces", "edge_length", "ratio")


class SourceError(InputError):
    """An input that cannot be read, or has no surface to bake."""


@dataclass(frozen=True, eq=False)
class Asset:
    """A mesh with texture coordinates and one material, whose pictures show what the input looked like."""

    vertices: Vertices
    """Positions in the input's units, shape (N, 3)."""
    faces: Faces
    """Indices of vertices, shape (M, 3)."""
    uv: NDArray[np.float64]
    """Texture coordinates of the faces' corners, shape (M, 3, 2); v grows upwards."""
    normals: NDArray[np.float64]
    """Unit normals of the vertices, shape (N, 3), to which baked normals are relative."""
    pictures: dict[str, bytes]
    """PNG files by what they show: "colour", and where the input has it "surface" (roughness in green,
    metalness in blue), "normal" and "emissive"."""
    charts: int
    """Parts that the surface is cut into."""
    covered: float
    """The share of the pictures' texels that triangles cover, 0 to 1."""
    report: dict[str, Any]
    """That of the remeshing, as in `Result`."""
    notes: list[str]
    """What of the input's look is not in the pictures."""
    material: _native.Materials
    """The pictures as a material, for `write`."""

    def write(self, path: str | os.PathLike[str]) -> None:
        """Writes a .glb file.

        Raises `InputError` for another extension, `OutputError` where it cannot be written.
        """
        if path_of(path).suffix.lower() != ".glb":
            raise InputError(f"'{os.fspath(path)}' is no .glb file, which alone holds pictures; name one")
        attributes = Attributes(
            vertex={"normal": self.normals},
            face={"material": np.zeros(len(self.faces), np.uint32)},
            uv=self.uv,
            label_names={"material": ["baked"]},
            materials=self.material,
        )
        write(path, self.vertices, self.faces, attributes=attributes)

    def __repr__(self) -> str:
        parts = f"{len(self.vertices)} vertices, {len(self.faces)} faces, {self.charts} charts"
        return f"<rtfmesh.asset.Asset: {parts}, {', '.join(self.pictures)}>"


@keywords_without(*USELESS, *SIZES)
def make(
    mesh: MeshLike | str | os.PathLike[str],
    faces: int | str = 20_000,
    *,
    texture: int = 2048,
    normals: bool = True,
    attributes: Attributes | Mapping[str, Any] | None = None,
    linear_colours: bool | None = None,
    told: Callable[[str], None] | None = None,
    distances: bool = False,
    progress: bool | Callback = False,
    device: str | int | None = None,
    device_memory: int | None = None,
    **options: Unpack[Options],
) -> Asset:
    """Remeshes a surface and bakes its look into pictures.

    Parameters
    ----------
    mesh
        The name of a file, which is read with its materials, or a mesh as in `remesh`.
    faces
        Number of triangles, also as "20k"; one fewer where the surface allows no such number.
    texture
        Texels along a side of the square pictures, 16 to 8192.
    normals
        Whether a picture of normals is made, which shows what is finer than the triangles. Without it, sharp
        edges are shaded as if they were smooth.
    attributes
        Colours, texture coordinates and materials in place of those of the mesh, as in `remesh`.
    linear_colours
        Whether colours of vertices and faces are light, as glTF has them, and not sRGB; by default, if a file
        ends in .glb or .gltf.
    told
        Called with what is being done: "remeshing", "cutting into charts", "baking".
    distances, progress, device, device_memory
        As in `remesh`, for the remeshing.
    **options
        As in `remesh`: `wrap="1%"` for a closed surface around broken input, `fill_holes` ...

    Returns
    -------
    An `Asset`. Its pictures are looked up on the input as it was given, whatever was repaired or wrapped.

    Raises
    ------
    InputError
        An argument, a file or one of its pictures cannot be used.
    DeviceError
        As in `remesh`.
    """
    wanted, side, with_normals = _count(faces), _side(texture), truth(normals, "normals")
    if told is not None and not callable(told):
        raise InputError(f"`told` is {short(told)}; give a function of one text, such as print")
    for name in (*USELESS, *SIZES):
        if name in options:
            remedy = "leave it out" if name in USELESS else "`faces` says how many triangles there are"
            raise InputError(f"`{name}` is not for assets; {remedy}")
    tell = told or (lambda _: None)
    input = _Input.of(mesh, attributes, linear_colours)
    # In units in which nothing is too small or too large.
    low, high = input.vertices.min(axis=0), input.vertices.max(axis=0)
    scale = float((high / 2 - low / 2).max()) or 1.0

    def in_units(at: Vertices) -> Vertices:
        units: Vertices = (at / 2 - low / 2) / scale
        return units

    source = Source.of(in_units(input.vertices), input.faces, input.attributes, input.is_linear)
    tell("remeshing")
    given: dict[str, Any] = {**options, "n_faces": wanted}
    try:
        result = remesh(
            input.vertices,
            input.faces,
            attributes=False,
            correspondence=False,
            distances=distances,
            progress=progress,
            device=device,
            device_memory=device_memory,
            **given,
        )
    except InputError as error:
        if "`n_faces`" not in str(error):
            raise
        raise InputError(str(error).replace("`n_faces`", "`faces`")) from None
    at = in_units(result.vertices)
    tell("cutting into charts")
    atlas = unwrap(at, result.faces, side)
    tell("baking")
    covered = texels(atlas.uv, side)
    target = Target.of(at, result.faces, atlas.uv)
    baked = bake(source, target, covered, with_normals)
    pictures = baked.colour, baked.surface, baked.normal, baked.emissive
    material = _native.Materials.textured(
        pictures, (baked.metallic, baked.roughness), baked.alpha, baked.double_sided
    )
    names = "colour", "surface", "normal", "emissive"
    return Asset(
        result.vertices,
        result.faces,
        atlas.uv,
        target.normals,
        {name: picture for name, picture in zip(names, pictures, strict=True) if picture is not None},
        atlas.charts,
        len(covered.index) / side**2,
        result.report,
        [*input.notes, *source.notes],
        material,
    )


def has_linear_colours(path: str | os.PathLike[str]) -> bool:
    """Whether files with this extension have light as colours, and not sRGB."""
    return Path(path).name.lower().removesuffix(".gz").endswith((".glb", ".gltf"))


def _count(faces: Any) -> int:
    """A number of triangles."""
    try:
        number = count(faces)
    except InputError as error:
        raise InputError(str(error).replace("`n`", "`faces`")) from None
    if number < FEWEST:
        raise InputError(f"`faces` {faces} is out of range; ask for at least {FEWEST} triangles")
    return number


def _side(texture: Any) -> int:
    """Texels a side."""
    if isinstance(texture, bool) or not isinstance(texture, (int, np.integer)):
        raise InputError(f"`texture` is {short(texture)}; give a whole number of texels, such as 2048")
    if not SIDES[0] <= texture <= SIDES[1]:
        raise InputError(f"`texture` {texture} is out of range; use {SIDES[0]} to {SIDES[1]} texels")
    return int(texture)


@dataclass
class _Input:
    """A surface as it was given."""

    vertices: Vertices
    faces: Faces
    attributes: Attributes
    is_linear: bool
    """Whether its colours are light."""
    notes: list[str]

    @classmethod
    def of(cls, mesh: Any, attributes: Any, linear_colours: bool | None) -> _Input:
        """Of a file or a mesh."""
        notes: list[str] = []
        is_linear = False
        if isinstance(mesh, (str, os.PathLike)):
            is_linear = has_linear_colours(mesh)
            mesh = read(mesh, materials=True)
        if isinstance(mesh, Mesh):
            notes = list(mesh.notes)
        if getattr(getattr(mesh, "visual", None), "kind", None) == "texture":
            notes.append("the texture of a trimesh mesh is left out; give the name of its file")
        shape = with_attributes(mesh_of(mesh, "mesh", "the name of a file, "), attributes)
        vertices, faces = mesh_arrays(shape.vertices, shape.faces, ("mesh.vertices", "mesh.faces"))
        if len(faces) == 0 or not np.isfinite(vertices).all():
            raise SourceError("the mesh has no faces, or coordinates that are not finite; give a surface")
        if linear_colours is not None:
            is_linear = truth(linear_colours, "linear_colours")
        return cls(vertices, faces, _checked(shape.attributes, vertices, faces), is_linear, notes)


def _checked(given: Attributes, vertices: Vertices, faces: Faces) -> Attributes:
    """Attributes as arrays with a row for each vertex or face."""
    uv, _ = uv_array(given.uv, len(faces))
    return Attributes(
        {name: rows(value, name, len(vertices), "vertex") for name, value in given.vertex.items()},
        {name: rows(value, name, len(faces), "face") for name, value in given.face.items()},
        uv,
        given.label_names,
        given.materials,
    )
