"""One mesh of the list: from file to file, with a status row at the end whatever happens."""

from __future__ import annotations

import os
import socket
import time
import warnings
from dataclasses import dataclass, field
from pathlib import Path, PurePosixPath
from typing import Any

from .._errors import DeviceError, Error, InputError, MeshWarning, OutOfMemoryError
from .._files import read, write
from .._remesher import Remesher
from .._words import label_names, words
from ._manifest import cell_text, cells
from ._records import Record, record_path

# How often a run begins with a mesh over which its worker died, before it gives it up.
STARTS = 3
# Options that say how many vertices a result has, each in its own way.
SIZES = frozenset({"n", "edge_length", "ratio"})


@dataclass(frozen=True)
class Job:
    """What all meshes of a run have in common."""

    run: str
    root: Path
    """What relative paths of inputs start from."""
    out: Path
    suffix: str
    """The extension of the outputs, with its dot."""
    options: dict[str, Any] = field(default_factory=dict)
    """`n` and options for rows that do not have their own."""


@dataclass(frozen=True)
class Task:
    """A row of the list, checked."""

    input: Path
    output: Path
    options: dict[str, Any]

    @classmethod
    def of(cls, job: Job, row: dict[str, Any]) -> Task:
        """Raises `InputError` for a row without id or path, or with an id that is no path below `out`."""
        name, path = cell_text(row["id"]), cell_text(row["path"])
        plain = PurePosixPath(name)
        if not name or plain.is_absolute() or ".." in plain.parts or str(plain) != name or name == ".":
            raise InputError(
                f"the id '{name}' is not a valid output name; use letters, digits, '/' for folders"
            )
        if not path:
            raise InputError(f"the mesh '{name}' has no path")
        own = cells(row)
        # A row that says how large its result is to be does so alone.
        left_out = SIZES if own.keys() & SIZES else frozenset[str]()
        common = {option: value for option, value in job.options.items() if option not in left_out}
        both = {**common, **own}
        if "research" in common and "research" in own:
            both["research"] = {**common["research"], **own["research"]}
        return cls(job.root / path, job.out / f"{name}{job.suffix}", both)

    def source(self) -> dict[str, Any]:
        """What the output depends on, as a record has it.

        Raises `InputError` for an input that there is not, or options of the wrong type.
        """
        try:
            known = self.input.stat()
        except OSError as error:
            raise InputError(f"{self.input}: {error.strerror}; check the path") from error
        options = dict(self.options)
        labels = label_names(options.get("keep_labels"))
        line = sorted(words(options.pop("n", None), options))
        # Which ones are no word of the command line.
        line += [] if isinstance(labels, bool) else [f"keep_labels={name}" for name in labels]
        # Not in nanoseconds, which not all file systems keep.
        return {
            "path": str(self.input),
            "bytes": known.st_size,
            "time": int(known.st_mtime),
            "options": line,
        }


def worker_name() -> str:
    """The machine and process that this is."""
    return f"{socket.gethostname()}:{os.getpid()}"


def why(error: BaseException) -> str:
    """An exception as a row has it."""
    return str(error) if isinstance(error, Error) else f"{type(error).__name__}: {error}"


def do_row(remesher: Remesher, job: Job, row: dict[str, Any]) -> dict[str, Any]:
    """Remeshes the mesh of a row unless that is done already; returns its status row.

    Raises `DeviceError` if the device fails, which then fails for all other meshes, too.
    """
    status = {"id": cell_text(row.get("id")), "state": "failed", "worker": worker_name()}
    try:
        task = Task.of(job, row)
        status["output"] = str(task.output)
        source = task.source()
        task.output.parent.mkdir(parents=True, exist_ok=True)
        place = record_path(task.output)
        record, known = Record(source, job.run, row=status), Record.read(place)
        if known is not None and known.source == source:
            if known.run == job.run:
                if known.state == "failed":
                    return known.row
                record.starts += known.starts
            if is_whole(task.output, known):
                return known.row if known.run == job.run else {**known.row, "state": "kept"}
            if record.starts > STARTS:
                last = known.row.get("error", "perhaps for lack of memory")
                raise InputError(f"{STARTS} workers ended without a result of this mesh: {last}")
        return begun(remesher, task, record, place)
    except DeviceError as error:
        if isinstance(error, OutOfMemoryError):
            return {**status, "error": why(error)}
        raise
    except Exception as error:
        # Of whatever kind: one mesh must not take the others of its batch with it.
        return {**status, "error": why(error)}


def is_whole(output: Path, record: Record) -> bool:
    """Whether the output is there as the record says."""
    try:
        return record.state == "done" and output.stat().st_size == record.bytes
    except FileNotFoundError:
        return False


def begun(remesher: Remesher, task: Task, record: Record, place: Path) -> dict[str, Any]:
    """Remeshes, with a record from the start, so that a mesh over which workers die is found out."""
    record.write(place)
    started = time.perf_counter()
    try:
        figures = from_file_to_file(remesher, task)
        record.state = "done"
        record.bytes = task.output.stat().st_size
    except Exception as error:
        figures = {"error": why(error)}
        if isinstance(error, DeviceError) and not isinstance(error, OutOfMemoryError):
            record.row = {**record.row, **figures}
            record.write(place)
            raise
        record.state = "failed"
    seconds = round(time.perf_counter() - started, 4)
    device = remesher.device["name"]
    record.row = {**record.row, "state": record.state, "seconds": seconds, "device": device, **figures}
    # After the output: without the record it is made again, and is the same then.
    record.write(place)
    return record.row


def from_file_to_file(remesher: Remesher, task: Task) -> dict[str, Any]:
    """Reads, remeshes and writes; returns the figures of the status row."""
    options = dict(task.options)
    n = options.pop("n", None)
    with warnings.catch_warnings(record=True) as told:
        warnings.simplefilter("always", MeshWarning)
        # Only glTF's binary files can hold materials.
        mesh = read(task.input, materials=task.output.name.endswith(".glb"))
        result = remesher.remesh(
            mesh.vertices, mesh.faces, n, attributes=mesh.attributes, correspondence=False, **options
        )
        # Under a temporary name that is then renamed.
        write(task.output, result.vertices, result.faces, attributes=result.attributes)
    quality = result.report["output"]["quality"]
    return {
        "vertices": len(result.vertices),
        "faces": len(result.faces),
        "mean_quality": round(quality["mean_quality"], 4),
        "least_quality": round(quality["min_quality"], 4),
        "least_angle": round(quality["min_angle"], 2),
        "warnings": "; ".join(str(w.message) for w in told if issubclass(w.category, MeshWarning)),
    }
