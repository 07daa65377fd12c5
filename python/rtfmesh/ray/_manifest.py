"""The list of meshes: a CSV or Parquet file with a row for each."""

from __future__ import annotations

import difflib
import math
import os
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
from numpy.typing import NDArray
from pandas.util import hash_array
from pyarrow import csv, parquet

from .._errors import InputError
from .._words import flags, with_research

TRUE, FALSE = ("true", "yes", "1"), ("false", "no", "0")
# Rows that are in memory at a time.
ROWS = 4096


@dataclass(frozen=True)
class Manifest:
    """A list of meshes in the columns `id`, `path`, and any of `n` and the options of `remesh`."""

    path: Path

    @classmethod
    def open(cls, path: str | os.PathLike[str]) -> Manifest:
        """Raises `InputError` for a file that is none, or has other columns."""
        manifest = cls(Path(path).absolute())
        columns = manifest._columns()
        known = ["id", "path", "n", *flags()]
        for name in ("id", "path"):
            if name not in columns:
                raise InputError(f"{path}: the column '{name}' is missing; there are {', '.join(columns)}")
        for name in columns:
            if name not in known:
                close = difflib.get_close_matches(name, known, 1)
                hint = f"did you mean '{close[0]}'?" if close else "remove it"
                raise InputError(f"{path}: the column '{name}' is not an option of remesh; {hint}")
        return manifest

    def _columns(self) -> list[str]:
        try:
            with self._reader() as reader:
                names: list[str] = (reader.schema_arrow if self._is_parquet() else reader.schema).names
                return names
        except FileNotFoundError:
            raise InputError(f"{self.path}: there is no such file; check the name and the folder") from None
        except (OSError, pa.ArrowException) as error:
            raise InputError(f"{self.path}: this is not a CSV or Parquet file ({error})") from error

    def _is_parquet(self) -> bool:
        return self.path.suffix in (".parquet", ".pq")

    def _reader(self, columns: list[str] | None = None) -> Any:
        if self._is_parquet():
            return parquet.ParquetFile(self.path)
        # All as text, or a column would change its type with its values; `cells` reads them.
        types = {name: pa.string() for name in ["id", "path", "n", *flags()]}
        convert = csv.ConvertOptions(column_types=types, include_columns=columns)
        return csv.open_csv(self.path, convert_options=convert)

    def batches(self, columns: list[str] | None = None) -> Iterator[pa.RecordBatch]:
        """The rows in their order, some thousands at a time."""
        try:
            with self._reader(columns) as reader:
                yield from reader.iter_batches(ROWS, columns=columns) if self._is_parquet() else reader
        except pa.ArrowException as error:
            raise InputError(f"{self.path}: {error}") from error

    def rows(self) -> Iterator[dict[str, Any]]:
        """The rows in their order."""
        for batch in self.batches():
            yield from batch.to_pylist()

    def count(self) -> int:
        """The number of rows, after a look for ids that are there twice; it takes 8 bytes for each.

        Raises `InputError` for such an id: its outputs would replace each other.
        """
        hashes = [hashed(batch) for batch in self.batches(["id"])]
        values, times = np.unique(np.concatenate(hashes or [np.empty(0, np.uint64)]), return_counts=True)
        suspects = values[times > 1]
        seen = set()
        if len(suspects):
            for batch in self.batches(["id"]):
                for name in batch.filter(pa.array(np.isin(hashed(batch), suspects))).to_pylist():
                    key = cell_text(name["id"])
                    if key and key in seen:
                        raise InputError(f"{self.path}: the id '{key}' occurs twice; make it unique")
                    seen.add(key)
        return int(times.sum())


def hashed(batch: pa.RecordBatch) -> NDArray[np.uint64]:
    """A number for each id, the same for the same text."""
    texts = np.array([cell_text(value) for value in batch.column("id").to_pylist()], dtype=object)
    numbers: NDArray[np.uint64] = hash_array(texts, categorize=False)
    return numbers


def cell_text(value: Any) -> str:
    """A cell as text; nothing for an empty one."""
    return "" if value is None else str(value)


def cells(row: dict[str, Any]) -> dict[str, Any]:
    """The options in a row, without empty cells.

    Raises `InputError` for a word that is neither true nor false in an option that is one of both.
    """
    options: dict[str, Any] = {}
    known = flags()
    for name, value in row.items():
        empty = value is None or value == "" or (isinstance(value, float) and math.isnan(value))
        if empty or name in ("id", "path"):
            continue
        if name != "n" and not known[name] and not isinstance(value, bool):
            word = str(value).lower()
            if word not in TRUE + FALSE and name == "keep_labels":
                options[name] = value
                continue
            if word not in TRUE + FALSE:
                raise InputError(f"`{name}` is {value!r}; use true or false")
            value = word in TRUE
        options[name] = value
    return with_research(options)
