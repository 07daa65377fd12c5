"""`python -m rtfmesh.ray`: remeshes the meshes of a list."""

from __future__ import annotations

import argparse
import sys
from typing import Any

from .._errors import Error
from .._words import flags, with_research
from ._pipeline import remesh_manifest

EXAMPLES = """examples:
  python -m rtfmesh.ray meshes.csv remeshed -n 10k --workers 2
  python -m rtfmesh.ray meshes.parquet remeshed --option quality=best --option keep_uv=true"""


def option(text: str) -> tuple[str, Any]:
    """NAME=VALUE; true and false are for options that have no other values."""
    name, _, value = text.partition("=")
    name = name.replace("-", "_")
    if name == "no_fit" and not value:
        return "fit", False
    truth = {"": True, "true": True, "false": False}
    return name, truth.get(value.lower(), value) if flags().get(name) is False else value


def parsed(args: list[str] | None) -> argparse.Namespace:
    """The command line."""
    parser = argparse.ArgumentParser(
        prog="python -m rtfmesh.ray",
        description="Remesh the meshes of a list with Ray, and go on where an earlier run was stopped.",
        epilog=EXAMPLES + "\n\nRAY_ADDRESS says which cluster; without it, this machine is one.",
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("manifest", help="CSV or Parquet file with columns id, path, and n or other options")
    parser.add_argument("out", help="folder for the results, their records and status.csv")
    parser.add_argument("-n", help="number of vertices, such as 10k")
    parser.add_argument("--suffix", default=".ply", help="extension of the results [default: .ply]")
    parser.add_argument("--workers", type=int, help="processes [default: as many as there is room for]")
    parser.add_argument("--gpus-per-worker", type=float, help="0 to 1 [default: 1 if there are GPUs, else 0]")
    parser.add_argument("--cpus-per-worker", type=float, default=1, help="cores [default: 1]")
    parser.add_argument("--device", help="device of all workers, as rtfmesh's --device")
    parser.add_argument("--batch-size", type=int, help="meshes at a time [default: 16 or more]")
    parser.add_argument(
        "--option",
        type=option,
        action="append",
        default=[],
        metavar="NAME=VALUE",
        help="an option of rtfmesh remesh; may be repeated",
    )
    parser.add_argument("--quiet", action="store_true", help="no bar")
    return parser.parse_args(args)


def main(args: list[str] | None = None) -> int:
    """Returns the exit code: 0, 1 if meshes failed, 2 if nothing could begin, 130 after Ctrl-C."""
    given = vars(parsed(args))
    options: dict[str, Any] = with_research(dict(given.pop("option")))
    progress = not given.pop("quiet")
    manifest, out = given.pop("manifest"), given.pop("out")
    try:
        summary = remesh_manifest(manifest, out, progress=progress, **given, **options)
    except (Error, TypeError) as error:
        print(f"error: {error}", file=sys.stderr)
        return 2
    except KeyboardInterrupt:
        print("stopped; the same command goes on where it was", file=sys.stderr)
        return 130
    print(summary)
    return 1 if summary.failed else 0


if __name__ == "__main__":
    sys.exit(main())
