"""Drivers that come as packages."""

import os


def add_cpu_driver() -> None:
    """Names the driver of `rtfmesh_cpu`, where that is installed, to Vulkan's loader, beside the system's.

    It must come before a device is first looked for. Processes that are started from this one see it, too.
    """
    try:
        from rtfmesh_cpu import MANIFEST
    except ModuleNotFoundError:
        return
    added = [path for path in os.environ.get("VK_ADD_DRIVER_FILES", "").split(os.pathsep) if path]
    if str(MANIFEST) not in added:
        os.environ["VK_ADD_DRIVER_FILES"] = os.pathsep.join([*added, str(MANIFEST)])
