#!/usr/bin/env python3
"""Packs a folder as .tar.gz or .zip with the same bytes for the same content: ci/pack.py FOLDER OUT"""

import gzip
import pathlib
import sys
import tarfile
import zipfile

folder, out = pathlib.Path(sys.argv[1]), pathlib.Path(sys.argv[2])
files = sorted(path for path in folder.rglob("*") if path.is_file())
names = {path: f"{folder.name}/{path.relative_to(folder).as_posix()}" for path in files}


def mode(path):
    """Programs and scripts stay so."""
    return 0o755 if path.stat().st_mode & 0o100 else 0o644


if out.suffix == ".zip":
    with zipfile.ZipFile(out, "w", zipfile.ZIP_DEFLATED) as archive:
        for path in files:
            info = zipfile.ZipInfo(names[path], (1980, 1, 1, 0, 0, 0))
            info.compress_type = zipfile.ZIP_DEFLATED
            info.external_attr = mode(path) << 16
            archive.writestr(info, path.read_bytes())
else:
    with open(out, "wb") as raw, gzip.GzipFile("", "wb", fileobj=raw, mtime=0) as packed:
        with tarfile.open(fileobj=packed, mode="w") as archive:
            for path in files:
                info = tarfile.TarInfo(names[path])
                info.size, info.mode = path.stat().st_size, mode(path)
                with open(path, "rb") as file:
                    archive.addfile(info, file)
