"""Tetrahedra inside a closed surface, by Gmsh: even triangles first, which the tetrahedra then keep.

python tetrahedra.py part.stl volume.msh [10000]

The number is that of vertices on the surface; by default there are as many as in the input. If faces have
labels, groups or materials, the borders of the first such array stay, and each of its values becomes a
physical group of Gmsh.
"""

import sys

import gmsh
import meshio
import numpy as np

import rtfmesh

# Gmsh's numbers for kinds of elements.
TRIANGLE = 2


def label_of(attributes):
    """The name of the first array of faces with integers; None if there is none."""
    arrays = attributes.face.items()
    return next((name for name, array in arrays if array.ndim == 1 and array.dtype.kind in "iu"), None)


def remesh(mesh, n=None):
    """A surface of well-shaped triangles that encloses a volume, with sharp edges and borders of labels."""
    label = label_of(mesh.attributes)
    result = rtfmesh.remesh(mesh, n, keep_labels=[label] if label else False)
    output = result.report["output"]
    topology = output["topology"]
    if topology["boundary_loops"] or topology["nonmanifold_edges"]:
        raise SystemExit(
            "tetrahedra: the surface is not closed; use `rtfmesh repair --fill-holes` or `rtfmesh wrap`"
        )
    if topology["components"] != 1:
        raise SystemExit(
            f"tetrahedra: {topology['components']} components; give each body, which must have no cavity, "
            "its own file"
        )
    if output["self_intersecting_faces"]:
        count = output["self_intersecting_faces"]
        raise SystemExit(f"tetrahedra: {count} faces intersect others; use more vertices or `rtfmesh wrap`")
    return result


def patches_of(result):
    """The faces of each physical group, by its name."""
    label = label_of(result.attributes)
    if label is None:
        return {"surface": np.arange(len(result.faces))}
    values, names = result.attributes.face[label], result.attributes.label_names.get(label) or []
    groups = {}
    for value in np.unique(values).tolist():
        name = names[value] if 0 <= value < len(names) else f"{label} {value}"
        groups.setdefault(name, []).append(value)
    return {name: np.flatnonzero(np.isin(values, own)) for name, own in groups.items()}


def fill(result, path):
    """Writes the tetrahedra inside and the triangles of a result, with physical groups for both."""
    gmsh.initialize(interruptible=False)
    try:
        gmsh.option.setNumber("General.Terminal", 0)
        # Text would round the points.
        gmsh.option.setNumber("Mesh.Binary", 1)
        nodes = np.arange(1, len(result.vertices) + 1)
        tags = []
        for name, faces in patches_of(result).items():
            tag = gmsh.model.addDiscreteEntity(2)
            if not tags:
                gmsh.model.mesh.addNodes(2, tag, nodes, result.vertices.ravel())
            corners = nodes[result.faces[faces]].ravel()
            gmsh.model.mesh.addElementsByType(tag, TRIANGLE, [], corners)
            gmsh.model.addPhysicalGroup(2, [tag], name=name)
            tags.append(tag)
        # All nodes are those of the first patch so far.
        gmsh.model.mesh.reclassifyNodes()
        volume = gmsh.model.geo.addVolume([gmsh.model.geo.addSurfaceLoop(tags)])
        gmsh.model.geo.synchronize()
        gmsh.model.addPhysicalGroup(3, [volume], name="volume")
        gmsh.model.mesh.generate(3)
        gmsh.write(path)
    finally:
        gmsh.finalize()


def dihedral_angles(points, tetrahedra):
    """The six angles between sides of each tetrahedron, in degrees, shape (T, 6)."""
    angles = []
    for a, b, c, d in ((0, 1, 2, 3), (0, 2, 1, 3), (0, 3, 1, 2), (1, 2, 0, 3), (1, 3, 0, 2), (2, 3, 0, 1)):
        edge = points[tetrahedra[:, b]] - points[tetrahedra[:, a]]
        edge /= np.linalg.norm(edge, axis=1, keepdims=True)
        # Across the edge, towards the other two corners.
        first, second = (points[tetrahedra[:, k]] - points[tetrahedra[:, a]] for k in (c, d))
        first -= np.einsum("ij,ij->i", first, edge)[:, None] * edge
        second -= np.einsum("ij,ij->i", second, edge)[:, None] * edge
        cosine = np.einsum("ij,ij->i", first, second)
        cosine /= np.linalg.norm(first, axis=1) * np.linalg.norm(second, axis=1)
        angles.append(np.degrees(np.arccos(np.clip(cosine, -1, 1))))
    return np.column_stack(angles)


def main():
    """Remeshes, fills, and says what is in the file."""
    source, path = sys.argv[1:3]
    fill(remesh(rtfmesh.read(source), sys.argv[3] if len(sys.argv) > 3 else None), path)
    made = meshio.read(path, file_format="gmsh")
    tetrahedra, triangles = made.cells_dict["tetra"], made.cells_dict["triangle"]
    angles = dihedral_angles(made.points, tetrahedra)
    print(f"{len(made.points)} points, {len(triangles)} triangles, {len(tetrahedra)} tetrahedra")
    print(f"dihedral angles from {angles.min():.1f} to {angles.max():.1f} degrees")
    print("groups:", ", ".join(made.field_data))


if __name__ == "__main__":
    main()
