"""Marks the wheel as one for the platform whose libraries are in it."""

import os
from typing import Any

from hatchling.builders.hooks.plugin.interface import BuildHookInterface


class PlatformTag(BuildHookInterface):  # type: ignore[misc]
    """Takes the platform from `RTFMESH_CPU_PLATFORM`, which `ci/cpu_wheel.sh` sets."""

    def initialize(self, version: str, build_data: dict[str, Any]) -> None:
        """Any Python 3 on that platform will do."""
        build_data["pure_python"] = False
        build_data["tag"] = f"py3-none-{os.environ['RTFMESH_CPU_PLATFORM']}"
