"""Mesa's lavapipe, a Vulkan driver for the CPU, with the libraries that it needs; no code of its own.

`import rtfmesh` finds it. Other programs do with `VK_ADD_DRIVER_FILES` set to `MANIFEST`.
"""

from pathlib import Path

MANIFEST = Path(__file__).parent / "lavapipe.json"
"""The driver's manifest, for Vulkan's loader."""
