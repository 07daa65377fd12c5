#!/usr/bin/env bash
# Runs a test program of aarch64, with its arguments, by qemu-user, for ci/cross.sh. The program rtfmesh,
# which tests start as any other, becomes a script that does the same.
set -euo pipefail
qemu=(qemu-aarch64 -L /usr/aarch64-linux-gnu)
program=$(realpath "$(dirname "$1")/..")/rtfmesh
if [ -f "$program" ] && ! head -c 2 "$program" | grep -q '^#!'; then
  mv "$program" "$program.aarch64"
  printf '#!/bin/sh\nexec %s "%s.aarch64" "$@"\n' "${qemu[*]}" "$program" >"$program"
  chmod +x "$program"
fi
exec "${qemu[@]}" "$@"
