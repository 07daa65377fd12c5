#!/usr/bin/env python3
"""Prints the licences of what a compiled program contains besides rtfmesh's own code: the crates that Cargo
links for PACKAGE on this system, and three.js in the HTML page. Build tools such as shaderc are in none.
Usage: ci/licenses.py PACKAGE >LICENSE-THIRD-PARTY, or --check FILE, which fails if FILE lacks something."""

import json
import pathlib
import re
import subprocess
import sys

ROOT = pathlib.Path(__file__).resolve().parent.parent
NAMES = re.compile(r"(un)?licen[cs]e|copying|copyright|notice", re.IGNORECASE)
# Two crates, a licence that asks for the address of the sources, and what is no crate.
EXPECTED = ["ash", "clap", "option-ext", "three.js"]


def run(*command):
    """Standard output of a command."""
    return subprocess.run(command, cwd=ROOT, check=True, stdout=subprocess.PIPE, text=True).stdout


def linked_crates(package):
    """The crates of other authors that end up in the program, as Cargo's metadata."""
    tree = run(
        *("cargo", "tree", "--locked", "--package", package, "--edges", "normal,no-proc-macro"),
        *("--prefix", "none", "--format", "{p}"),
    )
    linked = {tuple(line.split()[:2]) for line in tree.splitlines() if line}
    # Crates for other systems need not have been downloaded.
    (host,) = re.findall(r"^host: (.*)$", run("rustc", "-vV"), re.MULTILINE)
    arguments = ["--locked", "--format-version", "1", "--filter-platform", host]
    crates = json.loads(run("cargo", "metadata", *arguments))["packages"]
    return sorted(
        (crate for crate in crates if crate["source"] and (crate["name"], "v" + crate["version"]) in linked),
        key=lambda crate: (crate["name"], crate["version"]),
    )


def licence_texts(folder):
    """The texts of the licence files in a folder."""
    files = sorted(path for path in folder.iterdir() if NAMES.match(path.name))
    files += [below for path in files if path.is_dir() for below in sorted(path.iterdir())]
    texts = [path.read_text(encoding="utf-8", errors="replace") for path in files if path.is_file()]
    if not texts:
        sys.exit(f"licenses: {folder} has no licence file")
    return [text.replace("\r\n", "\n").replace("\f", "").strip("\n") for text in texts]


def collect(package):
    """Lines about each part, and the parts that share each text."""
    parts, owners, texts = [], {}, {}

    def add(name, version, licence, address, found):
        parts.append(f"{name} {version}: {licence}, {address}")
        for text in found:
            # Indentation and line breaks are no difference.
            key = " ".join(text.split())
            texts.setdefault(key, text)
            sharing = owners.setdefault(key, [])
            if f"{name} {version}" not in sharing:
                sharing.append(f"{name} {version}")

    for crate in linked_crates(package):
        address = f"https://crates.io/crates/{crate['name']}/{crate['version']}"
        texts_of_crate = licence_texts(pathlib.Path(crate["manifest_path"]).parent)
        add(crate["name"], crate["version"], crate["license"] or "see below", address, texts_of_crate)
    three = ROOT / "src/report/html/assets/three"
    version = re.search(r"^three=(\S+)$", (ROOT / "ci/vendor.sh").read_text(), re.MULTILINE).group(1)
    add("three.js", version, "MIT", "https://threejs.org", licence_texts(three))
    return parts, [(owners[key], text) for key, text in texts.items()]


def write(package):
    """Prints the notices."""
    parts, texts = collect(package)
    print("rtfmesh contains the following works of others, whose licences follow the list. The sources of")
    print("each are at its address. It also contains Rust's standard library: MIT OR Apache-2.0,")
    print("https://github.com/rust-lang/rust.\n")
    print("\n".join(parts))
    for sharing, text in texts:
        print(f"\n{'=' * 80}\n{', '.join(sharing)}\n{'=' * 80}\n\n{text}")


def check(path):
    """Fails unless the file names what must be in it, each with a text."""
    text = pathlib.Path(path).read_text(encoding="utf-8")
    listed, *sections = re.split(r"^={80}\n(.*)\n={80}\n", text, flags=re.MULTILINE)
    owners = {name.split()[0] for heading in sections[::2] for name in heading.split(", ")}
    names = set(re.findall(r"^(\S+) \S+: \S", listed, re.MULTILINE))
    missing = [name for name in [*EXPECTED, *names] if name not in names or name not in owners]
    if missing or "Apache License" not in text:
        sys.exit(f"licenses: {path} lacks {', '.join(missing) or 'texts'}")
    if tools := sorted(names & {"shaderc", "shaderc-sys", "spirq"}):
        sys.exit(f"licenses: {path} has {', '.join(tools)}, which only builds the kernels")


if len(sys.argv) == 3 and sys.argv[1] == "--check":
    check(sys.argv[2])
else:
    write(*sys.argv[1:])
