"""The list of meshes as a dataset of Ray's."""

from __future__ import annotations

import json
from collections.abc import Iterator
from itertools import islice
from typing import Any

import pyarrow as pa
from ray.data import Datasource, ReadTask
from ray.data.block import BlockMetadata

from ._manifest import Manifest


class Batches(Datasource):
    """The rows of a list, `size` at a time.

    Each batch is one row of the dataset, as JSON. Ray cuts and joins blocks of rows by their bytes, but hands
    out whole rows, so that workers get batches of exactly this size.
    """

    def __init__(self, manifest: Manifest, size: int) -> None:
        super().__init__()
        self.manifest = manifest
        self.size = size

    def get_name(self) -> str:
        """What Ray's messages call it."""
        return "Manifest"

    def estimate_inmemory_data_size(self) -> int | None:
        """Unknown, and of no use."""
        return None

    def get_read_tasks(self, *_: Any, **__: Any) -> list[ReadTask]:
        """One, which reads on as workers are done with what it has read."""
        manifest, size = self.manifest, self.size

        def read() -> Iterator[pa.Table]:
            rows = manifest.rows()
            while batch := list(islice(rows, size)):
                yield pa.table({"rows": [json.dumps(batch, default=str)]})

        unknown = BlockMetadata(num_rows=None, size_bytes=None, input_files=None, exec_stats=None)
        return [ReadTask(read, unknown)]
