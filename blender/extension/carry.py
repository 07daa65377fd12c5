"""Carries what a mesh has to its result."""

import numpy as np
import rtfmesh
from mathutils.bvhtree import BVHTree
from mathutils.geometry import closest_point_on_tri
from mathutils.interpolate import poly_3d_calc

from .surface import MATERIAL, Attribute, kept_edges

# How far a corner is moved towards the middle of its face to find on which side of a seam it is.
INWARD = 1e-3
# Ends of an edge on a line are closer to it than this many edge lengths, and its middle than this.
END, MIDDLE = 1e-3, 0.2


def remesh(surface, options, settings, device, progress):
    """The result of rtfmesh for a surface, and the positions (K, N, 3) of its shape keys, or None."""
    arguments = dict(options)
    features = kept_edges(surface, settings)
    if len(features):
        arguments["features"] = features
    material = surface.attribute(MATERIAL)
    labels = np.zeros(len(surface.polygons), np.int32)
    if material is not None:
        labels = material.values[surface.polygons]
    if settings.keep_materials and len(np.unique(labels)) > 1:
        arguments |= {"keep_labels": MATERIAL, "smooth_labels": 0}
    result = rtfmesh.remesh(
        surface.positions,
        surface.triangles,
        # Without an attribute of faces, there is no correspondence for them.
        attributes={"face": {MATERIAL: labels}},
        device=device,
        progress=progress,
        **arguments,
    )
    keys = None
    if surface.keys is not None:
        shape, new_shape = (surface.positions, surface.triangles), (result.vertices, result.faces)
        keys = rtfmesh.follow(shape, new_shape, np.concatenate([surface.positions[None], surface.keys]))
        # What no key moves stays where it is to the last bit.
        keys = result.vertices + (keys[1:] - keys[0])
    return result, keys


class Carrier:
    """The places of a result's vertices, faces and corners on the surface that was remeshed."""

    def __init__(self, surface, result):
        self.surface = surface
        self.result = result
        self.faces = result.faces.astype(np.intp)
        self.vertex_places = result.correspondence
        self.points = result.correspondence.interpolate(surface.triangles, surface.positions)
        self.centres = result.face_correspondence.interpolate(surface.triangles, surface.positions)
        self._tree = None

    def tree(self):
        """A tree of all triangles, made when it is first needed."""
        if self._tree is None:
            positions, triangles = self.surface.positions.tolist(), self.surface.triangles.tolist()
            self._tree = BVHTree.FromPolygons(positions, triangles, all_triangles=True)
        return self._tree

    def carry(self, attribute, edges):
        """An attribute of the surface for the result, whose edges (E, 2) are given."""
        if attribute.domain == "POINT":
            values = self.of_vertices(attribute.values, attribute.is_smooth)
        elif attribute.domain == "FACE":
            values = self.of_faces(attribute)
        elif attribute.domain == "CORNER":
            values = self.of_corners(attribute.values, attribute.is_smooth)
        else:
            values = self.of_edges(attribute.values, edges)
        if attribute.type == "QUATERNION":
            values /= np.maximum(np.linalg.norm(values, axis=1, keepdims=True), 1e-12)
        return Attribute(attribute.name, attribute.domain, attribute.type, values)

    def of_vertices(self, values, is_smooth):
        """Values of vertices: interpolated, or those of the nearest corner."""
        if is_smooth:
            return self.vertex_places.interpolate(self.surface.triangles, values)
        nearest = self.vertex_places.barycentrics.argmax(axis=1)
        return values[self.surface.triangles[self.vertex_places.triangles, nearest]]

    def of_faces(self, attribute):
        """Values of faces: those of the polygon under the centre."""
        if attribute.name == MATERIAL:
            # They respect the borders that were kept.
            return self.result.attributes.face[MATERIAL]
        return attribute.values[self.surface.polygons[self.result.face_correspondence.triangles]]

    def of_corners(self, values, is_smooth):
        """Values of corners, each from its own side of a seam."""
        loops, triangles = self.surface.triangle_loops, self.surface.triangles
        is_split = self.split_vertices(values)
        corners = self.faces.ravel()
        under = self.vertex_places.triangles[corners]
        weights = self.vertex_places.barycentrics[corners]
        # Where corners of a vertex differ, that of the right side has to be found.
        needs_side = is_split[triangles[under]].any(axis=1)
        for index in np.flatnonzero(needs_side):
            under[index], weights[index] = self.inner_place(corners[index], index // 3)
        chosen = values[loops[under]]
        if not is_smooth:
            return chosen[np.arange(len(under)), weights.argmax(axis=1)]
        return np.einsum("nk,nk...->n...", weights, chosen)

    def split_vertices(self, values):
        """The vertices (V,) whose corners have several values."""
        flat = values.reshape(len(values), -1)
        least = np.full((len(self.surface.positions), flat.shape[1]), np.inf)
        most = np.full_like(least, -np.inf)
        np.minimum.at(least, self.surface.loop_vertices, flat)
        np.maximum.at(most, self.surface.loop_vertices, flat)
        return (most - least > 1e-6).any(axis=1)

    def inner_place(self, vertex, face):
        """The triangle and weights of a vertex as seen from inside one of its faces."""
        point = self.points[vertex]
        _, _, triangle, _ = self.tree().find_nearest(point + INWARD * (self.centres[face] - point))
        corners = self.surface.positions[self.surface.triangles[triangle]].tolist()
        return triangle, poly_3d_calc(corners, closest_point_on_tri(point.tolist(), *corners))

    def of_edges(self, values, edges):
        """Values of edges that make lines: those of the line that an edge runs along, or else 0."""
        found = np.zeros(len(edges), values.dtype)
        lines = self.surface.edges[values != 0]
        if not len(lines):
            return found
        # A triangle with two equal corners is a line.
        used, corners = np.unique(lines[:, [0, 1, 1]], return_inverse=True)
        tree = BVHTree.FromPolygons(
            self.surface.positions[used].tolist(), corners.reshape(-1, 3).tolist(), all_triangles=True
        )
        ends = self.points[edges]
        lengths = np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1)
        reach = np.zeros(len(self.points))
        np.maximum.at(reach, edges.ravel(), np.repeat(END * lengths, 2))
        nearest = (tree.find_nearest(*place) for place in zip(self.points, reach, strict=True))
        is_on = np.array([found is not None for found, *_ in nearest])
        of_lines = values[values != 0]
        for index in np.flatnonzero(is_on[edges].all(axis=1)):
            place, _, line, _ = tree.find_nearest(ends[index].mean(axis=0), MIDDLE * lengths[index])
            if place is not None:
                found[index] = of_lines[line]
        return found
