"""A coloured surface of PyVista's before and after, in one picture.

    python accessor.py picture.png
"""

import sys

import numpy as np
import pyvista as pv


def main():
    """Makes a surface, remeshes it and draws both."""
    wave = pv.ParametricRandomHills(u_res=60, v_res=60, w_res=60, random_seed=3).extract_surface(algorithm=None)
    wave = wave.triangulate().clean()
    wave.clear_data()
    wave["height"] = wave.points[:, 2]
    even = wave.rtfmesh.remesh(3000)
    print(f"{even.n_points} points, heights from {np.min(even['height']):.2f} to {np.max(even['height']):.2f}")
    plotter = pv.Plotter(shape=(1, 2), off_screen=True, window_size=(1000, 420))
    for place, surface in enumerate((wave, even)):
        plotter.subplot(0, place)
        plotter.add_mesh(surface, scalars="height", show_edges=True, show_scalar_bar=False)
    plotter.link_views()
    plotter.screenshot(sys.argv[1])


if __name__ == "__main__":
    main()
