"""The list of meshes through Ray Data, in small batches."""

from __future__ import annotations

import csv
import json
import os
import time
import uuid
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import ray
from ray.data import ActorPoolStrategy, DataContext
from ray.exceptions import ActorDiedError

from .._arrays import short, truth
from .._errors import DeviceError, InputError
from .._words import keywords
from ._batches import Batches
from ._checks import check_device, check_numbers, check_options, check_output
from ._manifest import Manifest
from ._meshes import Job
from ._worker import Worker

if TYPE_CHECKING:
    from typing_extensions import Unpack

    from .._options import Options

# The columns of status.csv.
COLUMNS = (
    "id output state vertices faces mean_quality least_quality least_angle seconds device worker warnings "
    "error"
).split()
# The usual number of meshes in a batch, and the largest number of batches: Ray keeps some kilobytes in the
# calling process for each, to the end.
BATCH, BATCHES = 16, 50_000
# What batches that wait may take of the object store, and the more for each mesh that workers have at a time.
# Ray reads on in the list when there are fewer.
WAITING, OF_MESH = 4 << 20, 1 << 10


@dataclass
class Summary:
    """What became of the meshes of a list."""

    meshes: int
    """Rows of the list."""
    done: int = 0
    """Meshes remeshed by this call."""
    kept: int = 0
    """Meshes that were done before, with the same input and options."""
    failed: int = 0
    """Meshes without a result; status.csv says why."""
    seconds: float = 0.0
    """Time that this call took."""
    status: Path = Path()
    """The CSV file with a row for each mesh."""

    def follow(self, results: Iterable[list[dict[str, Any]]], tell: Callable[[int], object]) -> None:
        """Writes status rows as they come, and counts them."""
        started = time.perf_counter()
        with open(self.status, "w", encoding="utf-8", newline="") as file:
            table = csv.DictWriter(file, COLUMNS)
            table.writeheader()
            for rows in results:
                table.writerows(rows)
                file.flush()
                states = [row["state"] for row in rows]
                self.done += states.count("done")
                self.kept += states.count("kept")
                self.failed += states.count("failed")
                tell(len(rows))
        self.seconds = time.perf_counter() - started

    def __str__(self) -> str:
        counts = f"{self.meshes} meshes: {self.done} done, {self.kept} kept, {self.failed} failed"
        return f"{counts}, in {self.seconds:.1f} s; {self.status} has a row for each"


@dataclass(frozen=True)
class Pool:
    """The workers that there are to be."""

    workers: int
    gpus: float
    cpus: float
    device: str | int | None

    def status(self, job: Job, batches: Batches) -> Iterator[list[dict[str, Any]]]:
        """Remeshes; the status rows of batches as these end, in any order."""
        context = DataContext.get_current().copy()
        # A row is a block; see `Batches`.
        context.target_max_block_size = 1
        limits = context.execution_options.resource_limits
        context.execution_options.resource_limits = limits.copy(
            object_store_memory=WAITING + self.workers * batches.size * OF_MESH
        )
        # They would count batches.
        context.enable_progress_bars = False
        with DataContext.current(context):
            # Reading needs no core of its own, or it would wait for one that workers never give back.
            rows = ray.data.read_datasource(batches, num_cpus=0, override_num_blocks=1)
            dataset = rows.map_batches(
                Worker,
                fn_constructor_args=(job, self.cpus, self.device),
                batch_size=1,
                compute=ActorPoolStrategy(size=self.workers),
                num_cpus=self.cpus,
                num_gpus=self.gpus,
            )
        try:
            for block in dataset.iter_batches(batch_size=None, prefetch_batches=0):
                for text in block["rows"]:
                    yield json.loads(text)
        except ActorDiedError as error:
            # The last line of a traceback, which is all that Ray hands on of a worker that cannot start.
            _, failed, why = str(error).strip().splitlines()[-1].partition("DeviceError: ")
            if failed:
                raise DeviceError(f"a worker cannot start: {why}") from error
            raise


def usual_batch(meshes: int) -> int:
    """How many meshes a batch has in a list of this many."""
    return max(BATCH, -(-meshes // BATCHES))


def room(gpus: float, cpus: float) -> int:
    """How many workers the cluster has room for.

    Raises `InputError` if there is none.
    """
    there = ray.cluster_resources()
    count = int(there.get("CPU", 0) / cpus)
    if gpus:
        count = min(count, int(there.get("GPU", 0) / gpus))
    if count < 1:
        has = f"{there.get('CPU', 0):g} cores and {there.get('GPU', 0):g} GPUs"
        text = f"the cluster has {has}; lower `cpus_per_worker` or `gpus_per_worker`, or give `workers`"
        raise InputError(text)
    return count


@contextmanager
def shown(progress: bool, summary: Summary) -> Iterator[Callable[[int], object]]:
    """What to call with numbers of meshes that are done: with `progress` it moves a bar of tqdm's."""
    if not progress:
        yield lambda count: None
        return
    from tqdm.auto import tqdm

    with tqdm(total=summary.meshes, unit="mesh") as bar:

        def told(count: int) -> None:
            bar.set_postfix(failed=summary.failed, refresh=False)
            bar.update(count)

        yield told


@keywords
def remesh_manifest(
    manifest: str | os.PathLike[str],
    out: str | os.PathLike[str],
    *,
    n: int | str | None = None,
    suffix: str = ".ply",
    workers: int | None = None,
    gpus_per_worker: float | None = None,
    cpus_per_worker: float = 1,
    device: str | int | None = None,
    batch_size: int | None = None,
    progress: bool = False,
    **options: Unpack[Options],
) -> Summary:
    """Remeshes all meshes of a list with Ray Data, and goes on where an earlier call was stopped.

    Parameters
    ----------
    manifest
        A CSV or Parquet file with a row for each mesh. Its columns are `id`, unique, which may have folders
        as in "chairs/17"; `path`, from the list's own folder if it is relative; and any of `n` and the
        options of `rtfmesh.remesh`, which count more than those of the call unless the cell is empty.
    out
        The folder for `ID.ply`, for `ID.ply.json` with its record, and for `status.csv`, which has a row for
        each mesh. All workers must reach it, as well as list and meshes, by the same paths.
    n
        Number of vertices, also as "10k".
    suffix
        Extension, and so format, of the outputs: ".ply", ".obj", ".glb", ".ply.gz" ...
    workers
        Number of processes; by default as many as the cluster has room for at the start.
    gpus_per_worker
        Share of a GPU for each, 0 to 1; 0 stands for the CPU's device. By default 1 if the cluster has GPUs.
    cpus_per_worker
        Cores for each; it starts as many threads.
    device
        A device as in `rtfmesh.Remesher`, for all workers; by default each uses the GPU that Ray gives it.
    batch_size
        Meshes that a worker gets at a time; by default 16, or more in lists of more than 800,000, so that
        there are at most 50,000 batches.
    progress
        Whether to show a bar.
    **options
        Options of `rtfmesh.remesh`, as numbers, words, True and False.

    Returns
    -------
    A `Summary`. A mesh that fails has its error in status.csv, and does not stop the others; the next call
    tries it again. Meshes that are done are not done again unless their options or their files have changed.

    Raises
    ------
    InputError
        The list has no such columns, or an id twice, or an argument cannot be used.
    DeviceError
        A worker finds no device.
    OutputError
        Nothing can be written to `out`.
    """
    given = dict(options) if n is None else {"n": n, **options}
    # What is wrong for all meshes is said before any work.
    check_options(n, options)
    check_numbers(workers, gpus_per_worker, cpus_per_worker, batch_size)
    truth(progress, "progress")
    for name, path in (("manifest", manifest), ("out", out)):
        if not isinstance(path, (str, os.PathLike)):
            raise InputError(f"`{name}` is {short(path)}; give a path")
    if not isinstance(suffix, str) or not suffix.startswith("."):
        raise InputError(f"`suffix` is {short(suffix)}; give an extension such as '.ply'")
    check_device(device)
    folder = Path(out).absolute()
    check_output(folder, suffix)
    listing = Manifest.open(manifest)
    summary = Summary(listing.count(), status=folder / "status.csv")
    job = Job(uuid.uuid4().hex, listing.path.parent, folder, suffix, given)
    if not ray.is_initialized():
        ray.init()
    gpus = float("GPU" in ray.cluster_resources()) if gpus_per_worker is None else gpus_per_worker
    pool = Pool(workers or room(gpus, cpus_per_worker), gpus, cpus_per_worker, device)
    batches = Batches(listing, batch_size or usual_batch(summary.meshes))
    with shown(progress, summary) as tell:
        summary.follow(pool.status(job, batches), tell)
    return summary
