#!/usr/bin/env python3
"""Collects the licences of what the program and the Python package contain besides rtfmesh's own code: the
crates that Cargo links on the systems of releases, and three.js in the HTML page. Build tools such as
shaderc are in none. They are in src/cli/licences.txt.gz, which `rtfmesh licences` prints. Usage:
ci/licenses.py fails if that file is not up to date; --write renews it; --check FILE fails if a copy lacks
something; --sbom FILE writes the same crates as a bill of materials (CycloneDX 1.5)."""

import gzip
import json
import pathlib
import re
import subprocess
import sys

ROOT = pathlib.Path(__file__).resolve().parent.parent
STORED = ROOT / "src/cli/licences.txt.gz"
# It links the program, too.
PACKAGE = "rtfmesh-python"
# The systems of releases.
TARGETS = [
    "aarch64-apple-darwin",
    "aarch64-unknown-linux-gnu",
    "x86_64-apple-darwin",
    "x86_64-pc-windows-gnu",
    "x86_64-pc-windows-msvc",
    "x86_64-unknown-linux-gnu",
]
NAMES = re.compile(r"(un)?licen[cs]e|copying|copyright|notice", re.IGNORECASE)
# Two crates, a licence that asks for the address of the sources, and what is no crate.
EXPECTED = ["ash", "clap", "option-ext", "three.js"]


def run(*command):
    """Standard output of a command."""
    return subprocess.run(command, cwd=ROOT, check=True, stdout=subprocess.PIPE, text=True).stdout


def linked_crates():
    """The crates of other authors that end up in a program, as Cargo's metadata."""
    targets = [word for target in TARGETS for word in ("--target", target)]
    tree = run(
        *("cargo", "tree", "--locked", "--package", PACKAGE, *targets),
        *("--edges", "normal,no-proc-macro", "--prefix", "none", "--format", "{p}"),
    )
    linked = {tuple(line.split()[:2]) for line in tree.splitlines() if line}
    crates = json.loads(run("cargo", "metadata", "--locked", "--format-version", "1"))["packages"]
    return sorted(
        (crate for crate in crates if crate["source"] and (crate["name"], "v" + crate["version"]) in linked),
        key=lambda crate: (crate["name"], crate["version"]),
    )


def licence_texts(folder):
    """The texts of the licence files in a folder."""
    files = sorted(path for path in folder.iterdir() if NAMES.match(path.name))
    files += [below for path in files if path.is_dir() for below in sorted(path.iterdir())]
    texts = [path.read_text(encoding="utf-8", errors="replace") for path in files if path.is_file()]
    return [text.replace("\r\n", "\n").replace("\f", "").strip("\n") for text in texts]


def texts_of_crate(crate):
    """The texts in a crate; where it has none, the MIT licence in its authors' names, if it has that one."""
    if texts := licence_texts(pathlib.Path(crate["manifest_path"]).parent):
        return texts
    if "MIT" not in re.findall(r"[\w.-]+", crate["license"]) or not crate["authors"]:
        sys.exit(f"licenses: {crate['name']} has no licence file")
    authors = ", ".join(re.sub(r" *<.*>", "", author) for author in crate["authors"])
    text = (ROOT / "LICENSE-MIT").read_text()
    return [re.sub(r"^Copyright .*$", f"Copyright (c) {authors}", text, flags=re.MULTILINE).strip("\n")]


def version_of_three():
    """The version of three.js in the HTML page."""
    return re.search(r"^three=(\S+)$", (ROOT / "ci/vendor.sh").read_text(), re.MULTILINE).group(1)


def collect():
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

    for crate in linked_crates():
        address = f"https://crates.io/crates/{crate['name']}/{crate['version']}"
        add(crate["name"], crate["version"], crate["license"] or "see below", address, texts_of_crate(crate))
    three = ROOT / "src/report/html/assets/three"
    add("three.js", version_of_three(), "MIT", "https://threejs.org", licence_texts(three))
    return parts, [(owners[key], text) for key, text in texts.items()]


def notices():
    """The whole text."""
    parts, texts = collect()
    lines = [
        "The program rtfmesh and its Python package contain the following works of others, some of them only",
        "on some systems. Their licences follow the list; the sources of each are at its address. They also",
        "contain Rust's standard library: MIT OR Apache-2.0, https://github.com/rust-lang/rust.\n",
        *parts,
    ]
    for sharing, text in texts:
        lines.append(f"\n{'=' * 80}\n{', '.join(sharing)}\n{'=' * 80}\n\n{text}")
    return "\n".join(lines) + "\n"


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


def sbom():
    """The bill of materials."""

    def component(kind, name, version, licence, address):
        # Old crates have a slash for OR.
        licence = re.sub(r" */ *", " OR ", licence)
        known = {"type": kind, "name": name, "version": version, "purl": f"pkg:{address}@{version}"}
        return {**known, "licenses": [{"expression": licence}]}

    lock = (ROOT / "Cargo.lock").read_text()
    components = []
    for crate in linked_crates():
        name, version = crate["name"], crate["version"]
        found = component("library", name, version, crate["license"], f"cargo/{name}")
        package = rf'^name = "{name}"\nversion = "{re.escape(version)}"\n.+\nchecksum = "(\w+)"$'
        (checksum,) = re.findall(package, lock, re.MULTILINE)
        components.append({**found, "hashes": [{"alg": "SHA-256", "content": checksum}]})
    components.append(component("library", "three", version_of_three(), "MIT", "npm/three"))
    version = re.search(r'^version = "(.*)"$', (ROOT / "Cargo.toml").read_text(), re.MULTILINE).group(1)
    program = component("application", "rtfmesh", version, "MIT OR Apache-2.0", "cargo/rtfmesh")
    document = {"bomFormat": "CycloneDX", "specVersion": "1.5", "version": 1}
    return {**document, "metadata": {"component": program}, "components": components}


if len(sys.argv) == 3 and sys.argv[1] == "--check":
    check(sys.argv[2])
elif len(sys.argv) == 3 and sys.argv[1] == "--sbom":
    pathlib.Path(sys.argv[2]).write_text(json.dumps(sbom(), indent=1) + "\n")
elif sys.argv[1:] == ["--write"]:
    STORED.write_bytes(gzip.compress(notices().encode(), mtime=0))
elif gzip.decompress(STORED.read_bytes()).decode() != notices():
    sys.exit("licenses: dependencies have changed; run ci/licenses.py --write and commit")
