#!/usr/bin/env bash
# Makes bench/peers/.venv with the programs of requirements.txt. Needs Python 3.11 with venv (Debian: python3-venv) and PyPI.
set -euo pipefail
cd "$(dirname "$0")"
[ -x .venv/bin/python ] || "${PYTHON:-python3}" -m venv .venv
.venv/bin/pip install --quiet --disable-pip-version-check --requirement requirements.txt
echo "peers: ready in bench/peers/.venv"
