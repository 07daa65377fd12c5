"""The command line that comes with the package."""

import signal
import sys

from ._native import run_program

# The one command that is written in Python, since it needs packages of Python.
ASSET = "asset"


def main() -> int:
    """Runs the program with this process's arguments; returns its exit code."""
    # Python's own handler would only note Ctrl-C, and nothing would ever look. The program sets another one
    # where there is something to tidy up.
    signal.signal(signal.SIGINT, signal.SIG_DFL)
    if sys.argv[1:2] == [ASSET]:
        return asset(sys.argv[2:])
    return run_program(["rtfmesh", *sys.argv[1:]])


def asset(arguments: list[str]) -> int:
    """`rtfmesh asset`, if the packages that it needs are there."""
    try:
        from .asset._command import main as command
    except ModuleNotFoundError as error:
        needs = f"`rtfmesh asset` needs the package {error.name}"
        print(f"error: {needs}; install it: pip install 'rtfmesh[asset]'", file=sys.stderr)
        return 2
    return command(arguments)
