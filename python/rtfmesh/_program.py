"""The command line that comes with the package."""

import signal
import sys

from ._native import run_program


def main() -> int:
    """Runs the program with this process's arguments; returns its exit code."""
    # Python's own handler would only note Ctrl-C, and nothing would ever look. The program sets another one
    # where there is something to tidy up.
    signal.signal(signal.SIGINT, signal.SIG_DFL)
    return run_program(["rtfmesh", *sys.argv[1:]])
