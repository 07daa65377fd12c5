"""How callers learn of the progress of a run."""

from __future__ import annotations

import inspect
import os
import sys
import traceback
import warnings
from collections.abc import Callable
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any, NamedTuple, NoReturn

from ._errors import InputError

if TYPE_CHECKING:
    from collections.abc import Iterator


class Progress(NamedTuple):
    """Where a run is."""

    phase: str
    """What the run is doing, in a word or two."""
    attempt: int
    """The current attempt, from 1: each has another random start, vertex count or edge lengths."""
    fraction: float
    """Estimated share of the attempt's work that is done, 0 to 1; it never falls within an attempt."""
    iteration: int
    """Iterations done on all levels."""
    iterations: int
    """Largest number of iterations on all levels."""
    step: float
    """Root mean square step of the last iteration, in edge lengths."""


Callback = Callable[[Progress], "str | None"]
# What the native module calls: True makes the run finish early, False stops it.
Native = Callable[..., "bool | None"]

ANSWERS = {None: None, "continue": None, "finish": True, "cancel": False}


def from_callback(callback: Callback) -> Native:
    """What the native module calls for a callable of the caller's."""

    def told(*progress: Any) -> bool | None:
        process, raised = os.getpid(), None
        try:
            answer = callback(Progress(*progress))
        except BaseException as error:
            if os.getpid() == process:
                raise
            raised = error
        if os.getpid() != process:
            _end_fork(raised)
        try:
            return ANSWERS[answer]
        except (KeyError, TypeError):
            text = f"`progress` returned {answer!r}; return None, 'finish' or 'cancel'"
            raise InputError(text) from None

    return told


def check_callback(callback: Callback) -> None:
    """Raises `InputError` for a function that cannot be called with one argument."""
    try:
        signature = inspect.signature(callback)
    except (TypeError, ValueError):
        # Of some that are not written in Python nothing is known.
        return
    try:
        signature.bind(None)
    except TypeError:
        raise InputError(f"`progress` takes {signature}; give a function of one rtfmesh.Progress") from None


def _end_fork(raised: BaseException | None) -> NoReturn:
    """Ends a process that a function forked and then left, normally or by an exception.

    The run that called the function waits for threads that only the other process has.
    """
    status = 1
    if raised is None:
        print(
            "rtfmesh: `progress` returned in a process that it has forked, which ends here; "
            "end that process within the function",
            file=sys.stderr,
        )
    elif not isinstance(raised, SystemExit):
        traceback.print_exception(type(raised), raised, raised.__traceback__)
    elif raised.code is None or isinstance(raised.code, int):
        status = raised.code or 0
    else:
        print(raised.code, file=sys.stderr)
    for stream in (sys.stdout, sys.stderr):
        stream.flush()
    os._exit(status & 0xFF)


@contextmanager
def shown(progress: bool | Callback) -> Iterator[Native | None]:
    """What the native module calls: with True it moves a bar of tqdm's."""
    if callable(progress):
        check_callback(progress)
        yield from_callback(progress)
        return
    if not isinstance(progress, bool):
        raise InputError(
            f"`progress` is {progress!r}; give True, False or a function of one rtfmesh.Progress"
        )
    if not progress:
        yield None
        return
    try:
        from tqdm.auto import tqdm
    except ImportError:
        warnings.warn("no progress bar: tqdm is not installed (pip install tqdm)", stacklevel=4)
        yield None
        return
    with tqdm(total=100, unit="%", bar_format="{desc}: {percentage:3.0f}%|{bar}| {elapsed}") as bar:

        def told(phase: str, attempt: int, fraction: float, *_: Any) -> None:
            bar.set_description_str(phase if attempt == 1 else f"attempt {attempt}: {phase}", refresh=False)
            bar.n = 100 * fraction
            bar.refresh()

        yield told
        bar.n = 100
        bar.refresh()
