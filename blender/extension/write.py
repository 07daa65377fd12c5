"""Writes a result into a mesh of Blender."""

import bmesh
import bpy
import numpy as np

from .carry import Carrier
from .surface import KINDS, values_of


def write(mesh, surface, result, keys):
    """Replaces the geometry of a mesh by the result, with all that the old one had.

    The mesh itself stays, and with it its materials, users, shape keys and their drivers.
    """
    carrier = Carrier(surface, result)
    new = bpy.data.meshes.new(mesh.name)
    try:
        new.from_pydata(result.vertices / surface.scale, [], result.faces)
        write_attributes(new, carrier)
        replace_geometry(mesh, new, carrier, None if keys is None else keys / surface.scale)
    finally:
        bpy.data.meshes.remove(new)
    if "custom_normal" in mesh.attributes:
        mesh.attributes.remove(mesh.attributes["custom_normal"])
    mesh.validate()
    mesh.update()


def write_attributes(mesh, carrier):
    """Gives a new mesh the attributes of the surface."""
    edges = values_of(mesh.edges, "vertices", np.int32, 2)
    mesh.edges.foreach_set("use_seam", carrier.of_edges(carrier.surface.seams, edges))
    uv_maps = [one for one in carrier.surface.attributes if is_uv_map(one)]
    for attribute in uv_maps:
        mesh.uv_layers.new(name=attribute.name)
    for attribute in carrier.surface.attributes:
        carried = carrier.carry(attribute, edges)
        made = mesh.attributes.get(attribute.name)
        if made is None:
            made = mesh.attributes.new(attribute.name, attribute.type, attribute.domain)
        kind = KINDS[attribute.type]
        made.data.foreach_set(kind.field, np.ascontiguousarray(carried.values, kind.dtype).ravel())


def is_uv_map(attribute):
    """Whether Blender shows an attribute as a UV map."""
    return attribute.domain == "CORNER" and attribute.type == "FLOAT2"


def replace_geometry(mesh, new, carrier, keys):
    """Puts the new mesh in the place of the old one's geometry, through a BMesh, which keeps shape keys."""
    groups = None
    if carrier.surface.groups is not None:
        groups = carrier.of_vertices(carrier.surface.groups, is_smooth=True)
    edit = bmesh.new()
    try:
        edit.from_mesh(mesh)
        bmesh.ops.delete(edit, geom=edit.verts[:], context="VERTS")
        edit.from_mesh(new)
        # New vertices take the places of old ones in any order, and their indices are those of the new mesh.
        edit.verts.sort()
        if groups is not None:
            write_groups(edit, groups)
        edit.to_mesh(mesh)
    finally:
        edit.free()
    if keys is not None:
        # Not in the BMesh, which takes new positions for edits of the active key that other keys follow.
        for key, coordinates in zip(mesh.shape_keys.key_blocks, keys, strict=True):
            key.data.foreach_set("co", coordinates.astype(np.float32).ravel())
        positions = carrier.result.vertices / carrier.surface.scale
        mesh.vertices.foreach_set("co", positions.astype(np.float32).ravel())


def write_groups(edit, weights, least=1e-5):
    """Gives the vertices of a BMesh their weights in vertex groups."""
    layer = edit.verts.layers.deform.verify()
    edit.verts.ensure_lookup_table()
    for group, column in enumerate(weights.T):
        for index in np.flatnonzero(column > least):
            edit.verts[index][layer][group] = min(float(column[index]), 1.0)
