#!/usr/bin/env bash
# Makes bench/peers/.venv with the programs of requirements.txt, and CAD parts in bench/peers/.parts. Needs
# Python 3.11 with venv (Debian: python3-venv) and PyPI; for geogram also a C++ compiler and libLBFGS (Debian:
# g++ liblbfgs-dev).
set -euo pipefail
cd "$(dirname "$0")"
[ -x .venv/bin/python ] || "${PYTHON:-python3}" -m venv .venv
.venv/bin/pip install --quiet --disable-pip-version-check --requirement requirements.txt

# The package of geogram is a library with headers; its Python functions do not include remeshing.
site=$(.venv/bin/python -c 'import sysconfig; print(sysconfig.get_path("platlib"))')
if command -v g++ >/dev/null && echo '#include <lbfgs.h>' | g++ -E -x c++ - >/dev/null 2>&1; then
  for program in geogram_remesh geogram_reconstruct; do
    g++ -O2 -I "$site/include/geogram1" "$program.cpp" "$site/lib64/libgeogram.a" \
      "$site"/geogram.libs/*.so* "-Wl,-rpath,$site/geogram.libs" -llbfgs -lpthread -ldl \
      -o ".venv/bin/$program"
  done
else
  echo "peers: without geogram: g++ or lbfgs.h is missing (Debian: apt-get install g++ liblbfgs-dev)" >&2
fi
.venv/bin/python parts.py .parts
echo "peers: ready in bench/peers/.venv"
