"""Adds the wheels of a folder and their platforms to the manifest of the extension."""

import re
import sys
from pathlib import Path

# Parts of wheels' names, and what Blender calls the platforms.
PLATFORMS = {
    r"linux.*x86_64": "linux-x64",
    r"linux.*aarch64": "linux-arm64",
    r"macosx.*arm64": "macos-arm64",
    r"macosx.*x86_64": "macos-x64",
    r"win_amd64": "windows-x64",
    r"win_arm64": "windows-arm64",
}


def platform(wheel: str) -> str:
    """Blender's name of the platform of a wheel."""
    tag = wheel.removesuffix(".whl").split("-")[-1]
    found = [name for pattern, name in PLATFORMS.items() if re.search(pattern, tag)]
    if len(found) != 1:
        raise SystemExit(f"finish_manifest: no platform of Blender's is that of {wheel}")
    return found[0]


def main() -> None:
    """Writes the lines."""
    folder = Path(sys.argv[1])
    wheels = sorted(path.name for path in (folder / "wheels").glob("*.whl"))
    platforms = sorted({platform(wheel) for wheel in wheels})
    manifest = folder / "blender_manifest.toml"
    lines = [line for line in manifest.read_text().splitlines() if not line.startswith("#")]
    lines.append(f"platforms = {platforms}".replace("'", '"'))
    lines.append(f"wheels = {[f'./wheels/{wheel}' for wheel in wheels]}".replace("'", '"'))
    manifest.write_text("\n".join(lines) + "\n")


main()
