"""What is wrong for all meshes of a list, which is found before Ray starts."""

from __future__ import annotations

import os
import uuid
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import ray

from .. import _native
from .._arrays import real_number, short
from .._errors import InputError, OutputError
from .._files import read, write
from .._remesher import Remesher, wanted_device
from .._words import is_word, word, words

# Options that say what of the input itself stays, and which a surface around it cannot keep.
OF_INPUT = ("keep_boundary", "keep", "only", "features", "symmetric", "ratio")
# Input edges by which borders of labels may move.
MAX_SMOOTH_LABELS = 10


def check_options(n: Any, options: Mapping[str, Any]) -> None:
    """Raises `InputError` for options that no mesh could be remeshed with.

    The native module checks most of them without a mesh. It would refuse the others for each mesh, in the
    same words.
    """
    _native.check(words(n, dict(options)))
    # None and False are as if the option were not given.
    given = {name: value for name, value in options.items() if value is not None and value is not False}
    for name in ("features", "fixed_points"):
        if not is_word(given.get(name)):
            raise InputError(f"`{name}` is {short(given[name])}; give the name of a file")
    if "fixed_points" in given:
        check_points(given["fixed_points"])
    if "fixed_points" in given and "max_deviation" in given:
        text = "`fixed_points` does not go together with `max_deviation`"
        raise InputError(f"{text}; remove one of them")
    if "smooth_labels" in given:
        edges = word("smooth_labels", given["smooth_labels"])
        if not 0 <= float(edges) <= MAX_SMOOTH_LABELS:
            text = f"use 0 to {MAX_SMOOTH_LABELS} input edges, such as 1"
            raise InputError(f"`smooth_labels` {edges} is out of range; {text}")
    bounds = [word(name, given[name]) for name in ("min_edge", "max_edge") if name in given]
    # Lengths in percent depend on the mesh.
    if len(bounds) == 2 and len({bound.endswith("%") for bound in bounds}) == 1:
        least, most = (float(bound.removesuffix("%")) for bound in bounds)
        if least > most:
            text = "give a smaller `min_edge` or a larger `max_edge`"
            raise InputError(f"`min_edge` {bounds[0]} is more than `max_edge` {bounds[1]}; {text}")
    if "wrap" in given:
        check_wrap(word("wrap", given["wrap"]), [name for name in OF_INPUT if given.get(name)])


def check_points(path: str | os.PathLike[str]) -> None:
    """Raises `InputError` for a file without points."""
    try:
        points = read(path, points=True).vertices
    except InputError as error:
        raise InputError(f"`fixed_points`: {error}") from None
    if len(points) == 0:
        raise InputError(f"`fixed_points`: {os.fspath(path)} has no points; give a file that has some")


def check_wrap(length: str, kept: list[str]) -> None:
    """Raises `InputError` for a length that is none, and for options of the input that are given with it."""
    if not 0 < float(length.removesuffix("%")) < float("inf"):
        raise InputError(f"`wrap` {length} is out of range; give a length above 0, such as 1%")
    if kept:
        raise InputError(f"`{kept[0]}` does not work with wrapped surfaces; remove it")


def check_numbers(workers: int | None, gpus: float | None, cpus: float, batch_size: int | None) -> None:
    """Raises `InputError` for what is no number, or out of its range."""
    for name, count in (("workers", workers), ("batch_size", batch_size)):
        if count is not None and (isinstance(count, bool) or not isinstance(count, (int, np.integer))):
            raise InputError(f"`{name}` is {short(count)}; give a whole number")
    for name, share in (("gpus_per_worker", gpus), ("cpus_per_worker", cpus)):
        if share is not None or name == "cpus_per_worker":
            real_number(share, name)
    ranges = [
        ("workers", workers is None or workers >= 1, "1 or more"),
        ("gpus_per_worker", gpus is None or 0 <= gpus <= 1, "0 to 1: a worker uses one device"),
        ("cpus_per_worker", cpus > 0, "more than 0"),
        ("batch_size", batch_size is None or batch_size >= 1, "1 or more"),
    ]
    for name, fits, allowed in ranges:
        if not fits:
            raise InputError(f"`{name}` is out of range; use {allowed}")


def check_output(folder: Path, suffix: str) -> None:
    """Makes the folder, and writes a mesh to it and removes it, so that no run begins in vain."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise OutputError(f"{folder}: {error.strerror}; choose another folder") from error
    trial = folder / f".rtfmesh-{uuid.uuid4().hex}{suffix}"
    try:
        write(trial, [[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]])
    except (InputError, OutputError) as error:
        # Nobody knows the file of the trial.
        text = str(error).removeprefix("`path` ").removeprefix(f"{trial}: ")
        place = f"`suffix` is {suffix!r}" if isinstance(error, InputError) else folder
        raise type(error)(f"{place}: {text}") from None
    trial.unlink()


def check_device(device: str | int | None) -> None:
    """Raises an error for a device that there cannot be; opens it if workers will be on this machine."""
    wanted_device(device, None)
    if device is None or ray.is_initialized() or os.environ.get("RAY_ADDRESS"):
        return
    Remesher(device)
