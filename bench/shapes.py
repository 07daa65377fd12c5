"""Remeshes generated shapes with rtfmesh and lists results that are slow, wrong, or bad without a warning.

Shapes have what hand-made test models seldom have: spikes, thin walls, gears, perforated sheets, cups,
wedges, extreme aspects, random solids cut out of each other. A shape depends on its number alone, so any
can be made again:

    pip install manifold3d numpy
    python3 bench/shapes.py --program target/release/rtfmesh --first 0 --count 200 --out shapes.tsv
    python3 bench/shapes.py --make 63 --to spikes63.ply

Columns of the table: shape, family, vertices asked for, further options, seconds, exit code, and what is
suspicious, if anything.
"""

import argparse
import json
import math
import os
import subprocess
import tempfile
import time
from pathlib import Path

import manifold3d
import numpy as np

Solid = manifold3d.Manifold
SLOW = 20.0
"""Seconds from which a run is slow."""
TIMEOUT = 90.0
"""Seconds after which a run is stopped."""


def ball(radius: float, random: np.random.Generator) -> Solid:
    """A sphere of 8 to 48 segments."""
    return Solid.sphere(radius, int(random.integers(8, 48)))


def turned(solid: Solid, random: np.random.Generator) -> Solid:
    """The solid in a random orientation."""
    return solid.rotate(random.uniform(0, 360, 3))


def spikes(random: np.random.Generator) -> Solid:
    """A sphere with needles."""
    solid = ball(1.0, random)
    for _ in range(random.integers(3, 40)):
        length, width = random.uniform(0.5, 3.0), 10 ** random.uniform(-2.3, -0.7)
        tip, sides = width * random.uniform(0.0, 0.3), int(random.integers(3, 12))
        needle = Solid.cylinder(1.0 + length, width, tip, sides)
        solid += turned(needle, random)
    return solid


def walls(random: np.random.Generator) -> Solid:
    """A tray whose walls are thin."""
    size, thickness = random.uniform(1, 4, 3), 10 ** random.uniform(-2.5, -0.7)
    solid = Solid.cube(size)
    across = random.integers(1, 5, 2)
    room = (size[:2] - thickness * (across + 1)) / across
    if min(room) <= 0:
        return solid
    for i in range(across[0]):
        for j in range(across[1]):
            corner = thickness + np.array([i, j]) * (room + thickness)
            solid -= Solid.cube([*room, size[2]]).translate([*corner, thickness])
    return solid


def gear(random: np.random.Generator) -> Solid:
    """A gear or a star with a bore."""
    teeth, inner = int(random.integers(3, 80)), random.uniform(0.4, 0.95)
    top = random.uniform(0.0, 0.5)
    outline = []
    for tooth in range(teeth):
        for at, radius in ((0.0, inner), (0.5 - top / 2, 1.0), (0.5 + top / 2, 1.0)):
            angle = 2 * math.pi * (tooth + at) / teeth
            outline.append([radius * math.cos(angle), radius * math.sin(angle)])
    height = 10 ** random.uniform(-1.5, 0.5)
    twist = random.choice([0.0, random.uniform(5, 60)])
    solid = Solid.extrude(manifold3d.CrossSection([outline]), height, 12 if twist else 0, twist)
    bore = random.uniform(0, 0.8) * inner
    return solid - Solid.cylinder(3 * height, bore, bore, 32).translate([0, 0, -height])


def sieve(random: np.random.Generator) -> Solid:
    """A plate with many holes."""
    across, thickness = random.integers(2, 14, 2), 10 ** random.uniform(-2, -0.5)
    solid = Solid.cube([*across.astype(float), thickness])
    radius, sides = random.uniform(0.05, 0.48), int(random.integers(3, 24))
    hole = Solid.cylinder(3 * thickness, radius, radius, sides).translate([0, 0, -thickness])
    holes = [hole.translate([i + 0.5, j + 0.5, 0]) for i in range(across[0]) for j in range(across[1])]
    return solid - Solid.batch_boolean(holes, manifold3d.OpType.Add)


def cup(random: np.random.Generator) -> Solid:
    """A bowl with a thin wall and a handle."""
    wall = 10 ** random.uniform(-2.3, -0.7)
    segments = int(random.integers(12, 96))
    solid = Solid.cylinder(1.5, 0.7, 1.0, segments)
    solid -= Solid.cylinder(1.5, 0.7 - wall, 1.0 - wall, segments).translate([0, 0, wall])
    ring = manifold3d.CrossSection.circle(random.uniform(0.03, 0.2), 12).translate([0.5, 0])
    handle = Solid.revolve(ring, 32).rotate([90, 0, 0]).translate([1.0, 0, 0.75])
    return solid + (handle - Solid.cylinder(4, 0.86, 0.86, segments).translate([0, 0, -1]))


def wedge(random: np.random.Generator) -> Solid:
    """A wedge with a sharp angle, perhaps with a hole."""
    height = 10 ** random.uniform(-2.5, 0.3)
    outline = manifold3d.CrossSection([[[0, 0], [2, 0], [2, height]]])
    width = random.uniform(0.2, 3)
    hole = ball(random.uniform(0.02, 0.5), random).translate([1.5, height / 3, width / 2])
    return turned(Solid.extrude(outline, width) - hole, random)


def aspect(random: np.random.Generator) -> Solid:
    """A box or rod with extreme proportions."""
    size = 10 ** random.uniform(-2, 2, 3)
    solid = Solid.cube(size) if random.random() < 0.5 else Solid.cylinder(size[0], size[1], size[1], 24)
    return turned(solid, random)


def solids(random: np.random.Generator) -> Solid:
    """Random solids added to and cut out of each other."""
    solid = Solid.cube([2, 2, 2], True)
    for _ in range(random.integers(2, 14)):
        size = random.uniform(0.05, 1.2, 3)
        kind = random.integers(3)
        if kind == 0:
            other = Solid.cube(size, True)
        elif kind == 1:
            sides = int(random.integers(3, 40))
            other = Solid.cylinder(2 * size[0], size[1] / 2, size[2] / 2 + 0.02, sides, True)
        else:
            other = ball(size[0] / 2 + 0.05, random)
        if random.random() < 0.5:
            other = turned(other, random)
        other = other.translate(random.uniform(-1.1, 1.1, 3))
        solid = solid + other if random.random() < 0.5 else solid - other
    return solid


FAMILIES = [spikes, walls, gear, sieve, cup, wedge, aspect, solids]


def make(number: int) -> tuple[str, Solid]:
    """The shape of a number, with its family's name."""
    family = FAMILIES[number % len(FAMILIES)]
    return family.__name__, family(np.random.default_rng(number))


def write_ply(solid: Solid, path: Path) -> int:
    """Writes a solid as a binary PLY file; gives the number of its vertices."""
    mesh = solid.to_mesh64()
    points = np.asarray(mesh.vert_properties, dtype="<f8")[:, :3]
    triangles = np.asarray(mesh.tri_verts, dtype="<i4")
    rows = np.empty(len(triangles), dtype=[("count", "u1"), ("corners", "<i4", 3)])
    rows["count"], rows["corners"] = 3, triangles
    header = (
        f"ply\nformat binary_little_endian 1.0\nelement vertex {len(points)}\nproperty double x\n"
        f"property double y\nproperty double z\nelement face {len(triangles)}\n"
        "property list uchar int vertex_indices\nend_header\n"
    )
    path.write_bytes(header.encode() + points.tobytes() + rows.tobytes())
    return len(points)


def find(report: object, key: str) -> object:
    """The first value of a key, at any depth."""
    if isinstance(report, dict):
        if key in report:
            return report[key]
        values = (find(value, key) for value in report.values())
        return next((value for value in values if value is not None), None)
    return None


def suspicions(code: int, seconds: float, report: dict, words: str, vertices: int) -> list[str]:
    """What is suspicious about a run."""
    found = []
    if seconds >= TIMEOUT:
        return ["stopped"]
    if seconds > SLOW:
        found.append("slow")
    if code != 0:
        return [*found, f"exit {code}: {words.splitlines()[0][:120] if words else ''}"]
    codes = report.get("warning_codes") or find(report, "warning_codes") or []
    angle, got = find(report, "min_angle"), find(report, "vertices")
    if angle is not None and angle < 10 and not codes:
        found.append(f"{angle:.1f} degrees without a warning")
    if isinstance(got, int) and got != vertices and not codes:
        found.append(f"{got} vertices without a warning")
    return found


def run(program: str, number: int, folder: Path, environment: dict) -> str:
    """Makes and remeshes a shape; gives its row of the table."""
    family, solid = make(number)
    source, report = folder / f"{number}.ply", folder / f"{number}.json"
    if solid.is_empty() or write_ply(solid, source) == 0:
        return f"{number}\t{family}\t-\t\t0\t0\tempty"
    random = np.random.default_rng([number, 1])
    vertices = int(10 ** random.uniform(0.7, 4))
    options = ["--sizing", "curvature"] if random.random() < 0.2 else []
    call = [program, "remesh", source, folder / "out.ply", "-n", str(vertices), "--quiet"]
    start = time.monotonic()
    call += ["--report", report, *options]
    try:
        ended = subprocess.run(call, capture_output=True, text=True, timeout=TIMEOUT, env=environment)
        code, words = ended.returncode, ended.stderr
    except subprocess.TimeoutExpired:
        code, words = -1, ""
    seconds = time.monotonic() - start
    figures = json.loads(report.read_text()) if code == 0 else {}
    what = "; ".join(suspicions(code, seconds, figures, words, vertices))
    for path in (source, report):
        path.unlink(missing_ok=True)
    return f"{number}\t{family}\t{vertices}\t{' '.join(options)}\t{seconds:.2f}\t{code}\t{what}"


def main() -> None:
    """Reads the arguments and makes one shape, or runs many."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--program", default="target/release/rtfmesh")
    parser.add_argument("--first", type=int, default=0, help="number of the first shape")
    parser.add_argument("--count", type=int, default=100, help="how many shapes")
    parser.add_argument("--out", type=Path, help="the table (default: standard output)")
    parser.add_argument("--make", type=int, metavar="NUMBER", help="write this shape to --to instead")
    parser.add_argument("--to", type=Path, default=Path("shape.ply"))
    arguments = parser.parse_args()
    if arguments.make is not None:
        family, solid = make(arguments.make)
        print(family, write_ply(solid, arguments.to), "vertices")
        return
    environment = {"RTFMESH_DEVICE": "cpu", **os.environ}
    with tempfile.TemporaryDirectory() as folder:
        for number in range(arguments.first, arguments.first + arguments.count):
            row = run(arguments.program, number, Path(folder), environment)
            if arguments.out:
                with arguments.out.open("a") as table:
                    table.write(row + "\n")
            else:
                print(row, flush=True)


if __name__ == "__main__":
    main()
