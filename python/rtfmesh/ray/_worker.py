"""The processes that remesh."""

from __future__ import annotations

import json
import os
from typing import Any

import numpy as np
import ray

from .._errors import DeviceError
from .._figures import untested_devices
from .._remesher import Remesher
from ._devices import limit_threads, nvidia_smi, vulkan_device
from ._meshes import Job, do_row, why


class Worker:
    """An actor with a device of its own, which reads and writes meshes itself."""

    def __init__(self, job: Job, cpus: float, device: str | int | None) -> None:
        limit_threads(cpus)
        if device is None:
            assigned = ray.get_runtime_context().get_accelerator_ids()["GPU"]
            device = "cpu"
            if assigned:
                device = vulkan_device(assigned[0], untested_devices(), nvidia_smi())
        self._job = job
        self._remesher = Remesher(device)

    def __call__(self, batch: dict[str, Any]) -> dict[str, Any]:
        """The status rows for a batch of the list's rows."""
        status = []
        for row in json.loads(batch["rows"][0]):
            try:
                status.append(do_row(self._remesher, self._job, row))
            except DeviceError as error:
                # A lost device stays lost for this process. Ray starts another one, with the same batch, and
                # what is done of it is found by its records.
                print(f"rtfmesh: {why(error)}; starting this worker again", flush=True)
                os._exit(1)
        return {"rows": np.array([json.dumps(status)], dtype=object)}
