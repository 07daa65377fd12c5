"""Models made in code, and what tests ask of results."""

import bpy
import numpy as np


def cube(size=2.0):
    """A cube with its UV map, as Blender adds it."""
    bpy.ops.mesh.primitive_cube_add(size=size)
    return bpy.context.object


def sphere(segments=32):
    """A sphere of unit radius with its UV map, which has a seam from pole to pole."""
    bpy.ops.mesh.primitive_uv_sphere_add(segments=segments, ring_count=segments // 2)
    return bpy.context.object


def grid(cells=16):
    """A square from -1 to 1 in the plane, with its UV map."""
    bpy.ops.mesh.primitive_grid_add(x_subdivisions=cells, y_subdivisions=cells, size=2)
    return bpy.context.object


def remesh(vertices=500, **settings):
    """Calls the operator for the active object."""
    settings.setdefault("quality", "DRAFT")
    assert bpy.ops.object.rtfmesh_remesh(vertices=vertices, **settings) == {"FINISHED"}
    return bpy.context.object


def positions(mesh):
    """The vertices, (V, 3)."""
    return array(mesh.vertices, "co", 3)


def array(collection, name, width=1, dtype=np.float32):
    """A property of all items."""
    values = np.empty(len(collection) * width, dtype)
    collection.foreach_get(name, values)
    return values if width == 1 else values.reshape(-1, width)


def corner_positions(mesh):
    """The place of each corner, (L, 3)."""
    return positions(mesh)[array(mesh.loops, "vertex_index", dtype=np.int32)]


def face_areas_in_uv(mesh):
    """The signed area of each triangle in the active UV map."""
    uv = array(mesh.uv_layers.active.data, "uv", 2).reshape(-1, 3, 2)
    a, b = uv[:, 1] - uv[:, 0], uv[:, 2] - uv[:, 0]
    return (a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]) / 2


def edges_where(mesh, name):
    """The ends (E, 2, 3) of edges for which a property is not zero."""
    chosen = array(mesh.edges, name, dtype=np.bool_)
    ends = array(mesh.edges, "vertices", 2, np.int32)
    return positions(mesh)[ends[chosen]]
