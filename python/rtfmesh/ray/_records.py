"""What is known of a mesh: a small file beside its output, which outlives crashes."""

from __future__ import annotations

import json
import os
import tempfile
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any


@dataclass
class Record:
    """The state of one output."""

    source: dict[str, Any]
    """What the output is made of: path, bytes and time of the input, options. Other ones make it anew."""
    run: str
    """The call of `remesh_manifest` that wrote this."""
    state: str = "started"
    """"started", "done" or "failed"."""
    starts: int = 1
    """How often this run has begun with the mesh: more than once only if a worker died over it."""
    bytes: int = 0
    """Size of the output, if it is done."""
    row: dict[str, Any] = field(default_factory=dict)
    """The status row; while it is started, the process that works on it."""

    def write(self, path: Path) -> None:
        """Replaces the file as a whole; a crash leaves the old one or the new one."""
        handle, name = tempfile.mkstemp(prefix=".rtfmesh-", suffix=".part", dir=path.parent)
        try:
            # Unlike other temporary files this one becomes an ordinary file.
            os.chmod(name, 0o644)
            with open(handle, "w", encoding="utf-8") as file:
                json.dump(asdict(self), file)
            os.replace(name, path)
        except BaseException:
            os.unlink(name)
            raise

    @classmethod
    def read(cls, path: Path) -> Record | None:
        """The record in a file; None if there is none, or none that can be used, as after a power cut."""
        try:
            return cls(**json.loads(path.read_text(encoding="utf-8")))
        except (FileNotFoundError, ValueError, TypeError):
            return None


def record_path(output: Path) -> Path:
    """Where the record of an output is."""
    return output.with_name(output.name + ".json")
