"""Cells of a result's vertices."""

import numpy as np


def test_cells_tile_the_surface(torus, remesher):
    result = remesher.remesh(torus, 300, cells=True)
    cells = result.cells
    assert cells.kind == "exact"
    assert set(cells.cells) == set(range(300))
    polygons = cells.polygons()
    assert len(polygons) == len(cells.cells)
    area = 0.0
    for corners in polygons:
        at = cells.vertices[corners]
        area += np.linalg.norm(np.cross(at[1:-1] - at[0], at[2:] - at[0]).sum(axis=0)) / 2
    sides = torus.vertices[torus.faces]
    whole = np.linalg.norm(np.cross(sides[:, 1] - sides[:, 0], sides[:, 2] - sides[:, 0]), axis=1).sum() / 2
    assert abs(area / whole - 1) < 1e-9
    assert remesher.remesh(torus, 300).cells is None
