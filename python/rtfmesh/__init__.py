"""Remeshes surfaces into well-shaped triangles with exactly N vertices, on any Vulkan device.

    import rtfmesh

    mesh = rtfmesh.read("scan.ply")
    result = rtfmesh.remesh(mesh, 10_000)
    rtfmesh.write("scan-10k.ply", result)

`rtfmesh.reconstruct` builds and remeshes a surface through points, `rtfmesh.contour` one in a volume.
`rtfmesh.pyvista`, `rtfmesh.trimesh`, `rtfmesh.meshio` and `rtfmesh.vtk` do the same for the meshes of these
packages, and `rtfmesh.asset` makes a mesh with baked textures.
"""

from importlib import import_module as _import_module
from typing import Any as _Any

from ._attributes import Attributes
from ._drivers import add_cpu_driver
from ._errors import Cancelled, DeviceError, Error, InputError, MeshWarning, OutOfMemoryError, OutputError
from ._figures import devices, inspect, measure, render
from ._files import Mesh, read, sample, write
from ._follow import follow
from ._locate import locate
from ._native import __version__
from ._options import Options, Research
from ._progress import Progress
from ._remesh import contour, reconstruct, remesh
from ._remesher import Remesher
from ._repair import Repaired, repair
from ._result import Cells, Correspondence, LocatedResult, Result

add_cpu_driver()

# What needs packages that may not be installed, and takes longer to import.
_LAZY = ("asset", "meshio", "pyvista", "ray", "trimesh", "vtk")


def __getattr__(name: str) -> _Any:
    if name in _LAZY:
        return _import_module(f"{__name__}.{name}")
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")


def __dir__() -> list[str]:
    return sorted({*globals(), *_LAZY})


__all__ = [
    "Attributes",
    "Cancelled",
    "Cells",
    "Correspondence",
    "DeviceError",
    "Error",
    "InputError",
    "LocatedResult",
    "Mesh",
    "MeshWarning",
    "Options",
    "OutOfMemoryError",
    "OutputError",
    "Progress",
    "Remesher",
    "Repaired",
    "Research",
    "Result",
    "__version__",
    "contour",
    "devices",
    "follow",
    "inspect",
    "locate",
    "measure",
    "read",
    "reconstruct",
    "remesh",
    "render",
    "repair",
    "sample",
    "write",
]
