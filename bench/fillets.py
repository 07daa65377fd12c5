"""Makes CAD parts with fillets and chamfers, and remeshes them with rtfmesh.

A part depends on its number and the version of cadquery alone (figures in docs/results.md: 2.8.0), so any
can be made again. Its triangles are those of the CAD kernel: long
strips along fillets, needles on flat sides.

    pip install cadquery==2.8.0
    python3 bench/fillets.py --program target/release/rtfmesh --first 200 --count 24 --out fillets.tsv
    python3 bench/fillets.py --make 207 --to part207.stl

Columns of the table: part, vertices asked for, seconds, smallest angle in degrees, mean quality, shares of
triangles below 30 and above 90 degrees in %, the larger of both RMS and of both Hausdorff distances in % of
the diagonal, and codes of warnings.
"""

import argparse
import json
import os
import subprocess
import tempfile
import time
from pathlib import Path

import cadquery as cq
import numpy as np

VERTICES = (500, 1500, 5000)
TOLERANCE, ANGLE = 0.02, 0.15
"""Of the tessellation: a length, and radians."""


def plate(random: np.random.Generator) -> cq.Workplane:
    """A plate with holes and a slot."""
    x, y, z = random.uniform(30, 60), random.uniform(25, 50), random.uniform(4, 12)
    part = cq.Workplane().box(x, y, z)
    places = [(a * (x / 2 - 6), b * (y / 2 - 6)) for a in (-1, 1) for b in (-1, 1)]
    part = part.faces(">Z").workplane().pushPoints(places).hole(random.uniform(2.0, 6.0))
    return part.faces(">Z").workplane().slot2D(0.4 * x, random.uniform(3.0, 8.0)).cutThruAll()


def bracket(random: np.random.Generator) -> cq.Workplane:
    """An angle with a rib and a hole in each leg."""
    x, y, z = random.uniform(25, 50, 3)
    wall = random.uniform(3, 8)
    part = cq.Workplane().box(x, y, wall, (True, True, False))
    part = part.union(cq.Workplane().box(wall, y, z, (False, True, False)).translate((-x / 2, 0, 0)))
    rib = cq.Workplane("XZ").polyline([(0, 0), (0.5 * x, 0), (0, 0.5 * z)]).close().extrude(wall, both=True)
    part = part.union(rib.translate((wall - x / 2, 0, wall)))
    hole = cq.Workplane().circle(random.uniform(1.5, 4)).extrude(4 * wall, both=True)
    return part.cut(hole.translate((0.3 * x, 0.3 * y, 0)))


def housing(random: np.random.Generator) -> cq.Workplane:
    """A hollow box, open above, with a boss inside."""
    x, y, z = random.uniform(25, 50, 3)
    wall = random.uniform(1.5, 4)
    part = cq.Workplane().box(x, y, z).faces(">Z").shell(-wall)
    boss = cq.Workplane().circle(random.uniform(2, 5)).extrude(random.uniform(0.3, 0.8) * z)
    return part.union(boss.translate((0, 0, wall / 2 - z / 2)))


def shaft(random: np.random.Generator) -> cq.Workplane:
    """A stepped shaft with a keyway and a cross hole."""
    part, at = cq.Workplane(), 0.0
    for _ in range(random.integers(2, 5)):
        length = random.uniform(6, 20)
        step = cq.Workplane().circle(random.uniform(4, 12)).extrude(length + 0.01).translate((0, 0, at))
        part, at = (step if at == 0 else part.union(step)), at + length
    part = part.cut(cq.Workplane().box(random.uniform(1.5, 4), 40, 0.4 * at).translate((0, 20, at)))
    hole = cq.Workplane("YZ").circle(random.uniform(1, 3)).extrude(40, both=True)
    return part.cut(hole.translate((0, 0, 3)))


def prism(random: np.random.Generator) -> cq.Workplane:
    """A polygonal prism with a bore and a pin on it."""
    sides, radius, height = int(random.integers(3, 9)), random.uniform(12, 25), random.uniform(6, 25)
    part = cq.Workplane().polygon(sides, 2 * radius).extrude(height)
    part = part.faces(">Z").workplane().hole(random.uniform(3, 0.7 * radius))
    pin = cq.Workplane().circle(random.uniform(1.5, 3)).extrude(random.uniform(5, 20))
    return part.union(pin.translate((0.62 * radius, 0, 0.5 * height)))


FAMILIES = (plate, bracket, housing, shaft, prism)


def make(number: int) -> cq.Workplane:
    """The part of a number, with fillets and chamfers at as many of its edges as the kernel manages."""
    random = np.random.default_rng(number)
    part = FAMILIES[number % len(FAMILIES)](random)
    for selector in random.permutation(["|Z", "|X", "|Y", ">Z", "<Z", "%CIRCLE"])[:3]:
        size = random.uniform(0.4, 2.5)
        for smaller in (size, 0.5 * size, 0.25 * size):
            try:
                edges = part.edges(selector)
                cut = edges.fillet(smaller) if random.random() < 0.6 else edges.chamfer(smaller)
                if cut.val().isValid() and len(cut.solids().vals()) == 1:
                    part = cut
                    break
            except Exception:  # The kernel's own, of many kinds.
                continue
    return part


def export(number: int, path: Path) -> None:
    """Writes the part of a number as STL."""
    cq.exporters.export(make(number), str(path), tolerance=TOLERANCE, angularTolerance=ANGLE)


def run(program: str, source: Path, vertices: int, folder: Path) -> str:
    """Remeshes a part; gives the columns of its row after the number."""
    report = folder / "report.json"
    call = [program, "remesh", source, folder / "out.ply", "-n", str(vertices), "--quiet", "--report", report]
    begin = time.monotonic()
    ended = subprocess.run(call, capture_output=True, text=True, env={"RTFMESH_DEVICE": "cpu", **os.environ})
    seconds = time.monotonic() - begin
    if ended.returncode != 0:
        return f"{vertices}\t{seconds:.2f}\t{' '.join(ended.stderr.split())[:150]}"
    found = json.loads(report.read_text())
    quality, distances = found["output"]["quality"], found["output"]["distances"]
    shares = [100 * quality[name] for name in ("fraction_below_30", "fraction_above_90")]
    figures = [quality["min_angle"], quality["mean_quality"], *shares]
    figures += [distances["rms"], distances["hausdorff"]]
    row = "\t".join(f"{value:.{digits}f}" for value, digits in zip(figures, (1, 3, 2, 2, 4, 3), strict=True))
    return f"{vertices}\t{seconds:.2f}\t{row}\t{' '.join(found['warning_codes'])}"


def main() -> None:
    """Reads the arguments and makes one part, or remeshes many."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--program", default="target/release/rtfmesh")
    parser.add_argument("--first", type=int, default=0, help="number of the first part")
    parser.add_argument("--count", type=int, default=24, help="how many parts")
    parser.add_argument("--out", type=Path, help="the table (default: standard output)")
    parser.add_argument("--make", type=int, metavar="NUMBER", help="write this part to --to instead")
    parser.add_argument("--to", type=Path, default=Path("part.stl"))
    arguments = parser.parse_args()
    numbers = range(arguments.first, arguments.first + arguments.count)
    if arguments.make is not None:
        export(arguments.make, arguments.to)
        return
    with tempfile.TemporaryDirectory() as folder:
        for number in numbers:
            source = Path(folder) / f"{number}.stl"
            export(number, source)
            for vertices in VERTICES:
                row = f"{number}\t{run(arguments.program, source, vertices, Path(folder))}"
                if arguments.out:
                    with arguments.out.open("a") as table:
                        table.write(row + "\n")
                else:
                    print(row, flush=True)
            source.unlink()


if __name__ == "__main__":
    main()
