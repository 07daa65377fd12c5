"""A mesh remeshed by pyacvd, PyMeshLab, gpytoolbox and rtfmesh: each one's call, figures and a picture.

python side_by_side.py kitten.ply 10000 [picture.png]
"""

import sys
import time

import gpytoolbox
import numpy as np
import pyacvd
import pymeshlab
import pyvista as pv

import rtfmesh


def with_pyacvd(vertices, faces, n):
    """Clusters of vertices, after a subdivision into enough of them."""
    clusters = pyacvd.Clustering(pv.PolyData.from_regular_faces(vertices, faces.astype(np.int64)))
    while clusters.mesh.n_points < 10 * n:
        clusters.subdivide(2)
    clusters.cluster(n)
    surface = clusters.create_mesh()
    return np.asarray(surface.points), surface.regular_faces


def with_pymeshlab(vertices, faces, n):
    """Isotropic explicit remeshing, which takes an edge length."""
    meshes = pymeshlab.MeshSet()
    meshes.add_mesh(pymeshlab.Mesh(vertices, faces))
    length = pymeshlab.PureValue(edge_length(vertices, faces, n))
    meshes.meshing_isotropic_explicit_remeshing(targetlen=length, iterations=10)
    return meshes.current_mesh().vertex_matrix(), meshes.current_mesh().face_matrix()


def with_gpytoolbox(vertices, faces, n):
    """Botsch and Kobbelt's remesher, which takes an edge length too."""
    # It cannot work with vertices that no face uses.
    used, faces = np.unique(faces, return_inverse=True)
    length = edge_length(vertices, faces.reshape(-1, 3), n)
    return gpytoolbox.remesh_botsch(vertices[used], faces.reshape(-1, 3).astype(np.int32), h=length, i=10)


def with_rtfmesh(vertices, faces, n):
    """Exactly n vertices."""
    result = rtfmesh.remesh(vertices, faces, n)
    return result.vertices, result.faces


def edge_length(vertices, faces, n):
    """The edge length of n vertices in equilateral triangles on the surface."""
    a, b, c = (vertices[faces[:, k]] for k in range(3))
    area = 0.5 * np.linalg.norm(np.cross(b - a, c - a), axis=1).sum()
    return float(np.sqrt(2 * area / (np.sqrt(3) * n)))


def row(name, seconds, mesh, against):
    """A line of the table."""
    found = rtfmesh.measure(*mesh, against=against)
    quality, valence, off = found["quality"], found["valence"], found["distances"]
    return (
        f"{name:12} {found['vertices']:8} {quality['mean_quality']:8.3f} {quality['min_angle']:8.1f}° "
        f"{100 * valence['fraction_6']:6.0f} % {off['rms']:8.4f} % {off['hausdorff']:8.3f} % {seconds:7.2f} s"
    )


def main():
    """Remeshes, prints and draws."""
    path, n = sys.argv[1], int(sys.argv[2])
    mesh = rtfmesh.read(path)
    print(f"{'':12} vertices  quality   angle ≥ valence 6    RMS off  Hausdorff      time")
    results = []
    for remesh in (with_pyacvd, with_pymeshlab, with_gpytoolbox, with_rtfmesh):
        # Compiled kernels and imports are not what is compared.
        remesh(mesh.vertices, mesh.faces, 500)
        begin = time.perf_counter()
        result = remesh(mesh.vertices, mesh.faces, n)
        seconds = time.perf_counter() - begin
        results.append(result)
        print(row(remesh.__name__.removeprefix("with_"), seconds, result, mesh))
    if len(sys.argv) > 3:
        rtfmesh.render(results, sys.argv[3], color="quality", size=(300, 220))


if __name__ == "__main__":
    main()
