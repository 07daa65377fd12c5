#!/usr/bin/env python3
"""Volumes with known surfaces as .npy files, and how far a mesh is from those surfaces.

    python bench/peers/volumes.py make FOLDER [NODES]   sphere, gyroid, shell, balls (labels) on NODES^3 nodes
    python bench/peers/volumes.py judge NAME MESH [NODES]   distances in units of the nodes' spacing
    python bench/peers/volumes.py peer IN.npy OUT.ply N      marching cubes of scikit-image, then pyacvd

Needs numpy, trimesh for judging, and scikit-image, pyvista and pyacvd for the peer.
"""
import sys
import time
from pathlib import Path

import numpy as np

NODES = 128


def sphere(x, y, z, n):
    """Signed distance of a ball off the grid's centre."""
    c = 0.5 * (n - 1) + np.array([0.21, -0.34, 0.11])
    return np.sqrt((x - c[0]) ** 2 + (y - c[1]) ** 2 + (z - c[2]) ** 2) - 0.33 * n


def gyroid(x, y, z, n):
    """A gyroid of two periods, divided by its slope: the distance to first order."""
    w = 4.0 * np.pi / n
    value = np.sin(w * x) * np.cos(w * y) + np.sin(w * y) * np.cos(w * z) + np.sin(w * z) * np.cos(w * x)
    gx = np.cos(w * x) * np.cos(w * y) - np.sin(w * z) * np.sin(w * x)
    gy = np.cos(w * y) * np.cos(w * z) - np.sin(w * x) * np.sin(w * y)
    gz = np.cos(w * z) * np.cos(w * x) - np.sin(w * y) * np.sin(w * z)
    slope = w * np.sqrt(gx**2 + gy**2 + gz**2)
    return value / np.maximum(slope, 0.3 * w)


def shell(x, y, z, n):
    """A hollow ball."""
    return np.abs(sphere(x, y, z, n) + 0.06 * n) - 0.06 * n


def centres(n):
    """The centres and the radius of three balls that meet."""
    angles = 0.3 + 2.0 * np.pi * np.arange(3) / 3.0
    middle = 0.5 * (n - 1)
    offsets = 0.17 * n * np.stack([np.cos(angles), np.sin(angles), 0.2 * np.sin(2.0 * angles)], axis=1)
    return middle + offsets, 0.22 * n


def balls(x, y, z, n):
    """Labels: 0 outside, else the nearest of three balls."""
    at, radius = centres(n)
    squares = np.stack([(x - c[0]) ** 2 + (y - c[1]) ** 2 + (z - c[2]) ** 2 for c in at])
    nearest = np.argmin(squares, axis=0)
    return np.where(np.min(squares, axis=0) < radius**2, nearest + 1, 0).astype(np.uint8)


FIELDS = {"sphere": sphere, "gyroid": gyroid, "shell": shell, "balls": balls}


def make(folder, n):
    x, y, z = np.meshgrid(*[np.arange(n, dtype=np.float64)] * 3, indexing="ij")
    for name, field in FIELDS.items():
        values = field(x, y, z, n)
        np.save(folder / f"{name}.npy", values if values.dtype == np.uint8 else values.astype(np.float32))


def points_of(path):
    """Random points of a mesh's faces, even by area."""
    import trimesh

    mesh = trimesh.load(path, process=False)
    points, _ = trimesh.sample.sample_surface(mesh, 200_000, seed=1)
    return mesh, np.asarray(points)


def distance_of_balls(p, n):
    """Distances of points from the nearest of the balls' outer faces and the walls between them."""
    at, radius = centres(n)
    to = np.linalg.norm(p[:, None] - at[None], axis=2)
    order = np.argsort(to, axis=1)
    first, second = (np.take_along_axis(to, order[:, k : k + 1], axis=1)[:, 0] for k in (0, 1))
    between = np.linalg.norm(at[order[:, 0]] - at[order[:, 1]], axis=1)
    wall = (second**2 - first**2) / (2.0 * between)
    # A wall ends at the balls' faces.
    return np.minimum(np.abs(first - radius), np.where(second < radius + 1.0, wall, np.inf))


def judge(name, path, n):
    mesh, p = points_of(path)
    of = lambda q: FIELDS[name](*q.T, n) if name != "balls" else distance_of_balls(q, n)
    for what, q in (("vertices", np.asarray(mesh.vertices)), ("faces", p)):
        d = np.abs(of(q))
        print(f"{name} {what}: rms {np.sqrt((d**2).mean()):.4f}, largest {d.max():.4f}")


def peer(source, target, count):
    """What is usual in Python: marching cubes at 0, subdivided as pyacvd's page says, then pyacvd."""
    import pyacvd
    import pyvista
    from skimage.measure import marching_cubes

    begin = time.perf_counter()
    points, faces, _, _ = marching_cubes(np.load(source), 0.0)
    sizes = np.full((len(faces), 1), 3)
    clustering = pyacvd.Clustering(pyvista.PolyData(points.astype(float), np.hstack([sizes, faces]).ravel()))
    if len(points) < 4 * count:
        clustering.subdivide(2)
    clustering.cluster(count)
    mesh = clustering.create_mesh()
    print(f"{mesh.n_points} vertices in {time.perf_counter() - begin:.2f} s")
    mesh.save(target)


if __name__ == "__main__":
    command, *rest = sys.argv[1:]
    if command == "make":
        folder = Path(rest[0])
        folder.mkdir(parents=True, exist_ok=True)
        make(folder, int(rest[1]) if len(rest) > 1 else NODES)
    elif command == "judge":
        judge(rest[0], rest[1], int(rest[2]) if len(rest) > 2 else NODES)
    elif command == "peer":
        peer(rest[0], rest[1], int(rest[2]))
    else:
        sys.exit(__doc__)
