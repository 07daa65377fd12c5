"""The argument that names triangles, in errors that say only which triangles there are not."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

from ._errors import InputError

# How messages about words such as label:NAME begin, by what is in front of the colon.
REFUSALS = {
    "label": ("no triangle has the label '{}'",),
    "selection": (
        "no numeric attribute of triangles or vertices is named '{}'",
        "the attribute '{}' is 0 on all triangles",
    ),
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


def with_argument(error: InputError, options: Mapping[str, Any]) -> InputError:
    """An error of a run, with the one of these options that names the triangles in question."""
    text = str(error)
    for argument, kind, name in selections(options):
        if text.startswith(tuple(refusal.format(name) for refusal in REFUSALS.get(kind, ()))):
            return InputError(f"`{argument}`: {text}")
    if options.get("only") is not None and options.get("keep") is None:
        for theirs, ours in OF_ONLY:
            text = text.replace(theirs, ours)
    return error if text == str(error) else InputError(text)
