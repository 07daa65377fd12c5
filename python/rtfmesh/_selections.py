"""The argument that names triangles or edges, in errors that say only which ones do not exist."""

from __future__ import annotations

import os
import re
from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np

from ._errors import InputError

# How messages about words such as label:NAME begin, by what is in front of the colon.
REFUSALS = {
    "label": ("no triangle has the label '{}'",),
    "selection": (
        "no numeric attribute of triangles or vertices is named '{}'",
        "the attribute '{}' is 0 on all triangles",
    ),
}
# How messages about a mesh that is no surface begin, and what is said by the argument that it is made of.
NO_SURFACE = ("the mesh has no faces with an area", "all vertices are at one point")
NOTHING = {
    "faces": "no face has an area; give a surface",
    "points": "all are at one place; give points of a surface",
    "values": "the surface has no area; give larger objects, or a finer grid",
}
# What is said of `keep`, where `only` names all other triangles.
OF_ONLY = [
    ("the triangles of `keep`", "the triangles outside of `only`"),
    ("`keep`", "`only`"),
    ("keep fewer triangles", "give `only` more triangles"),
]


def selections(options: Mapping[str, Any]) -> Iterator[tuple[str, str, str]]:
    """The arguments with words such as label:NAME, and both sides of the colon, in the order of their use."""
    for argument in ("refine", "keep", "only"):
        value = options.get(argument)
        words = [value] if isinstance(value, str) else value if isinstance(value, (list, tuple)) else []
        for word in words:
            if isinstance(word, str):
                kind, _, name = word.partition(":")
                # Lengths follow.
                yield argument, kind, name.rpartition("=")[0] if argument == "refine" else name


def of_file(text: str, options: Mapping[str, Any]) -> str:
    """What is said of a file, with the argument that names it."""
    for name in ("features", "fixed_points"):
        path = options.get(name)
        if isinstance(path, (str, os.PathLike)) and text.startswith(f"{os.fspath(path)}: "):
            return f"`{name}`: {text}"
    return text


def of_features(text: str, features: Any) -> str:
    """What is said of a line of `features`: of a file's, or of the row of an array."""
    line = re.match(r"line (\d+): no (?:edge|vertex) of the mesh ", text)
    if line is None:
        return text
    if isinstance(features, (str, os.PathLike)):
        return f"`features`: {os.fspath(features)}, {text}"
    row = int(line[1]) - 1
    remedy = "give both ends of an edge in each row"
    return f"`features` has {np.asarray(features)[row].tolist()} in row {row}, which is no edge; {remedy}"


def with_argument(error: InputError, options: Mapping[str, Any], source: str = "faces") -> InputError:
    """An error of a run, with the one of these options that names the triangles or edges in question.

    `source` is the argument that the surface is made of.
    """
    text = of_file(str(error), options)
    if text.startswith(NO_SURFACE):
        text = f"`{source}`: {NOTHING[source]}"
    if options.get("features") is not None:
        text = of_features(text, options["features"])
    for argument, kind, name in selections(options):
        if text.startswith(tuple(refusal.format(name) for refusal in REFUSALS.get(kind, ()))):
            return InputError(f"`{argument}`: {text}")
    if options.get("only") is not None and options.get("keep") is None:
        for theirs, ours in OF_ONLY:
            text = text.replace(theirs, ours)
    return error if text == str(error) else InputError(text)
