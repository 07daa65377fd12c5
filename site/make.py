"""Assembles the pages of the site from the repository, and the gallery by running its commands.

python site/make.py FOLDER PROGRAM: FOLDER gets `pages`, `python` and `mkdocs.yml`; PROGRAM is rtfmesh.
"""

import ast
import json
import os
import re
import shutil
import subprocess
import sys
import time
from pathlib import Path

import tomllib

ROOT = Path(__file__).resolve().parent.parent
PAGES = ("*.md", "docs/*.md", "bench/*.md", "bench/results/*.md", "docs/pictures/*")
# Pages of tables and details, which would be half of the index that each page loads for its search.
UNSEARCHED = (
    "bench/results/*.md",
    "docs/ARCHITECTURE.md",
    "docs/experiments.md",
    "docs/results.md",
    "docs/presets.md",
    "C*.md",
)
MODELS = ("genus3", "torus", "box", "sphere", "bumpy-sphere", "thin-plate", "open-hemisphere")
# The links of Markdown, except addresses and places in the same page.
LINK = re.compile(r"\]\((?!https?://|#|mailto:)([^)#\s]+)")
PICTURE = re.compile(r"^!\[.*\]\(docs/pictures/demo\.png\)$", re.MULTILINE)
VIEWER = """<iframe class="viewer" src="viewer.html" loading="lazy"
title="A model before and after, which can be turned"></iframe>
"""
CAPTION = """*Left: the built-in model `genus3`. Right: the result of
`rtfmesh remesh genus3.ply turned.ply -n 1500 --html viewer.html`, which has made this view. Drag to turn.*"""
GALLERY = """# Gallery

Each command was run to make this page, on the built-in models (`rtfmesh sample genus3 genus3.ply`). Pictures
show the input and the result. Seconds are those of a whole process on {cores} CPU cores, on the device
{device}. RMS is the distance between both surfaces in percent of the input's diagonal.
"""
PYTHON = """# Python reference

Everything here is in the package `rtfmesh`. [The guide](docs/python.md) shows how to use it.
"""
RUST = """---
search:
  exclude: true
---

# Rust reference

All public items of the crate; `cargo doc --open` shows their documentation. The folder `examples` of the
repository has first steps.

```text
{items}```
"""
# Functions of modules that need other packages.
ELSEWHERE = ("pyvista.Accessor", "vtk.remesh", "vtk.poly_data", "trimesh.remesh", "meshio.remesh")


def copy_pages(pages: Path) -> None:
    """Copies all pages to the places that they have in the repository, so that links between them hold."""
    for pattern in PAGES:
        for path in ROOT.glob(pattern):
            place = pages / path.relative_to(ROOT)
            place.parent.mkdir(parents=True, exist_ok=True)
            shutil.copy(path, place)
    for pattern in UNSEARCHED:
        for path in pages.glob(pattern):
            path.write_text(f"---\nsearch:\n  exclude: true\n---\n\n{path.read_text()}")
    for path in list(pages.rglob("*.md")):
        for link in LINK.findall(path.read_text()):
            place = (path.parent / link).resolve()
            source = ROOT / place.relative_to(pages.resolve())
            if not place.exists() and source.is_file():
                place.parent.mkdir(parents=True, exist_ok=True)
                shutil.copy(source, place)


def write_start(pages: Path, work: Path, program: Path) -> None:
    """Puts a page of rtfmesh's, in which both meshes can be turned, in the place of README's picture."""
    words = ["remesh", "genus3.ply", "turned.ply", "-n", "1500", "--quiet", "--html"]
    subprocess.run([program, *words, (pages / "viewer.html").resolve()], cwd=work, check=True)
    start = pages / "README.md"
    text, count = PICTURE.subn(lambda _: VIEWER, start.read_text())
    if count != 1:
        raise SystemExit(
            "make: README.md has no picture docs/pictures/demo.png to put the viewer in place of"
        )
    start.write_text(re.sub(r"^\*Left: .*?\*$", CAPTION, text, flags=re.MULTILINE | re.DOTALL, count=1))


def run(words: list[str], work: Path, environment: dict[str, str]) -> str:
    """The output of a command in this folder; ends the program if it fails."""
    done = subprocess.run(words, cwd=work, env=environment, capture_output=True, text=True)
    if done.returncode:
        raise SystemExit(f"make: {' '.join(words)}\n{done.stderr}")
    return done.stdout


def run_case(case: dict, work: Path, environment: dict[str, str]) -> float:
    """Runs the commands of a case and returns the seconds that the last one took."""
    for command in case["commands"]:
        start = time.perf_counter()
        run(["bash", "-c", command], work, environment)
    return time.perf_counter() - start


def gallery(pages: Path, work: Path, program: Path) -> None:
    """Runs all cases and writes their page."""
    environment = {
        **os.environ,
        "PATH": f"{program.parent}:{Path(sys.executable).parent}:{os.environ['PATH']}",
    }

    def output(*words: str) -> str:
        return run([str(program), *words], work, environment)

    for model in MODELS:
        output("sample", model, f"{model}.ply")
    device = json.loads(output("devices", "--json"))
    name = (device["devices"] if isinstance(device, dict) else device)[0]["name"]
    (pages / "pictures").mkdir()
    parts = [GALLERY.format(cores=os.cpu_count(), device=name)]
    for case in tomllib.loads((ROOT / "site/gallery.toml").read_text())["case"]:
        seconds = run_case(case, work, environment)
        before, after = case["before"], case["after"]
        against = case.get("against", before)
        picture = f"{Path(after).stem}.png"
        shown = case.get("picture", after if before == after else f"{before} {after}").split()
        view = [*case.get("view", "").split(), "--size", "420x320"]
        output("render", *shown, str((pages / "pictures" / picture).resolve()), *view)
        compared = [] if against == after else ["--against", against]
        found = json.loads(output("measure", after, *compared, "--json"))
        quality, distances = found["quality"], found.get("distances")
        figures = {
            "vertices": f"{found['vertices']:,}",
            "triangles": f"{found['faces']:,}",
            "mean quality": f"{quality['mean_quality']:.3f}",
            "smallest angle": f"{quality['min_angle']:.1f}°",
            "six neighbours": f"{100 * found['valence']['fraction_6']:.0f}\u00a0%",
            "RMS": f"{distances['rms']:.3f}\u00a0%" if distances else "–",
            "seconds": f"{seconds:.2f}",
        }
        parts += [
            f"## {case['title']}\n",
            f"{case['text']}\n",
            "```sh",
            *(command.strip() for command in case["commands"]),
            "```\n",
            f"![{case['title']}](pictures/{picture})\n",
            "| " + " | ".join(figures) + " |",
            "|" + "---|" * len(figures),
            "| " + " | ".join(figures.values()) + " |\n",
        ]
    (pages / "gallery.md").write_text("\n".join(parts))


def references(pages: Path) -> None:
    """Writes the references: of Python from its docstrings, of Rust from the list of public items."""
    module = ast.parse((ROOT / "python/rtfmesh/__init__.py").read_text())
    listed = next(
        ast.literal_eval(statement.value)
        for statement in module.body
        if isinstance(statement, ast.Assign) and ast.unparse(statement.targets[0]) == "__all__"
    )
    names = [name for name in listed if not name.startswith("_")]
    items = [f"::: rtfmesh.{name}\n" for name in (*names, *ELSEWHERE)]
    (pages / "python.md").write_text("\n".join([PYTHON, *items]))
    (pages / "rust.md").write_text(RUST.format(items=(ROOT / "docs/public-api.txt").read_text()))


def main() -> None:
    """Assembles everything."""
    folder, program = Path(sys.argv[1]).resolve(), Path(sys.argv[2]).resolve()
    pages, work = folder / "pages", folder / "gallery"
    for made in (pages, work, folder / "html", folder / "python"):
        shutil.rmtree(made, ignore_errors=True)
    work.mkdir(parents=True)
    copy_pages(pages)
    shutil.copy(ROOT / "site/coming-from.md", pages)
    shutil.copy(ROOT / "site/site.css", pages)
    shutil.copy(ROOT / "site/mkdocs.yml", folder)
    shutil.copytree(ROOT / "python/rtfmesh", folder / "python/rtfmesh")
    gallery(pages, work, program)
    write_start(pages, work, program)
    references(pages)


main()
