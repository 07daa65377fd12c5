"""Remeshing for the meshes of trimesh.

import trimesh
from rtfmesh.trimesh import remesh

mesh = trimesh.load_mesh("scan.ply")
even = remesh(mesh, 10_000)
"""

from __future__ import annotations

import copy
from typing import TYPE_CHECKING, Any

import numpy as np
import trimesh
from trimesh.visual import ColorVisuals, TextureVisuals

from ._attributes import Alias, Attributes, brings_own
from ._errors import InputError
from ._objects import Shape
from ._progress import Callback
from ._remesher import Remesher, Told, on_device, warned
from ._result import Result
from ._seams import Split, split_at_seams
from ._words import keywords

if TYPE_CHECKING:
    from typing_extensions import Unpack

    from ._options import Options

# The names that visuals travel under, which no attribute of a mesh has.
COLOUR = "colour of trimesh"
FACE_COLOUR = Alias(COLOUR, "face_colors")
MATERIALS = Alias("materials of trimesh", "face_materials")


def shape_of(mesh: Any, name: str) -> Shape:
    """The parts of a mesh, of all meshes of a scene as one, or of points."""
    if isinstance(mesh, trimesh.Scene):
        mesh = mesh.to_mesh()
    if isinstance(mesh, trimesh.PointCloud):
        colours = np.asarray(mesh.colors)
        vertex = {"rgba": colours} if len(colours) else {}
        return Shape(np.asarray(mesh.vertices), np.empty((0, 3), np.uint32), Attributes(vertex))
    if not isinstance(mesh, trimesh.Trimesh):
        raise InputError(f"`{name}` is a {type(mesh).__name__}, not a trimesh.Trimesh")
    attributes = attributes_of(mesh)
    # Under these names they are of no use to anything but visuals.
    attributes.face.pop(MATERIALS, None)
    for arrays, name in ((attributes.vertex, "rgba"), (attributes.face, Alias("rgba", "face_colors"))):
        if COLOUR in arrays:
            arrays[name] = arrays.pop(COLOUR)
    return Shape(np.asarray(mesh.vertices), np.asarray(mesh.faces), attributes)


def attributes_of(mesh: trimesh.Trimesh) -> Attributes:
    """The mesh's attributes and what its visuals are, as far as the library carries that."""
    vertex: dict[str, Any] = dict(mesh.vertex_attributes)
    face: dict[str, Any] = dict(mesh.face_attributes)
    visual: Any = mesh.visual
    uv = None
    if isinstance(visual, TextureVisuals):
        if visual.face_materials is not None:
            face[MATERIALS] = np.asarray(visual.face_materials)
        uv = None if visual.uv is None else np.asarray(visual.uv)[:, :2][mesh.faces]
    elif visual.kind == "vertex":
        vertex[COLOUR] = np.asarray(visual.vertex_colors)
    elif visual.kind == "face":
        face[FACE_COLOUR] = np.asarray(visual.face_colors)
    return Attributes(vertex, face, uv)


def visual_of(mesh: trimesh.Trimesh, result: Result, split: Split) -> Any:
    """What the result looks like."""
    carried = result.attributes
    if isinstance(mesh.visual, TextureVisuals):
        materials = carried.face.get(MATERIALS)
        return TextureVisuals(split.uv, copy.copy(mesh.visual.material), face_materials=materials)
    vertex = carried.vertex.get(COLOUR)
    return ColorVisuals(
        face_colors=carried.face.get(COLOUR), vertex_colors=None if vertex is None else vertex[split.vertices]
    )


@keywords
def remesh(
    mesh: trimesh.Trimesh | trimesh.Scene,
    n: int | str | None = None,
    *,
    attributes: bool = True,
    distances: bool = False,
    progress: bool | Callback = False,
    device: str | int | None = None,
    device_memory: int | None = None,
    remesher: Remesher | None = None,
    **options: Unpack[Options],
) -> trimesh.Trimesh:
    """A new mesh of exactly `n` vertices with well-shaped triangles; `mesh` stays as it is.

    Colours of vertices or faces, texture coordinates with their material, `vertex_attributes`,
    `face_attributes` and `metadata` come along, as `rtfmesh.Attributes` says. With `keep_uv=True` vertices on
    texture seams are there once for each side, beyond `n`. A scene gives one mesh of all that is in it.
    `attributes=False` leaves colours and attributes behind; the report is in `metadata["rtfmesh"]`.
    `keep_labels="face_colors"` keeps borders between colours of faces. `remesher` is a `rtfmesh.Remesher` to
    use; all other arguments and what is raised are as in `rtfmesh.remesh`.
    """
    if isinstance(mesh, trimesh.Scene):
        metadata, mesh = mesh.metadata, mesh.to_mesh()
        mesh.metadata = {**copy.deepcopy(metadata), **mesh.metadata}
    if not isinstance(mesh, trimesh.Trimesh):
        raise InputError(f"`mesh` is a {type(mesh).__name__}, not a trimesh.Trimesh")
    told = Told(correspondence=False, distances=distances, progress=progress)
    given, wanted = attributes_of(mesh) if brings_own(attributes) else Attributes(), dict(options)

    def run(remesher: Remesher) -> Result:
        return remesher._run(mesh.vertices, mesh.faces, n, given, told, wanted)

    result = warned(on_device(remesher, device, device_memory, told, run))
    split = split_at_seams(result, bool(options.get("keep_uv")))
    visuals = (COLOUR, MATERIALS)
    vertex, face = result.attributes.vertex, result.attributes.face
    return trimesh.Trimesh(
        vertices=result.vertices[split.vertices],
        faces=split.faces,
        visual=visual_of(mesh, result, split),
        vertex_attributes={k: array[split.vertices] for k, array in vertex.items() if k not in visuals},
        face_attributes={k: array for k, array in face.items() if k not in visuals},
        metadata={**copy.deepcopy(mesh.metadata), "rtfmesh": result.report},
        process=False,
    )
