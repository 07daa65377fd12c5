#!/usr/bin/env python3
"""Meshes through points by other programs: clouds.py METHOD IN.xyz OUT.ply N

Prints one line of JSON: seconds inside the call (without reading, writing and imports), vertices, and whether
the mesh is closed and manifold. Methods, each as its documentation shows it:

    open3d-poisson    normals by planes and their spanning tree, screened Poisson, quadric decimation
    open3d-pivoting   the same normals, ball pivoting; as many vertices as there are points, whatever N is
    pymeshlab         normals, screened Poisson, isotropic remeshing with the edge length of N vertices
    pyvista           reconstruct_surface, then pyacvd
    geogram           the co-cones of vorpalite, then its remeshing; the seconds inside the two

Points are those of points.py, without normals. The venv needs numpy and what the method is named after;
requirements.txt has the versions. Open3D needs libusb-1.0 of the system;
geogram is what setup.sh compiles.
"""
import json
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np
from meshes import read_off
from run_peer import LLOYD, NEWTON

ITERATIONS = 10
NEIGHBOURS = 16


def edge_of(area, count):
    """The edge length of so many vertices in a hexagonal layout."""
    return float(np.sqrt(2.0 * area / (np.sqrt(3.0) * count)))


def oriented(points):
    """A cloud of Open3D with normals that agree."""
    import open3d

    cloud = open3d.geometry.PointCloud(open3d.utility.Vector3dVector(points))
    cloud.estimate_normals(open3d.geometry.KDTreeSearchParamKNN(NEIGHBOURS))
    cloud.orient_normals_consistent_tangent_plane(NEIGHBOURS)
    return open3d, cloud


def arrays(mesh):
    return np.asarray(mesh.vertices), np.asarray(mesh.triangles)


def open3d_poisson(points, count):
    open3d, cloud = oriented(points)
    # Its tutorial cuts away what has few points, which leaves hundreds of holes in closed objects.
    mesh, _ = open3d.geometry.TriangleMesh.create_from_point_cloud_poisson(cloud, depth=9)
    return arrays(mesh.simplify_quadric_decimation(2 * count))


def open3d_pivoting(points, count):
    open3d, cloud = oriented(points)
    spacing = float(np.mean(cloud.compute_nearest_neighbor_distance()))
    radii = open3d.utility.DoubleVector([factor * spacing for factor in (1.5, 2.0, 4.0)])
    return arrays(open3d.geometry.TriangleMesh.create_from_point_cloud_ball_pivoting(cloud, radii))


def pymeshlab(points, count):
    import pymeshlab as lab

    meshes = lab.MeshSet()
    meshes.add_mesh(lab.Mesh(points))
    meshes.compute_normal_for_point_clouds(k=NEIGHBOURS)
    meshes.generate_surface_reconstruction_screened_poisson(depth=9, preclean=True)
    area = meshes.get_geometric_measures()["surface_area"]
    target = lab.PureValue(edge_of(area, count))
    meshes.meshing_isotropic_explicit_remeshing(iterations=ITERATIONS, targetlen=target)
    mesh = meshes.current_mesh()
    return mesh.vertex_matrix(), mesh.face_matrix()


def pyvista(points, count):
    import pyacvd
    import pyvista as pv

    surface = pv.PolyData(points).reconstruct_surface(nbr_sz=NEIGHBOURS).triangulate().clean()
    clustering = pyacvd.Clustering(surface)
    while clustering.mesh.n_points < 10 * count:
        clustering.subdivide(2)
    clustering.cluster(count)
    mesh = clustering.create_mesh()
    return np.asarray(mesh.points), mesh.faces.reshape(-1, 4)[:, 1:]


def geogram(points, count):
    programs = Path(__file__).parent / ".venv" / "bin"
    with tempfile.TemporaryDirectory() as folder:
        cloud, surface, out = (Path(folder, name) for name in ("in.xyz", "surface.off", "out.off"))
        np.savetxt(cloud, points)
        seconds = 0.0
        for command in (
            [programs / "geogram_reconstruct", cloud, surface],
            [programs / "geogram_remesh", surface, out, str(count), LLOYD, NEWTON],
        ):
            said = subprocess.run(command, check=True, capture_output=True, text=True).stdout
            seconds += float(said.rsplit("seconds ", 1)[1])
        return *read_off(out), seconds


METHODS = {
    "open3d-poisson": open3d_poisson,
    "open3d-pivoting": open3d_pivoting,
    "pymeshlab": pymeshlab,
    "pyvista": pyvista,
    "geogram": geogram,
}


def is_closed_manifold(faces):
    """Whether each edge has two faces that agree about its direction."""
    halves = np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]])
    forward = {tuple(half) for half in halves.tolist()}
    return len(forward) == len(halves) and all((b, a) in forward for a, b in forward)


def write_ply(path, points, faces):
    with open(path, "wb") as file:
        lines = ["ply", "format binary_little_endian 1.0", f"element vertex {len(points)}"]
        lines += [f"property double {axis}" for axis in "xyz"]
        lines += [f"element face {len(faces)}", "property list uchar int vertex_indices", "end_header", ""]
        file.write("\n".join(lines).encode())
        file.write(np.ascontiguousarray(points, dtype="<f8").tobytes())
        rows = np.empty(len(faces), dtype=[("count", "u1"), ("corners", "<i4", 3)])
        rows["count"], rows["corners"] = 3, faces
        file.write(rows.tobytes())


def main():
    if len(sys.argv) != 5 or sys.argv[1] not in METHODS:
        sys.exit(__doc__)
    method, source, target, count = sys.argv[1:]
    points = np.loadtxt(source, ndmin=2)[:, :3]
    begin = time.perf_counter()
    vertices, faces, *inside = METHODS[method](points, int(count))
    seconds = inside[0] if inside else time.perf_counter() - begin
    write_ply(target, vertices, faces)
    closed = is_closed_manifold(faces)
    print(json.dumps({"method": method, "seconds": seconds, "vertices": len(vertices), "closed": closed}))


if __name__ == "__main__":
    main()
