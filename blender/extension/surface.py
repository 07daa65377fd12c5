"""Reads a mesh of Blender into arrays."""

from dataclasses import dataclass, field

import numpy as np


@dataclass(frozen=True)
class Kind:
    """How the values of a type of attribute are read, and whether they can be interpolated."""

    field: str
    dtype: type
    width: int
    is_smooth: bool


KINDS = {
    "FLOAT": Kind("value", np.float32, 1, True),
    "FLOAT2": Kind("vector", np.float32, 2, True),
    "FLOAT_VECTOR": Kind("vector", np.float32, 3, True),
    "FLOAT_COLOR": Kind("color", np.float32, 4, True),
    "BYTE_COLOR": Kind("color", np.float32, 4, True),
    "QUATERNION": Kind("value", np.float32, 4, True),
    "FLOAT4X4": Kind("value", np.float32, 16, False),
    "INT": Kind("value", np.int32, 1, False),
    "INT8": Kind("value", np.int32, 1, False),
    "INT16_2D": Kind("value", np.int32, 2, False),
    "INT32_2D": Kind("value", np.int32, 2, False),
    "BOOLEAN": Kind("value", np.bool_, 1, False),
}
# Positions and seams have their own place; normals of an old mesh make no sense on a new one.
ELSEWHERE = {"position", "uv_seam", "custom_normal"}
# The attributes of edges that make lines. Others cannot be carried to edges that are elsewhere.
LINES = ("sharp_edge", "crease_edge", "bevel_weight_edge", "freestyle_edge")
MATERIAL = "material_index"


@dataclass
class Attribute:
    """Values of the vertices, edges, corners or faces of a mesh."""

    name: str
    domain: str
    type: str
    values: np.ndarray

    @property
    def is_smooth(self):
        """Whether values between two others make sense."""
        return KINDS[self.type].is_smooth


@dataclass
class Surface:
    """A mesh as arrays: V vertices, T triangles, E edges, L corners of P polygons."""

    positions: np.ndarray
    """(V, 3), with the object's scale."""
    triangles: np.ndarray
    """(T, 3) vertices."""
    triangle_loops: np.ndarray
    """(T, 3) corners."""
    polygons: np.ndarray
    """(T,) the polygon of each triangle."""
    edges: np.ndarray
    """(E, 2) vertices."""
    loop_vertices: np.ndarray
    """(L,)"""
    loop_edges: np.ndarray
    """(L,) the edge from each corner to the next of its polygon."""
    next_loops: np.ndarray
    """(L,)"""
    scale: np.ndarray
    """(3,) what positions are multiplied by."""
    seams: np.ndarray
    """(E,)"""
    attributes: list[Attribute] = field(default_factory=list)
    groups: np.ndarray | None = None
    """(V, G) weights."""
    keys: np.ndarray | None = None
    """(K, V, 3) shape keys, with the object's scale."""
    left_out: list[str] = field(default_factory=list)
    """What cannot be carried over, in words."""

    def attribute(self, name):
        """The attribute of this name, or None."""
        return next((one for one in self.attributes if one.name == name), None)


def values_of(collection, name, dtype, width=1):
    """A property of all items of a collection as an array."""
    values = np.empty(len(collection) * width, dtype)
    collection.foreach_get(name, values)
    return values if width == 1 else values.reshape(-1, width)


def read_attribute(attribute):
    """A Blender attribute as arrays."""
    kind = KINDS[attribute.data_type]
    values = values_of(attribute.data, kind.field, kind.dtype, kind.width)
    return Attribute(attribute.name, attribute.domain, attribute.data_type, values)


def read_attributes(mesh):
    """The mesh's attributes, and what cannot be carried over in words."""
    found, left_out = [], []
    if mesh.has_custom_normals:
        left_out.append("custom normals")
    for attribute in mesh.attributes:
        # Names with a dot are Blender's own: selections and connectivity.
        if attribute.name.startswith(".") or attribute.name in ELSEWHERE:
            continue
        is_line = attribute.domain != "EDGE" or attribute.name in LINES
        if attribute.data_type not in KINDS or not is_line:
            left_out.append(f"the attribute {attribute.name}")
            continue
        found.append(read_attribute(attribute))
    return found, left_out


def read_groups(mesh, count):
    """The weights of vertex groups, (V, G); None without groups."""
    if not count:
        return None
    weights = np.zeros((len(mesh.vertices), count))
    for vertex in mesh.vertices:
        for element in vertex.groups:
            if element.group < count:
                weights[vertex.index, element.group] = element.weight
    return weights


def read_keys(mesh, scale):
    """The shape keys, (K, V, 3), with the reference key's index; (None, 0) without any."""
    if mesh.shape_keys is None:
        return None, 0
    keys = [values_of(key.data, "co", np.float32, 3) for key in mesh.shape_keys.key_blocks]
    reference = mesh.shape_keys.key_blocks.find(mesh.shape_keys.reference_key.name)
    return np.array(keys, float) * scale, reference


def read(mesh, group_count, scale):
    """A mesh of Blender as arrays; the scale is that of its object."""
    mesh.calc_loop_triangles()
    triangles = mesh.loop_triangles
    loops = len(mesh.loops)
    next_loops = np.arange(1, loops + 1)
    starts = values_of(mesh.polygons, "loop_start", np.int32)
    next_loops[starts + values_of(mesh.polygons, "loop_total", np.int32) - 1] = starts
    positions = values_of(mesh.vertices, "co", np.float32, 3) * scale
    keys, reference = read_keys(mesh, scale)
    if keys is not None:
        # The positions may be those of the active key.
        positions = keys[reference]
    attributes, left_out = read_attributes(mesh)
    return Surface(
        positions=positions,
        triangles=values_of(triangles, "vertices", np.int32, 3),
        triangle_loops=values_of(triangles, "loops", np.int32, 3),
        polygons=values_of(triangles, "polygon_index", np.int32),
        edges=values_of(mesh.edges, "vertices", np.int32, 2),
        loop_vertices=values_of(mesh.loops, "vertex_index", np.int32),
        loop_edges=values_of(mesh.loops, "edge_index", np.int32),
        next_loops=next_loops,
        scale=scale,
        seams=values_of(mesh.edges, "use_seam", np.bool_),
        attributes=attributes,
        groups=read_groups(mesh, group_count),
        keys=keys,
        left_out=left_out,
    )


def split_edges(surface, values, tolerance=1e-5):
    """The edges (E,) along which values of corners (L, C) jump between polygons."""
    following = values[surface.next_loops]
    is_along = surface.loop_vertices == surface.edges[surface.loop_edges, 0]
    firsts = np.where(is_along[:, None], values, following)
    seconds = np.where(is_along[:, None], following, values)
    jumps = np.stack([spread(surface, ends) > tolerance for ends in (firsts, seconds)], axis=1)
    # At the last edge of a cut, values differ at one end. So they do at all edges around a pole, where each
    # corner has values of its own; that is no cut.
    is_last = jumps.sum(axis=1) == 1
    counts = np.bincount(surface.edges[is_last][jumps[is_last]], minlength=len(surface.positions))
    at_pole = (counts > 2)[surface.edges] & jumps
    return jumps.any(axis=1) & ~(is_last & at_pole.any(axis=1))


def spread(surface, values):
    """The largest difference (E,) between the values (L, C) that corners have for their edges."""
    least = np.full((len(surface.edges), values.shape[1]), np.inf)
    most = np.full_like(least, -np.inf)
    np.minimum.at(least, surface.loop_edges, values)
    np.maximum.at(most, surface.loop_edges, values)
    return (most - least).max(axis=1)


def kept_edges(surface, settings):
    """The edges (K, 2) that become lines of the result."""
    kept = np.zeros(len(surface.edges), bool)
    if settings.keep_sharp:
        for name in LINES[:3]:
            marks = surface.attribute(name)
            if marks is not None:
                kept |= marks.values > 0
    if settings.keep_seams:
        kept |= surface.seams
        for attribute in surface.attributes:
            if attribute.domain == "CORNER" and attribute.type == "FLOAT2":
                kept |= split_edges(surface, attribute.values)
    # An edge without faces is not on the surface.
    has_faces = np.zeros(len(surface.edges), bool)
    has_faces[surface.loop_edges] = True
    return surface.edges[kept & has_faces]
