"""Exceptions and warnings, in the words of Python."""

from __future__ import annotations

import re


class Error(Exception):
    """What all exceptions of this package are."""


class InputError(Error, ValueError):
    """An argument, option or mesh that cannot be used; the message names it and says what to do."""


class DeviceError(Error, RuntimeError):
    """There is no usable Vulkan device, or it failed; the message says what to install or to change."""


class OutOfMemoryError(DeviceError, MemoryError):
    """The device or the host has too little memory for a mesh of this size."""


class OutputError(Error, OSError):
    """A file that cannot be written."""


class Cancelled(Error):
    """A run that its progress callback has stopped."""


class MeshWarning(UserWarning):
    """Something is wrong with a result, though there is one; or a file does not hold all of a mesh."""


KINDS: dict[str, type[Error]] = {
    "usage": InputError,
    "input": InputError,
    "output": OutputError,
    "device": DeviceError,
    "memory": OutOfMemoryError,
    "cancelled": Cancelled,
    "internal": Error,
}

# What the library or the command line says, and what a caller from Python has for it.
PHRASES = [
    ("`shortage` add-vertices", "`vertices_at_least`"),
    ("accept it with `shortage` best-effort", "leave out `strict`"),
    ("`memory_bytes`", "`device_memory`"),
    (
        "make a mesh of the points with `cloud::surface`",
        "read its points with `points=True` and call rtfmesh.reconstruct",
    ),
    ("make a mesh of the volume with `volume::iso_surface`", "call rtfmesh.contour with its values"),
    ("or declare the input format", "or name the format with `format`"),
    ("use a file whose triangles or vertices have one, such as PLY", "add one to the mesh's attributes"),
    ("; values on a grid can be read as a volume", "; rtfmesh.contour takes values on a grid"),
    ("read the file without materials", "leave out `materials`"),
    ("or use --preset default", "or leave out `research`"),
    (
        "start processes without a fork (spawn), or fork before the first use",
        'start processes with multiprocessing.get_context("spawn")',
    ),
    ("see `rtfmesh devices`", "see rtfmesh.devices()"),
    ("the output of `rtfmesh bug-report`", "the output of python -m rtfmesh bug-report"),
]
# The same of single errors, as patterns, with what names the argument.
PATTERNS = [
    (r"invalid value '(.*)' for (`\w+`): invalid float literal", r"\2 is '\1'; give a number"),
    (
        r"invalid value '(.*)' for (`\w+`): invalid digit found in string",
        r"\2 is '\1'; give a whole number, 0 or above",
    ),
    (
        r"invalid value '(.*)' for (`\w+`): -\d+ is not in 0\.\.=\d+",
        r"\2 is \1; give a whole number, 0 or above",
    ),
    (
        r"invalid value '(.*)' for (`\w+`): (number too large to fit in target type|\d+ is not in 0\.\.=\d+)",
        r"\2 is \1; give a smaller number",
    ),
    (r"^the argument (`\w+`) cannot be used with (`\w+`)", r"\1 and \2 do not go together; leave one out"),
    (r"; see the documentation of the option$", ""),
    (r"^the edge length (\S+) is out of range", r"`edge_length` \1 is out of range"),
    (r"^the ratio (\S+) is out of range", r"`ratio` \1 is out of range"),
    (r"^the maximum deviation (\S+) is out of range", r"`max_deviation` \1 is out of range"),
    (r"^so small a deviation needs", r"`max_deviation`: \g<0>"),
    (r"^vertex (\d+) has edge length (\S+); give lengths", r"`sizing` is \2 for vertex \1; give numbers"),
    (
        r"^the volume has no surface at .*: no value is finite;.*",
        "`values`: no value is finite; give numbers",
    ),
    (r"^the volume has no surface at", "`iso`: the volume has no surface at"),
    (
        r"^(\S+) is not a valid label; (.*), or make an isosurface$",
        r"`values` has \1, which is not a label; \2, or give `iso` for a surface at a value",
    ),
    (
        r"^all values of the volume are (\S+) (but for .*);.*",
        r"`values` are all \1 \2; use `keep_specks`",
    ),
    (
        r"^all values of the volume are (\S+);.*",
        r"`values` are all \1; give another label, or use `closed`",
    ),
    (
        r"^there are no faces, and (\d+) different points are too few for a surface",
        r"`points` has \1 different points, too few for a surface",
    ),
    (r"^the points (lie|fill|show)", r"`points` \1"),
    (r"^could not build a surface through the points", "`points`: could not build a surface through them"),
    (
        r"^no device matches ('.*'); there are: (.*)",
        r"`device` is \1, which matches no device; use one of these: \2",
    ),
    (
        r"^the result is up to (\S+) away from the input, (\S+) may be;.*",
        r"`result` is up to \1 away from `mesh`, more than \2; give the mesh that it was made from",
    ),
    (r"^the pose (has coordinates .*);.*", r"`poses` \1; repair or remove this pose"),
    (r"^a picture of \d+ x \d+ pixels", r"`size`: \g<0>"),
    (r"^unknown format ('.*?');", r"`format` \1 is unknown;"),
    (r"^(no triangle has the label .*);.*", r"\1; use a label that `attributes.face` has"),
    (
        r"^(the vertices have no numeric attribute .*);.*",
        r"`sizing`: \1; use one that `attributes.vertex` has",
    ),
    (r"^cancelled; nothing was written$", "cancelled by `progress`; there is no result"),
]
# Options and fields that have another name in Python.
ARGUMENTS = {
    "vertices": "n",
    "faces": "n_faces",
    "points": "fixed_points",
    "no-fit": "fit=False",
    "no_fit": "fit",
}
# A flag, as in `--min-edge`, "'--weld <FRACTION>'" or "--device-memory <MIB>".
FLAG = re.compile(r"'?--([a-z][a-z-]*)(?: <[^>]*>)?'?")
# The short flag of the number of vertices.
COUNT = re.compile(r"(?<![\w-])-n\b")


def in_python(text: str) -> str:
    """The text with arguments in place of flags: `min_edge` for --min-edge."""
    for theirs, ours in PHRASES:
        text = text.replace(theirs, ours)
    text = COUNT.sub("`n`", text)
    return FLAG.sub(lambda flag: f"`{ARGUMENTS.get(flag[1], flag[1].replace('-', '_'))}`", text)


def exception(kind: str, field: str | None, text: str) -> Error:
    """The exception for an error of the library; `field` is the option that is wrong, if it is one."""
    text = in_python(text)
    for theirs, ours in PATTERNS:
        text = re.sub(theirs, ours, text)
    # The name of the file is to blame, and not the disk.
    if kind == "output" and "; name the result " in text:
        kind, text = "usage", f"`path` {text}"
    argument = ARGUMENTS.get(field, field) if field else None
    if field in ("faces", "points"):
        text = text.replace(f"`{field}`", f"`{argument}`")
    # Where several arguments make up an option, the text begins with the one that is wrong.
    if argument and f"`{argument}`" not in text and not text.startswith("`"):
        text = f"`{argument}`: {text}"
    return KINDS[kind](text)
