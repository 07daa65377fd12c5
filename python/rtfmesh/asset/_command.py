"""`rtfmesh asset`."""

from __future__ import annotations

import argparse
import json
import sys
import time
import warnings
from pathlib import Path
from typing import Any

from .._errors import Cancelled, DeviceError, Error, InputError, MeshWarning, OutputError
from .._files import Mesh, read
from . import SIDES, Asset, SourceError, has_linear_colours, make

# As the other commands have them; of two that fit, the first. All others are 1.
EXIT_CODES = {SourceError: 3, InputError: 2, DeviceError: 4, Cancelled: 130}


def parser() -> argparse.ArgumentParser:
    """The command's options."""
    found = argparse.ArgumentParser(
        prog="rtfmesh asset",
        description="Make a mesh with baked textures: remesh to a number of triangles, cut the surface into "
        "charts, and bake colours, materials and normals of the input into pictures.",
        epilog="example: rtfmesh asset sculpt.glb sculpt-20k.glb --faces 20k --texture 2048",
    )
    found.add_argument("input", metavar="INPUT", help="mesh file; its materials and pictures are read")
    found.add_argument("output", metavar="OUTPUT", help="name of the .glb file to write")
    add = found.add_argument
    add("--faces", metavar="N", default="20k", help="number of triangles, such as 5000 or 20k [default: 20k]")
    add("--texture", metavar="SIDE", type=int, default=2048, help="texels a side [default: 2048]")
    add("--wrap", metavar="LENGTH", help="first make one closed surface; gaps below this are closed")
    add("--fill-holes", metavar="SIZE", help="fill holes up to this diameter, such as 2%%")
    add("--weld", metavar="LENGTH", help="merge vertices that are as close as this")
    add("--feature-angle", metavar="DEGREES", help="keep edges sharper than this angle")
    add("--quality", choices=("draft", "normal", "best"), help="effort of the remeshing")
    add("--no-normals", action="store_true", help="make no picture of normals")
    add("--device", metavar="DEVICE", help="index or name of a device, or cpu, or gpu")
    add("--report", metavar="FILE", help="write counts and the report of the remeshing as JSON")
    add("-q", "--quiet", action="store_true", help="say nothing but warnings and errors")
    return found


def main(arguments: list[str]) -> int:
    """Runs the command; returns its exit code."""
    given = parser().parse_args(arguments)
    say = Teller(given.quiet)
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("always", MeshWarning)
            warnings.showwarning = lambda message, *_, **__: tell(f"warning: {message}")
            return run(given, say)
    except Error as error:
        # What options are called here.
        tell(f"error: {str(error).replace('`faces`', '--faces')}")
        return next((code for kind, code in EXIT_CODES.items() if isinstance(error, kind)), 1)


def tell(text: str) -> None:
    """Says something on standard error, without what would control a terminal, as names of files may."""
    plain = "".join(c if c.isprintable() else c.encode("unicode_escape").decode() for c in text)
    print(plain, file=sys.stderr, flush=True)


class Teller:
    """Says on standard error what is being done."""

    def __init__(self, is_quiet: bool) -> None:
        self.is_quiet = is_quiet

    def __call__(self, text: str) -> None:
        if not self.is_quiet:
            tell(text)


def run(given: argparse.Namespace, say: Teller) -> int:
    """Makes and writes the asset, and its report."""
    if Path(given.output).suffix.lower() != ".glb":
        raise InputError(f"'{given.output}' is no .glb file, which alone holds pictures; name one")
    if not SIDES[0] <= given.texture <= SIDES[1]:
        raise InputError(f"--texture {given.texture} is out of range; use {SIDES[0]} to {SIDES[1]} texels")
    for path in filter(None, (given.output, given.report)):
        if not Path(path).parent.is_dir():
            raise OutputError(f"{path}: there is no such folder; make it first")
    start = time.monotonic()
    names = ("wrap", "fill_holes", "weld", "feature_angle", "quality", "device")
    options = {name: value for name in names if (value := getattr(given, name)) is not None}
    made = make(
        opened(given.input),
        given.faces,
        texture=given.texture,
        normals=not given.no_normals,
        linear_colours=has_linear_colours(given.input),
        told=say,
        **options,
    )
    for note in made.notes:
        say(f"note: {note}")
    made.write(given.output)
    if given.report:
        write_report(given.report, made)
    say(
        f"{given.output}: {len(made.faces)} triangles in {made.charts} charts, "
        f"{', '.join(made.pictures)} of {given.texture} x {given.texture} texels, "
        f"{time.monotonic() - start:.1f} s"
    )
    return 0


def opened(path: str) -> Mesh:
    """The mesh of a file with its materials."""
    try:
        return read(path, materials=True)
    except InputError as error:
        raise SourceError(str(error)) from None


def write_report(path: str, made: Asset) -> None:
    """Writes what a report has as JSON."""
    try:
        Path(path).write_text(json.dumps(summary(made), indent=2) + "\n", encoding="utf-8")
    except OSError as error:
        raise OutputError(f"{path}: {error.strerror}; the mesh was written, and its report was not") from None


def summary(made: Asset) -> dict[str, Any]:
    """What a report has."""
    return {
        "vertices": len(made.vertices),
        "faces": len(made.faces),
        "charts": made.charts,
        "covered": made.covered,
        "pictures": list(made.pictures),
        "notes": made.notes,
        "remeshing": made.report,
    }
