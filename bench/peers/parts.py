#!/usr/bin/env python3
"""Makes CAD parts with sharp edges and thin walls, with manifold3d: parts.py FOLDER.

Triangles are those of the Boolean operations: long and thin, as CAD programs write them.
"""

import math
import pathlib
import sys

import numpy as np
from manifold3d import CrossSection, Manifold
from meshes import write_ply


def box(x, y, z):
    return Manifold.cube((x, y, z), True)


def cylinder(height, radius, sides=48):
    return Manifold.cylinder(height, radius, radius, sides, True)


def polar(radius, degrees, z=0.0):
    angle = math.radians(degrees)
    return radius * math.cos(angle), radius * math.sin(angle), z


def crank_case():
    """A hollow box with bearing seats, ribs and bolt holes."""
    part = box(20, 10, 8) - box(19, 9, 7.6).translate((0, 0, 0.6))
    for x in (-6, 0, 6):
        part += box(0.5, 9.4, 5).translate((x, 0, -0.8))
        part -= cylinder(24, 1.6, 64).rotate((0, 90, 0)).translate((x, 0, 0.6))
    part += (box(22, 12, 0.5) - box(18.6, 8.6, 2)).translate((0, 0, 3.8))
    for side in (-1, 1):
        for k in range(9):
            part -= cylinder(3, 0.25, 24).translate((-9.6 + 2.4 * k, side * 5.4, 4))
        for k in range(8):
            part += box(0.12, 1.2, 6).translate((-8 + 2.3 * k, side * 5.3, 0))
    return part


def casting():
    """A pipe with a flange, ribs and a branch that meets it at a curve."""
    bore = cylinder(7, 2.4, 96)
    part = cylinder(6, 3, 96) - bore
    part += (cylinder(0.6, 5, 96) - cylinder(2, 2.4, 96)).translate((0, 0, -2.7))
    for degrees in range(0, 360, 60):
        part -= cylinder(3, 0.35, 32).translate(polar(4, degrees, -2.7))
        part += box(2.2, 0.25, 3).translate((3.4, 0, -1.2)).rotate((0, 0, degrees + 30))
    part += cylinder(4, 1.2, 64).rotate((0, 90, 0)).translate((3.5, 0, 1))
    return part - cylinder(6, 0.9, 64).rotate((0, 90, 0)).translate((4.5, 0, 1)) - bore


def thin_walls():
    """A tray with crossing walls and holes, some of which cut the walls."""
    random = np.random.default_rng(3)
    part = box(10, 8, 3) - box(9.8, 7.8, 3).translate((0, 0, 0.1))
    for k in range(5):
        part += box(0.1, 7.8, 2.6).translate((-3.6 + 1.8 * k, 0, 0))
    for k in range(3):
        part += box(9.8, 0.08, 2.4).translate((0, -2 + 2 * k, 0))
    for x, y in random.uniform((-4.5, -3.5), (4.5, 3.5), (12, 2)):
        part -= cylinder(9, 0.2, 20).translate((x, y, 0))
    return part


def assembly():
    """Plates, tubes, washers and open boxes that do not touch."""
    random = np.random.default_rng(14)
    kinds = [
        lambda: box(*random.uniform((1, 1, 0.05), (4, 4, 0.2))),
        lambda: cylinder(random.uniform(1, 4), 0.5, 32) - cylinder(9, 0.42, 32),
        lambda: cylinder(0.1, random.uniform(0.5, 1.5), 32) - cylinder(1, 0.3, 24),
        lambda: box(3, 3, 2) - box(2.8, 2.8, 2).translate((0, 0, 0.1)),
    ]
    parts = []
    for k in range(14):
        turned = kinds[k % 4]().rotate(tuple(90.0 * random.integers(0, 4, 3)))
        parts.append(turned.translate((5.0 * (k % 4), 5.0 * (k // 4), 0)))
    return Manifold.compose(parts)


def heat_sink():
    """Thin fins on a plate with holes."""
    part = box(10, 6, 0.4)
    for k in range(16):
        part += box(0.12, 6, 2.4).translate((-4.7 + 0.625 * k, 0, 1.2))
    for x in (-4.4, 4.4):
        for y in (-2, 2):
            part -= cylinder(9, 0.18, 24).translate((x, y, 0))
    return part


def gear():
    """Helical teeth, a bore with a keyway and five holes."""
    teeth, outline = 36, ((0, 3), (0.22, 3.3), (0.45, 3.3), (0.7, 3))
    points = [polar(r, 360 * (k + a) / teeth)[:2] for k in range(teeth) for a, r in outline]
    part = Manifold.extrude(CrossSection([points]), 0.8, 12, 12) - cylinder(10, 0.8)
    for k in range(5):
        part -= cylinder(10, 0.55, 40).translate(polar(1.8, 72 * k))
    return part - box(0.3, 0.3, 5).translate((0.85, 0, 0))


def main():
    folder = pathlib.Path(sys.argv[1])
    folder.mkdir(parents=True, exist_ok=True)
    for make in (assembly, casting, crank_case, gear, heat_sink, thin_walls):
        mesh = make().to_mesh()
        name = make.__name__.replace("_", "-") + ".ply"
        write_ply(folder / name, np.asarray(mesh.vert_properties)[:, :3], np.asarray(mesh.tri_verts))


if __name__ == "__main__":
    main()
