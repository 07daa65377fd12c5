"""Which Vulkan device a worker is to use, from the GPU that Ray has assigned to it."""

from __future__ import annotations

import os
import subprocess
from collections.abc import Sequence
from typing import Any, NamedTuple

from .._errors import DeviceError

# What the driver's own tool is asked for; `listed` reads the answer.
QUERY = ["nvidia-smi", "--query-gpu=index,uuid,pci.bus_id", "--format=csv,noheader"]
CONTAINER = "in a container, set NVIDIA_DRIVER_CAPABILITIES=graphics,compute,utility"


class Card(NamedTuple):
    """A GPU as NVIDIA's driver names it."""

    number: str
    uuid: str
    pci: str


def nvidia_smi() -> str | None:
    """What nvidia-smi lists (see `QUERY`), or None where there is none or it fails."""
    try:
        return subprocess.run(QUERY, capture_output=True, text=True, timeout=60, check=True).stdout
    except (OSError, subprocess.SubprocessError):
        return None


def listed(text: str) -> list[Card]:
    """The cards in the output of nvidia-smi."""
    rows = ([cell.strip() for cell in line.split(",")] for line in text.splitlines())
    return [Card(*row) for row in rows if len(row) == len(Card._fields)]


def plain_uuid(uuid: str) -> str:
    """The hexadecimal digits alone: CUDA puts GPU- in front, and not everybody writes hyphens."""
    return uuid.lower().removeprefix("gpu-").replace("-", "")


def plain_pci(address: str) -> tuple[int, ...]:
    """Domain, bus, device and function as numbers: nvidia-smi writes the domain with eight digits."""
    return tuple(int(part, 16) for part in address.replace(".", ":").split(":"))


def vulkan_device(assigned: str, devices: Sequence[dict[str, Any]], smi: str | None) -> int:
    """The index, in `devices`, of the GPU that CUDA calls `assigned`.

    Vulkan does not know CUDA_VISIBLE_DEVICES, and has an order of its own. `assigned` is the number or UUID
    that Ray gives, `devices` are those of `rtfmesh.devices`, and `smi` is the output of nvidia-smi (see
    `QUERY`), or None without it. A card is found by its UUID, or else by its PCI address.

    Where either side has neither, the order decides: GPU number 2 is the third of the GPUs that Vulkan lists,
    of NVIDIA's if it lists any. Workers get different GPUs by that, too, but perhaps not the ones that CUDA
    has under these numbers.

    Raises `DeviceError` if there is no such device.
    """
    if assigned.startswith("MIG-"):
        raise DeviceError(f"Ray assigned {assigned}, a part of a GPU, which Vulkan cannot open; turn MIG off")
    gpus = [device for device in devices if device["kind"] != "cpu"]
    cards = listed(smi or "")
    card = next((c for c in cards if assigned == c.number or c.uuid.startswith(assigned)), None)
    if card is None and not assigned.isdigit():
        card = Card("", assigned, "")
    if card is not None:
        for device in gpus:
            if device.get("uuid") and plain_uuid(device["uuid"]) == plain_uuid(card.uuid):
                return int(device["index"])
        for device in gpus:
            if card.pci and device.get("pci") and plain_pci(device["pci"]) == plain_pci(card.pci):
                return int(device["index"])
    named = any(device.get("uuid") or device.get("pci") for device in gpus)
    # A card that can be told apart is not taken for another.
    if not (card is not None and named) and assigned.isdigit():
        own = [device for device in gpus if "nvidia" in device["driver"].lower()] or gpus
        if int(assigned) < len(own):
            return int(own[int(assigned)]["index"])
    names = ", ".join(f"{device['index']} {device['name']}" for device in devices) or "none at all"
    raise DeviceError(f"Vulkan has no device for GPU {assigned} of Ray, only {names}; {CONTAINER}")


def limit_threads(cores: float) -> None:
    """Leaves this process this many cores, for lavapipe and for work next to the device.

    To be called before a device opens: both start their threads once.
    """
    threads = str(max(1, round(cores)))
    os.environ["LP_NUM_THREADS"] = threads
    os.environ["RAYON_NUM_THREADS"] = threads
