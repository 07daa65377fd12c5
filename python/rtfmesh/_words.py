"""Keyword arguments as the command line's words, which are checked in one place for both."""

from __future__ import annotations

import difflib
import operator
import os
from functools import cache
from typing import Any, TypeGuard

import numpy as np
from numpy.typing import NDArray

from . import _native
from ._arrays import Vertices, as_array, indices, real_numbers
from ._errors import InputError

# The name under which `sizing` numbers travel.
SIZING = "sizing"


@cache
def flags() -> dict[str, bool]:
    """The options of the command line under Python's names, and whether each has a value."""
    options = _native.options()
    return {name.replace("-", "_"): value is not None for name, value, *_ in options if name != "vertices"}


def word(name: str, value: Any) -> str:
    """The value of an option as the command line has it."""
    if isinstance(value, (str, os.PathLike)):
        return os.fspath(value)
    if isinstance(value, (bool, np.bool_)):
        raise InputError(f"`{name}` is {value}; it takes a number or a word")
    try:
        return str(operator.index(value))
    except TypeError:
        pass
    try:
        return repr(float(value))
    except (TypeError, ValueError):
        raise InputError(f"`{name}` is of type {type(value).__name__}; it takes a number or a word") from None


def count_word(n: Any) -> str:
    """A number of vertices, which may have come out of a division."""
    if isinstance(n, (float, np.floating)) and float(n).is_integer():
        n = int(n)
    return word("n", n)


def words(n: Any, options: dict[str, Any], function: str = "remesh") -> list[str]:
    """The command line for a number of vertices and options, which the function of this name was given.

    Raises `TypeError` for an option that there is not, `InputError` for a value of the wrong type; ranges are
    the command line's business.
    """
    found = [] if n is None else [f"--vertices={count_word(n)}"]
    known = flags()
    for name, value in options.items():
        if name not in known:
            close = difflib.get_close_matches(name, known, 1)
            hint = f"; did you mean '{close[0]}'?" if close else ""
            raise TypeError(f"{function}() got an unexpected keyword argument '{name}'{hint}")
        if value is None:
            continue
        flag = f"--{name.replace('_', '-')}"
        if known[name]:
            found.append(f"{flag}={word(name, value)}")
        elif isinstance(value, (bool, np.bool_)):
            found += [flag] if value else []
        else:
            raise InputError(f"`{name}` is {value!r}; it is True or False")
    return found


def is_word(value: object) -> TypeGuard[str | os.PathLike[str] | None]:
    """Whether an option that may also be an array is not."""
    return value is None or isinstance(value, (str, os.PathLike))


def take_sizing(options: dict[str, Any], vertices: Vertices) -> Vertices | None:
    """The numbers that edge lengths are in proportion to, if `sizing` is an array; leaves a word for it."""
    value: Any = options.get("sizing")
    if is_word(value):
        return None
    options["sizing"] = f"property:{SIZING}"
    return real_numbers(value, "sizing", (len(vertices),))


def take_features(options: dict[str, Any], vertices: Vertices) -> NDArray[np.float64] | None:
    """The ends (L, 2, 3) of the edges to keep, if `features` is an array of indices; takes it out."""
    value: Any = options.get("features")
    if is_word(value):
        return None
    del options["features"]
    if as_array(value, "features").size == 0:
        return None
    return np.ascontiguousarray(vertices[indices(value, "features", 2, len(vertices))])
