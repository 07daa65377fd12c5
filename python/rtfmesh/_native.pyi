"""The native module; the package's other modules call it with arguments that they have checked."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any, final

import numpy as np
from numpy.typing import NDArray

from ._attributes import Given
from ._figures import Drawing
from ._remesher import Request

__version__: str

Mesh = tuple[NDArray[np.float64], NDArray[np.uint32]]
Places = tuple[NDArray[np.uint32], NDArray[np.float64]]

@final
class Materials:
    """What a file says of materials; opaque."""

    @staticmethod
    def textured(
        pictures: tuple[bytes | None, bytes | None, bytes | None, bytes | None],
        surface: tuple[float, float],
        alpha: str,
        double_sided: bool,
    ) -> Materials:
        """One material with the pictures of colour, metalness with roughness, normals and light, as PNG.

        `surface` is metalness and roughness; `alpha` "opaque", "mask" or "blend".
        """

    def json(self) -> str | None:
        """Materials, textures and samplers as JSON, as glTF has them; None if there are none."""

    def images(self) -> list[bytes]:
        """The bytes of the pictures that textures refer to."""

@final
class Device:
    """An open device, with what was compiled for it; `memory` is in MiB."""

    def __new__(cls, device: str | None, memory: int | None, timings: bool) -> Device: ...
    def info(self) -> str:
        """As one of `devices`, as JSON."""

def devices(test: bool) -> str:
    """The devices of this machine as JSON; `test` runs the self-test of those that were never used."""

def check(options: list[str]) -> None:
    """Checks options as far as that is possible without a mesh and without files."""

def options() -> list[tuple[str, str | None, list[str], str]]:
    """Name, what its value is, all values it may have, and what it does, of each option of `remesh`."""

def remesh(
    device: Device, given: Mesh, options: list[str], request: Request
) -> tuple[Mesh, tuple[Any, ...], Places, Places, str, tuple[Any, ...] | None]:
    """Mesh, attributes, places of the vertices and of the faces, report as JSON, cells."""

def follow(input: Mesh, result: Mesh, poses: NDArray[np.float64]) -> NDArray[np.float64]:
    """The vertices of a result (F, N, 3) in all poses of its input (F, V, 3)."""

def locate(
    given: Mesh, points: NDArray[np.float64], normals: NDArray[np.float64] | None, margin: float
) -> Places:
    """The places of points on a mesh, each (N, 3)."""

def measure(
    given: Mesh, against: Mesh | None, accuracy: float | None, energy: bool, feature_angle: float | None
) -> str:
    """The measures as JSON."""

def inspect(
    given: Mesh,
    vertices: int | None,
    feature_angle: float,
    features: NDArray[np.float64] | None,
    features_file: Path | None,
) -> str:
    """The topology, repairs and features as JSON."""

def render(meshes: Sequence[Mesh], drawing: Drawing) -> NDArray[np.uint8]:
    """The bytes of a PNG, or those of the pixels (height x width x 4)."""

def repair(given: Mesh, options: list[str]) -> tuple[Mesh, NDArray[np.uint32], str, list[str]]:
    """The repaired mesh, the input's face of each of its faces, and what was repaired: as JSON, in words."""

def read(
    path: Path, format: str | None, materials: bool, points: bool
) -> tuple[Mesh, tuple[Any, ...], list[str]]:
    """Mesh, attributes, and what was left out of the file or changed."""

def sample(name: str) -> Mesh:
    """A built-in model."""

def write(path: Path, given: Mesh, attributes: Given, format: str | None) -> list[str]:
    """Writes, and returns what the format cannot hold."""

def run_program(args: list[str]) -> int:
    """Runs the program with these arguments, its own name first; returns its exit code."""
