#!/usr/bin/env python3
"""Remeshes with another program: run_peer.py METHOD IN.ply OUT.ply N [--edge LENGTH] [--features DEGREES]

Prints one line of JSON: seconds inside the call (without reading, writing and imports), vertices, the edge
length for methods that take one instead of a count, and the version. `run_peer.py --list` prints for each
method why it is not available, or null. Methods that take an edge length get LENGTH, or else that of N
vertices in a hexagonal layout; the caller searches for the one that gives N. With --features, methods that
can keep edges where the surface turns by so many degrees; else each does as it does by itself.
"""

import argparse
import collections
import importlib.metadata
import importlib.util
import json
import os
import pathlib
import shutil
import subprocess
import sys
import tempfile
import time

ITERATIONS = 10
# The defaults of vorpalite.
LLOYD, NEWTON = "5", "30"
# The time that a program reports itself, where reading and writing would count otherwise.
Timed = collections.namedtuple("Timed", "result seconds")


def pyacvd(points, faces, count, edge, features):
    import numpy as np
    import pyacvd as acvd
    import pyvista

    mesh = pyvista.PolyData(points, np.column_stack([np.full(len(faces), 3), faces]))

    def call():
        # Clusters consist of vertices; the documentation asks for many more vertices than clusters.
        divided = acvd.Clustering(mesh)
        while divided.mesh.n_points < 10 * count:
            divided.subdivide(2)
        divided.cluster(count)
        return divided.create_mesh()

    return call, lambda mesh: (np.asarray(mesh.points), mesh.faces.reshape(-1, 4)[:, 1:])


def pymeshlab(points, faces, count, edge, features):
    import pymeshlab as lab

    meshes = lab.MeshSet()
    meshes.add_mesh(lab.Mesh(points, faces))

    angle = {} if features is None else {"featuredeg": features}

    def call():
        target = lab.PureValue(edge)
        meshes.meshing_isotropic_explicit_remeshing(iterations=ITERATIONS, targetlen=target, **angle)
        return meshes.current_mesh()

    return call, lambda mesh: (mesh.vertex_matrix(), mesh.face_matrix())


def gpytoolbox(points, faces, count, edge, features):
    from gpytoolbox import remesh_botsch

    kept = {}
    if features is not None:
        kept = {"detect_feature_edges": True, "feature_dihedral_threshold": features}
    return lambda: remesh_botsch(points, faces, ITERATIONS, edge, True, **kept), lambda mesh: mesh


def cgal(points, faces, count, edge, features):
    from CGAL.CGAL_Polygon_mesh_processing import isotropic_remeshing, split_long_edges
    from CGAL.CGAL_Polyhedron_3 import Polyhedron_3
    from meshes import read_off, write_off

    with tempfile.TemporaryDirectory() as folder:
        name = os.path.join(folder, "in.off")
        write_off(name, points, faces)
        mesh = Polyhedron_3(name)
    # Making the list does not count as work.
    facets = list(mesh.facets())

    def call():
        if features is None:
            isotropic_remeshing(facets, edge, mesh, ITERATIONS)
            return mesh
        # Protected edges stay as they are, so they must not be longer than others will be.
        split_long_edges(sharp_halfedges(mesh, features), edge, mesh)
        kept = sharp_halfedges(mesh, features)
        isotropic_remeshing(list(mesh.facets()), edge, mesh, ITERATIONS, kept, True)
        return mesh

    def arrays(mesh):
        with tempfile.TemporaryDirectory() as folder:
            name = os.path.join(folder, "out.off")
            mesh.write_to_file(name)
            return read_off(name)

    return call, arrays


def sharp_halfedges(mesh, degrees):
    """One halfedge of every edge of a CGAL polyhedron where the surface turns by so many degrees, and of
    boundary edges."""
    import numpy as np

    def normal(halfedge):
        corners = [halfedge, halfedge.next(), halfedge.next().next()]
        a, b, c = ([getattr(h.vertex().point(), axis)() for axis in "xyz"] for h in corners)
        across = np.cross(np.subtract(b, a), np.subtract(c, a))
        return across / max(np.linalg.norm(across), 1e-300)

    def sharp(edge):
        other = edge.opposite()
        if edge.is_border() or other.is_border():
            return True
        return normal(edge) @ normal(other) <= np.cos(np.radians(degrees))

    return [edge for edge in mesh.edges() if sharp(edge)]


def mmgs(points, faces, count, edge, features):
    from meshes import read_medit, write_medit

    folder = tempfile.TemporaryDirectory()
    names = [os.path.join(folder.name, name) for name in ("in.mesh", "out.mesh")]
    write_medit(names[0], points, faces)
    # Its own limit on the distance would add up to half as many vertices again, whatever the edge length.
    command = [mmgs_program(), "-v", "0", "-hsiz", repr(edge), "-hausd", repr(edge)]
    command += ([] if features is None else ["-ar", repr(features)]) + names

    def call():
        subprocess.run(command, check=True, stdout=subprocess.DEVNULL)
        return folder

    return call, lambda _: read_medit(names[1])


def vorpalite(points, faces, count, edge, features):
    from meshes import read_off, write_off

    folder = tempfile.TemporaryDirectory()
    names = [os.path.join(folder.name, name) for name in ("in.off", "out.off")]
    write_off(names[0], points, faces)
    command = ["vorpalite", *names, "remesh=true", f"remesh:nb_pts={count}", "pre=false", "post=false"]

    def call():
        subprocess.run(command, check=True, stdout=subprocess.DEVNULL)
        return folder

    return call, lambda _: read_off(names[1])


def geogram(points, faces, count, edge, features):
    from meshes import read_off, write_off

    folder = tempfile.TemporaryDirectory()
    names = [os.path.join(folder.name, name) for name in ("in.off", "out.off")]
    write_off(names[0], points, faces)
    command = [geogram_program(), *names, str(count), LLOYD, NEWTON]

    def call():
        said = subprocess.run(command, check=True, capture_output=True, text=True).stdout
        return Timed(folder, float(said.rsplit("seconds ", 1)[1]))

    return call, lambda _: read_off(names[1])


def geogram_program():
    """The program that setup.sh compiles; None if it could not."""
    made = pathlib.Path(__file__).parent / ".venv" / "bin" / "geogram_remesh"
    return str(made) if made.exists() else None


def mmgs_program():
    """In the package mmgpy (its script would start Python again) or on PATH; None if there is none."""
    package = importlib.util.find_spec("mmgpy")
    if package and package.submodule_search_locations:
        inside = pathlib.Path(package.submodule_search_locations[0], "bin", "mmgs_O3")
        if inside.exists():
            return str(inside)
    return shutil.which("mmgs_O3") or shutil.which("mmgs")


# The method, whether it takes an edge length, and the package or program that it needs.
METHODS = {
    "pyacvd": (pyacvd, False, "pyacvd"),
    "pymeshlab": (pymeshlab, True, "pymeshlab"),
    "gpytoolbox": (gpytoolbox, True, "gpytoolbox"),
    "cgal": (cgal, True, "CGAL"),
    "mmgs": (mmgs, True, None),
    "geogram": (geogram, False, None),
    "vorpalite": (vorpalite, False, None),
}


def missing(name):
    """Why a method cannot run; None if it can."""
    package = METHODS[name][2]
    if package is not None:
        found = importlib.util.find_spec(package)
        return None if found else f"no Python package {package}: see bench/peers/setup.sh"
    if name == "geogram":
        return None if geogram_program() else "no geogram_remesh: see bench/peers/setup.sh"
    found = mmgs_program() if name == "mmgs" else shutil.which(name)
    return None if found else f"no program {name} on PATH"


def version(name):
    """The version of its package; None for programs."""
    try:
        return importlib.metadata.version({"mmgs": "mmgpy"}.get(name, name))
    except importlib.metadata.PackageNotFoundError:
        return None


def main():
    if sys.argv[1:] == ["--list"]:
        facts = {
            name: {"missing": missing(name), "takes_edge": takes}
            for name, (_, takes, _) in METHODS.items()
        }
        print(json.dumps(facts))
        return
    parser = argparse.ArgumentParser()
    parser.add_argument("method", choices=METHODS)
    parser.add_argument("input")
    parser.add_argument("output")
    parser.add_argument("count", type=int)
    parser.add_argument("--edge", type=float)
    parser.add_argument("--features", type=float)
    args = parser.parse_args()
    reason = missing(args.method)
    if reason:
        sys.exit(reason)
    from meshes import hexagonal_edge, read_ply, write_ply

    method, takes_edge, _ = METHODS[args.method]
    points, faces = read_ply(args.input)
    edge = (args.edge or hexagonal_edge(points, faces, args.count)) if takes_edge else None
    call, arrays = method(points, faces, args.count, edge, args.features)
    begin = time.perf_counter()
    result = call()
    seconds = time.perf_counter() - begin
    if isinstance(result, Timed):
        result, seconds = result
    points, faces = arrays(result)
    write_ply(args.output, points, faces)
    facts = {"seconds": seconds, "vertices": len(points), "edge": edge, "version": version(args.method)}
    print(json.dumps(facts))


if __name__ == "__main__":
    main()
