#!/usr/bin/env python3
"""Takes random points from a mesh, for reconstruction: points.py IN.ply OUT.xyz COUNT [options].

Points are even by area. --noise S moves each by Gaussian noise of S percent of the diagonal, --uneven R makes
points R times as dense at one end of the longest axis as at the other, --normals adds the faces' normals.
Needs numpy.
"""

import argparse

import numpy as np
from meshes import read_ply


def sample(points, faces, count, rng, uneven):
    """Points and normals of their faces, two arrays of count × 3."""
    corners = points[faces]
    doubled = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    area = np.linalg.norm(doubled, axis=1)
    axis = np.argmax(np.ptp(points, axis=0))
    along = corners[:, :, axis].mean(axis=1)
    share = (along - along.min()) / np.ptp(along)
    weight = area * uneven**-share
    chosen = rng.choice(len(faces), count, p=weight / weight.sum())
    root, other = np.sqrt(rng.random(count)), rng.random(count)
    weights = np.stack([1 - root, root * (1 - other), root * other], axis=1)
    return np.einsum("nk,nkd->nd", weights, corners[chosen]), doubled[chosen] / area[chosen, None]


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("mesh")
    parser.add_argument("points")
    parser.add_argument("count", type=int)
    parser.add_argument("--noise", type=float, default=0.0, metavar="S")
    parser.add_argument("--uneven", type=float, default=1.0, metavar="R")
    parser.add_argument("--normals", action="store_true")
    parser.add_argument("--seed", type=int, default=1)
    args = parser.parse_args()
    rng = np.random.default_rng(args.seed)
    points, faces = read_ply(args.mesh)
    diagonal = np.linalg.norm(np.ptp(points, axis=0))
    taken, normals = sample(points, faces, args.count, rng, args.uneven)
    taken = taken + rng.normal(scale=args.noise / 100 * diagonal, size=taken.shape)
    np.savetxt(args.points, np.hstack([taken, normals]) if args.normals else taken, fmt="%.9g")


if __name__ == "__main__":
    main()
