"""A coloured surface of PyVista's before and after, in one picture.

python accessor.py picture.png
"""

import sys

import numpy as np
import pyvista as pv


def main():
    """Makes a surface, remeshes it and draws both."""
    wave = pv.ParametricRandomHills(u_res=160, v_res=25, w_res=25, random_seed=3).triangulate().clean()
    wave.clear_data()
    wave["height"] = wave.points[:, 2]
    even = wave.rtfmesh.remesh(3000)
    low, high = np.min(even["height"]), np.max(even["height"])
    print(f"{even.n_points} points, heights from {low:.2f} to {high:.2f}")
    plotter = pv.Plotter(shape=(1, 2), off_screen=True, window_size=(1000, 420))
    for place, surface in enumerate((wave, even)):
        plotter.subplot(0, place)
        plotter.add_mesh(surface, scalars="height", show_edges=True, edge_opacity=0.4, show_scalar_bar=False)
    plotter.link_views()
    plotter.screenshot(sys.argv[1])


if __name__ == "__main__":
    main()
