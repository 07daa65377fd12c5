#!/usr/bin/env python3
"""Draws meshes side by side, flat-shaded with their edges, into one PNG: the picture of the README.

Needs numpy and Pillow:  python3 -m venv venv && venv/bin/pip install numpy Pillow
The README's picture:    ./ci/demo.sh
                         target/release/rtfmesh remesh out/genus3.obj out/area.ply -n 2000 --centroid area
                         venv/bin/python ci/picture.py out/genus3.obj out/area.ply docs/pictures/demo.png

Reads what rtfmesh writes: OBJ, and binary PLY with double coordinates. All meshes are drawn in the frame of the first.
"""

import sys

import numpy as np
from PIL import Image

WIDTH, HEIGHT, SUPER = 720, 380, 3  # pixels of a panel, and samples per pixel along each axis
TILT, TURN, CAMERA = np.radians(-22.0), np.radians(-9.0), 5.0  # camera distance in mesh radii
LIGHTS = [((-0.45, 0.65, 0.62), 0.70), ((0.8, 0.1, 0.45), 0.28)]
AMBIENT, BASE, EDGE, EDGE_PIXELS = 0.28, np.array([0.50, 0.70, 0.90]), np.array([0.07, 0.11, 0.20]), 0.42


def read(path):
    """Vertices and triangles of an .obj or .ply file."""
    if path.endswith(".obj"):
        lines = [line.split() for line in open(path, encoding="utf-8")]
        vertices = [list(map(float, line[1:4])) for line in lines if line[:1] == ["v"]]
        faces = [[int(word.split("/")[0]) - 1 for word in line[1:4]] for line in lines if line[:1] == ["f"]]
        return np.array(vertices), np.array(faces)
    data = open(path, "rb").read()
    header, body = data.split(b"end_header\n", 1)
    counts = [int(line.split()[2]) for line in header.splitlines() if line.startswith(b"element")]
    vertices = np.frombuffer(body, "<f8", 3 * counts[0]).reshape(-1, 3)
    faces = np.frombuffer(body, np.dtype([("n", "u1"), ("v", "<u4", 3)]), counts[1], offset=24 * counts[0])
    return vertices, faces["v"].astype(int)


def view(vertices, centre, radius):
    """Camera coordinates: x right, y up, z towards the viewer, in mesh radii."""
    (ct, st), (cz, sz) = (np.cos(TILT), np.sin(TILT)), (np.cos(TURN), np.sin(TURN))
    turn = np.array([[cz, -sz, 0], [sz, cz, 0], [0, 0, 1]])
    tilt = np.array([[1, 0, 0], [0, ct, -st], [0, st, ct]])
    return (vertices - centre) / radius @ (tilt @ turn).T


def shade(normal):
    """Colour of a face with this unit normal: two lamps and a little gloss."""
    light = AMBIENT
    for direction, power in LIGHTS:
        direction = np.array(direction) / np.linalg.norm(direction)
        light += power * max(0.0, normal @ direction)
        half = (direction + [0, 0, 1]) / np.linalg.norm(direction + [0, 0, 1])
        light += 0.18 * power * max(0.0, normal @ half) ** 40
    return np.clip(BASE * light, 0, 1)


def draw(points, faces, zoom):
    """One panel: rasterises every triangle with a depth buffer and darkens what lies near an edge."""
    width, height = WIDTH * SUPER, HEIGHT * SUPER
    image, depth = np.ones((height, width, 3)), np.full((height, width), -np.inf)
    perspective = zoom * CAMERA / (CAMERA - points[:, 2:])
    screen = points[:, :2] * perspective * [1, -1] + [width / 2, height / 2]
    nearness = 1.0 / (CAMERA - points[:, 2])  # linear on the screen, unlike the distance
    for face in faces:
        a, b, c = screen[face]
        twice = (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
        if twice >= 0:  # the screen's y points down, so front faces turn clockwise
            continue
        low = np.maximum(np.floor(screen[face].min(0)).astype(int), 0)
        high = np.minimum(np.ceil(screen[face].max(0)).astype(int) + 1, [width, height])
        x, y = np.meshgrid(np.arange(low[0], high[0]) + 0.5, np.arange(low[1], high[1]) + 0.5)
        # Barycentric weight and distance in pixels from the opposite edge, corner by corner.
        weights, distances = [], []
        for p, q in ((b, c), (c, a), (a, b)):
            cross = (q[0] - p[0]) * (y - p[1]) - (q[1] - p[1]) * (x - p[0])
            weights.append(cross / twice)
            distances.append(-cross / np.hypot(*(q - p)))
        near = sum(w * n for w, n in zip(weights, nearness[face]))
        box = np.s_[low[1]:high[1], low[0]:high[0]]
        seen = (np.minimum.reduce(weights) >= 0) & (near > depth[box])
        u, v = points[face[1]] - points[face[0]], points[face[2]] - points[face[0]]
        normal = np.cross(u, v)
        colour = shade(normal / max(np.linalg.norm(normal), 1e-300))
        # A line of constant width, soft over one sample.
        line = np.clip(EDGE_PIXELS * SUPER + 0.5 - np.minimum.reduce(distances), 0, 1)[..., None] * 0.85
        image[box][seen] = ((1 - line) * colour + line * EDGE)[seen]
        depth[box][seen] = near[seen]
    return image.reshape(HEIGHT, SUPER, WIDTH, SUPER, 3).mean((1, 3))


def main():
    *inputs, output = sys.argv[1:]
    if not inputs:
        sys.exit(f"usage: {sys.argv[0]} MESH... PICTURE.png")
    meshes = [read(path) for path in inputs]
    low, high = meshes[0][0].min(0), meshes[0][0].max(0)
    centre, radius = (low + high) / 2, np.linalg.norm(high - low) / 2
    first = view(meshes[0][0], centre, radius)
    flat = np.abs(first[:, :2] * CAMERA / (CAMERA - first[:, 2:])).max(0)
    zoom = SUPER * 0.47 * min(WIDTH / flat[0], HEIGHT / flat[1])
    panels = [draw(view(vertices, centre, radius), faces, zoom) for vertices, faces in meshes]
    picture = (np.concatenate(panels, 1) * 255).round().astype(np.uint8)
    Image.fromarray(picture).quantize(96, dither=Image.Dither.NONE).save(output, optimize=True)


main()
