"""Which Vulkan device a worker of Ray's gets, on machines that are not here."""

import os
import subprocess
import sys

import pytest

import rtfmesh
from rtfmesh.ray._devices import limit_threads, vulkan_device

# As nvidia-smi lists two cards, the second one in another PCI domain.
SMI = """0, GPU-11111111-aaaa-bbbb-cccc-000000000001, 00000000:3B:00.0
1, GPU-22222222-aaaa-bbbb-cccc-000000000002, 00010000:AF:00.0
"""
UUIDS = ["11111111-aaaa-bbbb-cccc-000000000001", "22222222-aaaa-bbbb-cccc-000000000002"]
PCI = ["0000:3b:00.0", "10000:af:00.0"]


def machine(**keys):
    """Vulkan's list: the CPU, then the cards in the other order; `keys` has a value for each card."""
    cards = [
        {"name": f"Card {card}", "kind": "discrete", "driver": "NVIDIA 570.86"}
        | {key: values[card] for key, values in keys.items()}
        for card in (1, 0)
    ]
    devices = [{"name": "llvmpipe", "kind": "cpu", "driver": "llvmpipe Mesa"}, *cards]
    return [{"index": index, **device} for index, device in enumerate(devices)]


@pytest.mark.parametrize("keys", [{"uuid": UUIDS}, {"pci": PCI}, {"uuid": UUIDS, "pci": PCI}])
def test_cards_are_found_whatever_the_order(keys):
    assert vulkan_device("0", machine(**keys), SMI) == 2
    assert vulkan_device("1", machine(**keys), SMI) == 1
    assert vulkan_device("GPU-22222222-aaaa-bbbb-cccc-000000000002", machine(**keys), SMI) == 1


def test_uuids_need_no_other_tool():
    assert vulkan_device(f"GPU-{UUIDS[0]}", machine(uuid=UUIDS), None) == 2
    assert vulkan_device(f"GPU-{UUIDS[0]}", machine(uuid=[u.replace("-", "") for u in UUIDS]), None) == 2


def test_uuids_count_more_than_addresses():
    assert vulkan_device("0", machine(uuid=UUIDS, pci=PCI[::-1]), SMI) == 2


def test_without_names_the_order_decides():
    assert [vulkan_device(card, machine(), SMI) for card in "01"] == [1, 2]
    assert [vulkan_device(card, machine(uuid=UUIDS), None) for card in "01"] == [1, 2]
    integrated = {"index": 7, "name": "Integrated", "kind": "integrated", "driver": "Mesa"}
    assert [vulkan_device(card, [integrated, *machine()], None) for card in "01"] == [1, 2]
    assert vulkan_device("0", [integrated], None) == 7


@pytest.mark.parametrize(
    ("assigned", "devices", "smi"),
    [
        ("2", machine(uuid=UUIDS), SMI),
        ("0", machine()[:1], SMI),
        ("0", machine()[:1], None),
        ("0", [], None),
        ("GPU-33333333", machine(uuid=UUIDS), SMI),
        # One card is hidden from Vulkan: the other one is not taken for it.
        ("0", machine(uuid=UUIDS)[:2], SMI),
        ("GPU-11111111-aaaa-bbbb-cccc-000000000001", machine(), None),
    ],
)
def test_a_card_that_vulkan_does_not_have_is_an_error(assigned, devices, smi):
    with pytest.raises(rtfmesh.DeviceError, match="NVIDIA_DRIVER_CAPABILITIES") as raised:
        vulkan_device(assigned, devices, smi)
    assert assigned in str(raised.value)


def test_parts_of_cards_are_an_error():
    with pytest.raises(rtfmesh.DeviceError, match="MIG"):
        vulkan_device("MIG-5", machine(uuid=UUIDS), SMI)


@pytest.mark.parametrize(("cores", "threads"), [(0.5, "1"), (1, "1"), (4, "4")])
def test_workers_start_as_many_threads_as_they_have_cores(cores, threads, monkeypatch):
    for name in ("LP_NUM_THREADS", "RAYON_NUM_THREADS"):
        monkeypatch.setenv(name, "99")
    limit_threads(cores)
    assert os.environ["LP_NUM_THREADS"] == os.environ["RAYON_NUM_THREADS"] == threads


@pytest.mark.skipif(sys.platform != "linux", reason="threads are counted in /proc")
def test_the_limit_holds_for_lavapipe():
    lines = """
import os, sys, rtfmesh
from rtfmesh.ray._devices import limit_threads
limit_threads(3)
# Its threads end with it.
remesher = rtfmesh.Remesher("cpu")
remesher.remesh([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]], 100)
names = [open(f"/proc/self/task/{task}/comm").read().strip() for task in os.listdir("/proc/self/task")]
sys.exit(sum(name.startswith("llvmpipe") for name in names))
"""
    assert subprocess.run([sys.executable, "-c", lines], timeout=120).returncode == 3
