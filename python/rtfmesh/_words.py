"""Keyword arguments as the command line's words, which are checked in one place for both."""

from __future__ import annotations

import difflib
import inspect
import operator
import os
import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cache, wraps
from typing import Any, ParamSpec, TypeGuard, TypeVar

import numpy as np
from numpy.typing import NDArray

from . import _native
from ._arrays import Vertices, as_array, indices, real_numbers, short
from ._errors import InputError
from ._options import Options

P = ParamSpec("P")
R = TypeVar("R")

# The name under which `sizing` numbers travel.
SIZING = "sizing"


# Options that are True unless the command line has a flag against them.
NEGATED = {"fit": "no_fit"}


# Options under other names than those of the command line, which arguments for meshes have.
RENAMED = {"faces": "n_faces", "points": "fixed_points"}
# Options that may be given several times: a list has all of them.
REPEATED = {"refine", "keep", "only"}


# Settings of methods that are there for comparison; one argument holds them all.
RESEARCH = (
    *("preset", "face", "seeding", "normals", "projection", "neighbours", "centroid"),
    *("k_normal", "k_clip", "k_project", "offset", "momentum", "lbfgs"),
)


@cache
def flags() -> dict[str, bool]:
    """The options of the command line under Python's names, and whether each has a value."""
    options = [(name.replace("-", "_"), value) for name, value, *_ in _native.options()]
    ours = {theirs: name for name, theirs in NEGATED.items()} | RENAMED
    return {ours.get(name, name): value is not None for name, value in options if name != "vertices"}


def word(name: str, value: Any) -> str:
    """The value of an option as the command line has it."""
    if isinstance(value, (str, os.PathLike)):
        return os.fspath(value)
    if isinstance(value, (bool, np.bool_)):
        raise InputError(f"`{name}` is {value}; use a number or a word")
    try:
        return str(operator.index(value))
    except TypeError:
        pass
    try:
        return repr(float(value))
    except (TypeError, ValueError):
        raise InputError(f"`{name}` is of type {type(value).__name__}; use a number or a word") from None


def count_word(n: Any) -> str:
    """A number of vertices, which may have come out of a division."""
    if isinstance(n, (float, np.floating)) and float(n).is_integer():
        n = int(n)
    return word("n", n)


# What other packages call an argument; of several that fit, the first one that a function has is meant.
COUNTS = ("clusters", "n_clusters", "n_points", "n_vertices", "nclus", "num_points", "num_vertices")
FACES = ("n_triangles", "num_faces", "num_triangles", "target_faces", "target_triangles")
ELSEWHERE = {
    "n": (*COUNTS, "number_of_vertices", "target_count", "target_vertices", "vertices"),
    "n_faces": FACES,
    "faces": FACES,
    "edge_length": ("target_edge_length", "targetlen"),
    "ratio": ("target_reduction",),
    "fit": ("no_fit",),
    "iso": ("isovalue", "level", "levels", "threshold"),
    "progress": ("callback", "progress_bar", "show_progress", "verbose"),
    "path": ("file", "filename", "out", "output"),
}


def near(name: str, known: Sequence[str], cutoff: float) -> str | None:
    """The one of `known` that is most like a name, if one is at least as like it as `cutoff`, 0 to 1."""
    return next(iter(difflib.get_close_matches(name, known, 1, cutoff)), None)


@dataclass
class Accepted:
    """The arguments that a function takes."""

    title: str
    """The function's name."""
    own: list[str]
    """Those that it names itself."""
    options: list[str]
    """Those of `Options` that it takes besides."""
    has_options: bool
    """Whether there are any."""

    @property
    def known(self) -> list[str]:
        """All of them."""
        return [*self.own, *self.options]

    def refusal(self, name: str, hint: str) -> TypeError:
        """The exception for another one."""
        return TypeError(f"{self.title}() got an unexpected keyword argument '{name}'{hint}")


def unknown_keyword(name: str, value: Any, function: Accepted) -> TypeError | InputError:
    """The exception for an argument that a function lacks, with the one that may be meant."""
    known = function.known
    if function.has_options and not near(name, function.own, 0.8):
        if name == "report":
            text = "result.report always has the report; distances=True adds distances to it"
            return InputError(f"`report` is not an argument: {text}")
        if name in RESEARCH:
            shown = "..." if short(value).startswith("of type") else short(value)
            return function.refusal(name, f"; did you mean research={{'{name}': {shown}}}?")
    # Beside vertices, faces are triangles, and no number of them.
    counts = [ours for ours in known if ours != "faces" or "vertices" not in known]
    meant = next((ours for ours, theirs in ELSEWHERE.items() if name in theirs and ours in counts), None)
    if meant is None and function.has_options and name in ELSEWHERE["path"]:
        return function.refusal(name, "; rtfmesh.write writes a mesh to a file")
    meant = meant or near(name, known, 0.7)
    return function.refusal(name, f"; did you mean '{meant}'?" if meant else "")


# What `help` says of each option.
TEXTS = {
    entry.partition(" :")[0]: entry
    for entry in re.split(r"\n(?=\S)", inspect.cleandoc(Options.__doc__ or "").partition("\n\n")[2])
}


def parameter(name: str, kind: Any) -> inspect.Parameter:
    """How signatures show an option: flags are True or False; for others, None stands for the default."""
    # The text of a type, as the annotations of other parameters are.
    kind = getattr(kind, "__forward_arg__", kind)
    default = name in NEGATED if kind == "bool" else None
    return inspect.Parameter(name, inspect.Parameter.KEYWORD_ONLY, default=default, annotation=kind)


OPTIONS = [parameter(name, kind) for name, kind in Options.__annotations__.items()]
# Where numpydoc has parameters that are rarely given.
RETURNS = "\nReturns\n-------\n"
OTHERS = "\nOther Parameters\n----------------\n"


def keywords(function: Callable[P, R]) -> Callable[P, R]:
    """The function, with names of arguments checked and, if it takes options, all of these in its signature.

    `help` and the completion of notebooks show them; a `TypeError` suggests the argument that may be meant.
    """
    return keywords_without()(function)


def keywords_without(*refused: str) -> Callable[[Callable[P, R]], Callable[P, R]]:
    """As `keywords`, without some options, which the function refuses with a reason of its own."""

    def decorate(function: Callable[P, R]) -> Callable[P, R]:
        signature = inspect.signature(function)
        own = [one for one in signature.parameters.values() if one.kind is not one.VAR_KEYWORD]
        names = [one.name for one in own if one.name != "self"]
        has_options = len(own) < len(signature.parameters)
        options = [one for one in OPTIONS if has_options and one.name not in (*names, *refused)]
        title = function.__qualname__.removesuffix(".__init__").rpartition(".")[2]
        accepted = Accepted(title, names, [option.name for option in options], has_options)
        allowed = {*accepted.known, *refused}

        @wraps(function)
        def checked(*args: P.args, **given: P.kwargs) -> R:
            for name, value in given.items():
                if name not in allowed:
                    raise unknown_keyword(name, value, accepted)
            return function(*args, **given)

        checked.__signature__ = signature.replace(  # type: ignore[attr-defined]
            parameters=[*own, *options]
        )
        checked.__doc__ = explained(function.__doc__, accepted.options)
        checked._options = accepted.options  # type: ignore[attr-defined]
        return checked

    return decorate


def keywords_of(function: Callable[..., Any], *bound: str) -> Callable[[Callable[P, R]], Callable[P, R]]:
    """For methods that pass keywords on: those of `function` in their signature, without the `bound` ones."""

    def decorate(method: Callable[P, R]) -> Callable[P, R]:
        signature = inspect.signature(method)
        own = [one for one in signature.parameters.values() if one.kind is not one.VAR_KEYWORD]
        names = {*(one.name for one in own), *bound}
        theirs = [
            one.replace(kind=one.KEYWORD_ONLY)
            for one in inspect.signature(function).parameters.values()
            if one.name not in names and one.kind is not one.VAR_KEYWORD
        ]
        method.__signature__ = signature.replace(  # type: ignore[attr-defined]
            parameters=[*own, *theirs]
        )
        method.__doc__ = explained(method.__doc__, getattr(function, "_options", []))
        return method

    return decorate


def explained(text: str | None, options: list[str]) -> str | None:
    """The documentation of a function with what its options do, before its section on results if any."""
    entries = [TEXTS[name] for name in options if name in TEXTS]
    if text is None or not entries:
        return text
    before, returns, after = inspect.cleandoc(text).partition(RETURNS)
    end = f"\n{returns}{after}" if returns else ""
    gap = "" if before.endswith("\n") else "\n"
    return f"{before}{gap}{OTHERS}{chr(10).join(entries)}{end}"


def count(n: Any) -> int:
    """A number of vertices as a number: 10000 for "10k"."""
    text = count_word(n)
    if not re.fullmatch(r"[0-9]+", text):
        digits, unit = text[:-1], {"k": 1000, "m": 1_000_000}.get(text[-1:].lower(), 0)
        if not unit or not re.fullmatch(r"[0-9]+(\.[0-9]+)?", digits):
            raise InputError(f"`n` is {n!r}; give a whole number such as 5000, '10k' or '1.5M'")
        text = str(round(float(digits) * unit))
    return int(text)


def label_names(keep: Any) -> bool | list[str]:
    """What `keep_labels` says: none, all labels, or those of these arrays."""
    if keep is None or isinstance(keep, (bool, np.bool_)):
        return bool(keep)
    if isinstance(keep, str):
        return [keep]
    if isinstance(keep, (list, tuple, set, frozenset)) and all(isinstance(name, str) for name in keep):
        return list(keep)
    text = "give True, or the name of an array of the faces, or several"
    raise InputError(f"`keep_labels` is {short(keep)}; {text}")


def expanded(options: Mapping[str, Any]) -> Iterator[tuple[str, Any]]:
    """The options with those in `research` beside the others.

    Raises `InputError` for others in `research`.
    """
    for name, value in options.items():
        if name != "research":
            yield name, value
            continue
        if value is None:
            continue
        if not isinstance(value, Mapping):
            raise InputError(f"`research` is {short(value)}; give a dict such as {{'preset': 'rtf'}}")
        for inner in value:
            if inner not in RESEARCH:
                raise InputError(f"`research` has {inner!r}; its keys are {', '.join(RESEARCH)}")
        yield from value.items()


def with_research(options: Mapping[str, Any]) -> dict[str, Any]:
    """Options of a list or a command line, where settings for research are beside the others."""
    research = {name: value for name, value in options.items() if name in RESEARCH}
    others = {name: value for name, value in options.items() if name not in RESEARCH}
    return {**others, "research": research} if research else others


def check_needs(options: Mapping[str, Any]) -> None:
    """Raises `InputError` for an option that needs another one, or a file, that there is not."""
    if options.get("smooth_labels") is not None and options.get("keep_labels") in (None, False):
        raise InputError("`smooth_labels` needs `keep_labels`; add it, or remove `smooth_labels`")
    for name in ("features", "fixed_points"):
        path = options.get(name)
        if isinstance(path, (str, os.PathLike)) and not os.path.exists(path):
            text = "there is no such file; check the name and the folder"
            raise InputError(f"`{name}` is {os.fspath(path)!r}: {text}")


def words(n: Any, options: dict[str, Any]) -> list[str]:
    """The command line for a number of vertices and options, whose names have been checked.

    Raises `InputError` for a value of the wrong type; ranges are the command line's business.
    """
    found = [] if n is None else [f"--vertices={count_word(n)}"]
    known = flags()
    check_needs(options)
    for name, value in expanded(options):
        if name == "keep_labels":
            value = bool(label_names(value))
        if value is None and known[name]:
            continue
        theirs = next((theirs for theirs, ours in RENAMED.items() if ours == name), name)
        flag = f"--{theirs.replace('_', '-')}"
        if known[name]:
            several = name in REPEATED and isinstance(value, (list, tuple))
            found += [f"{flag}={word(name, one)}" for one in (value if several else [value])]
        elif isinstance(value, (bool, np.bool_)):
            is_given = not value if name in NEGATED else value
            found += [f"--{NEGATED.get(name, name).replace('_', '-')}"] if is_given else []
        else:
            raise InputError(f"`{name}` is {value!r}; use True or False")
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


def take_fixed_points(options: dict[str, Any]) -> NDArray[np.float64] | None:
    """The points (K, 3) that become vertices, if `fixed_points` is an array; takes it out."""
    value: Any = options.get("fixed_points")
    if is_word(value):
        return None
    del options["fixed_points"]
    points = real_numbers(value, "fixed_points", (None, 3))
    return points if len(points) else None


def take_kept(options: dict[str, Any], vertices: int, faces: NDArray[np.uint32]) -> NDArray[np.uint32] | None:
    """The faces that `keep` or `only` keeps if it is an array; takes it out.

    True and False for each face, or for each vertex, of which all of a face count; or indices of faces.
    """
    for name in ("keep", "only"):
        value: Any = options.get(name)
        if is_word(value):
            continue
        array = as_array(value, name)
        if array.dtype.kind in "US":
            continue
        if array.dtype.kind == "b" and array.shape == (len(faces),):
            selected: NDArray[np.bool_] = array
        elif array.dtype.kind == "b" and array.shape == (vertices,):
            selected = np.all(array[faces], axis=1)
        elif array.dtype.kind in "iu" and array.ndim == 1:
            selected = np.zeros(len(faces), bool)
            if array.size and not (0 <= array.min() and array.max() < len(faces)):
                raise InputError(f"`{name}` names a face that there is not; use 0 to {len(faces) - 1}")
            selected[array] = True
        else:
            raise InputError(f"`{name}` is {short(value)}; give booleans for faces or vertices, or indices")
        del options[name]
        if any(options.get(other) is not None for other in ("keep", "only")):
            raise InputError("`keep` and `only` contradict each other; remove one of them")
        return np.flatnonzero(selected if name == "keep" else ~selected).astype(np.uint32)
    return None


def take_features(options: dict[str, Any], vertices: Vertices) -> NDArray[np.float64] | None:
    """The ends (L, 2, 3) of the edges to keep, if `features` is an array of indices; takes it out."""
    value: Any = options.get("features")
    if is_word(value):
        return None
    del options["features"]
    if as_array(value, "features").size == 0:
        return None
    return np.ascontiguousarray(vertices[indices(value, "features", 2, len(vertices))])
