"""The driver that `rtfmesh[cpu]` brings, seen by what `import rtfmesh` tells Vulkan."""

import os
import subprocess
import sys

import pytest


@pytest.fixture
def added(tmp_path):
    """What `VK_ADD_DRIVER_FILES` is after the import, with a package of the driver's name."""
    package = tmp_path / "rtfmesh_cpu"
    package.mkdir()
    (package / "__init__.py").write_text("from pathlib import Path\nMANIFEST = Path('/far/lavapipe.json')\n")

    def run(before, path):
        line = "import os, rtfmesh; print(os.environ.get('VK_ADD_DRIVER_FILES'))"
        others = {k: v for k, v in os.environ.items() if k not in ("VK_ADD_DRIVER_FILES", "PYTHONPATH")}
        told = {} if before is None else {"VK_ADD_DRIVER_FILES": before}
        done = subprocess.run(
            [sys.executable, "-c", line],
            env={**others, **told, "PYTHONPATH": str(path)},
            capture_output=True,
            text=True,
            timeout=60,
            check=True,
        )
        return done.stdout.strip()

    return lambda before: (run(before, tmp_path), run(before, tmp_path / "none"))


def test_a_driver_that_is_installed_is_named_to_the_loader(added):
    own = "/far/lavapipe.json"
    assert added(None) == (own, "None")
    assert added("") == (own, "")
    mine = f"/mine/driver.json{os.pathsep}/mine/folder"
    assert added(mine) == (f"{mine}{os.pathsep}{own}", mine)
    # As a process has it that was started from another one.
    assert added(own) == (own, own)
