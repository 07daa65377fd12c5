"""Damages meshes, repairs them with rtfmesh and MeshFix, and compares both with what they were.

A case depends on its number alone: one of five kinds of damage to one of the models, which must be closed.

    pip install numpy scipy trimesh rtree pymeshfix==0.18.1
    python3 bench/repair.py --program target/release/rtfmesh --count 200 --out repair.tsv MODEL...

Columns of the table: case, model, damage, program, seconds, whether the result is closed, its change of
volume in percent, undamaged vertices that are no longer there bit by bit, components, new self-intersecting
faces, and the largest distance of its vertices from the undamaged mesh, in percent of the diagonal. MeshFix
runs in this process and reads no file, rtfmesh as a process of its own.
"""

import argparse
import json
import os
import subprocess
import tempfile
import time
from collections import deque
from pathlib import Path
from typing import Any

import numpy as np
import pymeshfix
import trimesh
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
OPTIONS = ("--fill-holes", "100%", "--smooth-spikes", "--outer")


def plain(vertices: Floats, faces: Ints) -> trimesh.Trimesh:
    """The mesh as it is."""
    return trimesh.Trimesh(vertices, faces, process=False)


def patches(faces: Ints, random: np.random.Generator) -> Ints:
    """The faces of one to five connected patches of 1 to 59 faces each."""
    around: list[list[int]] = [[] for _ in faces]
    for one, other in plain(np.zeros((faces.max() + 1, 3)), faces).face_adjacency:
        around[one].append(other)
        around[other].append(one)
    chosen: set[int] = set()
    for _ in range(random.integers(1, 6)):
        start, size = int(random.integers(len(faces))), int(random.integers(1, 60))
        found, queue = {start}, deque([start])
        for _ in range(size):
            if queue:
                face = queue.popleft()
                chosen.add(face)
                new = [f for f in around[face] if f not in found]
                found.update(new)
                queue.extend(new)
    return np.array(sorted(chosen))


Damaged = tuple[Floats, Ints, Ints]
"""Vertices, faces, and the numbers of the vertices that the damage touches."""


def holes(vertices: Floats, faces: Ints, random: np.random.Generator) -> Damaged:
    """Patches are gone."""
    gone = patches(faces, random)
    return vertices, np.delete(faces, gone, axis=0), np.unique(faces[gone])


def turned(vertices: Floats, faces: Ints, random: np.random.Generator) -> Damaged:
    """Patches are turned over."""
    over, turned = patches(faces, random), faces.copy()
    turned[over] = turned[over, ::-1]
    return vertices, turned, np.unique(faces[over])


def doubled(vertices: Floats, faces: Ints, random: np.random.Generator) -> Damaged:
    """Patches are there twice."""
    again = faces[patches(faces, random)]
    used, new = np.unique(again, return_inverse=True)
    both = np.vstack([faces, new.reshape(-1, 3) + len(vertices)])
    return np.vstack([vertices, vertices[used]]), both, used


def spikes(vertices: Floats, faces: Ints, random: np.random.Generator) -> Damaged:
    """Two to ten vertices have moved along their normals, out or in, by 5 to 50 % of the diagonal."""
    diagonal = np.linalg.norm(np.ptp(vertices, axis=0))
    chosen = random.choice(len(vertices), 2 * int(random.integers(1, 6)), replace=False)
    lengths = random.uniform(0.05, 0.5, (len(chosen), 1)) * random.choice([-1, 1], (len(chosen), 1))
    moved = vertices.copy()
    moved[chosen] += plain(vertices, faces).vertex_normals[chosen] * diagonal * lengths
    return moved, faces, chosen


def is_inside(at: Floats, corners: Floats) -> bool:
    """Whether triangles (F, 3, 3) wind around a point, by the sum of their solid angles."""
    a, b, c = np.moveaxis(corners - at, 1, 0)
    la, lb, lc = (np.linalg.norm(side, axis=1) for side in (a, b, c))
    dots = [(a * b).sum(axis=1) * lc, (b * c).sum(axis=1) * la, (c * a).sum(axis=1) * lb]
    halves = np.arctan2((a * np.cross(b, c)).sum(axis=1), la * lb * lc + sum(dots))
    return abs(halves.sum()) > np.pi


def shells(vertices: Floats, faces: Ints, random: np.random.Generator) -> Damaged:
    """One to five balls or boxes lie inside, half of them inside out."""
    mesh = plain(vertices, faces)
    least = 0.01 * np.linalg.norm(np.ptp(vertices, axis=0))
    parts, wanted = [mesh], 1 + int(random.integers(1, 6))
    for _ in range(10_000):
        if len(parts) == wanted:
            break
        at = random.uniform(vertices.min(axis=0), vertices.max(axis=0))
        room = trimesh.proximity.closest_point(mesh, [at])[1][0]
        if room > least and is_inside(at, vertices[faces]):
            size = 0.5 * room
            part = trimesh.creation.icosphere(2, size) if random.random() < 0.5 else None
            part = part or trimesh.creation.box((size, size, size))
            part.apply_translation(at)
            if random.random() < 0.5:
                part.invert()
            parts.append(part)
    if len(parts) < wanted:
        raise ValueError("the model has too little room for shells")
    whole = trimesh.util.concatenate(parts)
    return np.array(whole.vertices), np.array(whole.faces), np.empty(0, np.int64)


KINDS = (holes, turned, doubled, spikes, shells)


def write(path: Path, vertices: Floats, faces: Ints) -> None:
    """A PLY file with 64-bit positions."""
    rows = np.zeros(len(faces), dtype=[("count", "u1"), ("corners", "<i4", 3)])
    rows["count"], rows["corners"] = 3, faces
    header = f"""ply
format binary_little_endian 1.0
element vertex {len(vertices)}
property double x
property double y
property double z
element face {len(faces)}
property list uchar int vertex_indices
end_header
"""
    path.write_bytes(header.encode() + vertices.astype("<f8").tobytes() + rows.tobytes())


class Bench:
    """Runs and measures."""

    def __init__(self, program: str, folder: Path) -> None:
        self.program, self.folder = program, folder

    def repaired(self, by: str, vertices: Floats, faces: Ints) -> tuple[Floats, Ints, float]:
        """The mesh that a program makes, and the seconds that it takes."""
        source, target = self.folder / "in.ply", self.folder / "out.ply"
        if by == "rtfmesh":
            write(source, vertices, faces)
            before = time.perf_counter()
            subprocess.run([self.program, "repair", source, target, "-q", *OPTIONS], check=True)
            seconds = time.perf_counter() - before
            mesh = trimesh.load(target, process=False)
            return np.array(mesh.vertices), np.array(mesh.faces), seconds
        before = time.perf_counter()
        fix = pymeshfix.MeshFix(vertices, faces.astype(np.int32))
        fix.repair()
        return np.array(fix.points), np.array(fix.faces), time.perf_counter() - before

    def intersecting(self, vertices: Floats, faces: Ints) -> int:
        """Faces that intersect others."""
        path = self.folder / "measured.ply"
        write(path, vertices, faces)
        told = subprocess.run([self.program, "measure", path, "--json"], check=True, capture_output=True)
        found: dict[str, Any] = json.loads(told.stdout)
        return int(found["self_intersecting_faces"])

    def row(self, case: int, model: Path, by: str) -> list[Any]:
        """A row of the table."""
        loaded = trimesh.load(model)
        own, own_faces = np.array(loaded.vertices), np.array(loaded.faces)
        before = plain(own, own_faces)
        kind = KINDS[case % len(KINDS)]
        damaged, faces, touched = kind(own, own_faces, np.random.default_rng(case))
        vertices, triangles, seconds = self.repaired(by, damaged, faces)
        after = plain(vertices, triangles)
        closed = bool(after.is_watertight and after.is_winding_consistent)
        change = 100 * (after.volume / before.volume - 1) if closed else float("nan")
        there = {p.tobytes() for p in vertices}
        kept = np.delete(own, touched, axis=0)
        lost = sum(p.tobytes() not in there for p in kept)
        new = self.intersecting(vertices, triangles) - self.intersecting(before.vertices, before.faces)
        offsets = trimesh.proximity.closest_point(before, vertices)[1]
        far = 100 * offsets.max() / np.linalg.norm(np.ptp(before.vertices, axis=0))
        figures = [
            f"{seconds:.3f}",
            int(closed),
            f"{change:.3f}",
            lost,
            after.body_count,
            new,
            f"{far:.3f}",
        ]
        return [case, model.stem, kind.__name__, by, *figures]


def main() -> None:
    """Writes the table."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("models", nargs="+", type=Path)
    parser.add_argument("--program", default="rtfmesh")
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--count", type=int, default=200)
    parser.add_argument("--out", type=Path, required=True)
    given = parser.parse_args()
    os.environ.setdefault("RTFMESH_DEVICE", "cpu")
    heads = "case model damage program seconds closed volume lost components intersecting farthest"
    with tempfile.TemporaryDirectory() as folder, given.out.open("w") as out:
        bench = Bench(given.program, Path(folder))
        print(*heads.split(), sep="\t", file=out)
        for case in range(given.first, given.first + given.count):
            model = given.models[case // len(KINDS) % len(given.models)]
            for by in ("rtfmesh", "MeshFix"):
                print(*bench.row(case, model, by), sep="\t", file=out, flush=True)


if __name__ == "__main__":
    main()
