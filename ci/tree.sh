#!/usr/bin/env bash
# Prints the source files below the given folders with the first sentence of each: ci/tree.sh [FOLDER...]
# Without arguments: src, glsl and tests.
set -euo pipefail
export LC_ALL=C.UTF-8
cd "$(dirname "$0")/.."
[ $# -gt 0 ] || set -- src glsl tests

git ls-files --cached --others --exclude-standard -- "$@" | grep -E '\.(rs|comp|glsl)$' | sort |
  while read -r path; do if [ -f "$path" ]; then echo "$path"; fi; done | xargs -r -d '\n' awk '
  function show() {
    sub(/^Purpose: /, "", text)
    gsub(/ +/, " ", text)
    if (match(text, /\. [A-Z]/)) text = substr(text, 1, RSTART - 1)
    sub(/\.$/, "", text)
    n = split(path, parts, "/")
    shared = 1
    for (i = 1; i < n; i++) {
      if (parts[i] != shown[i]) shared = 0
      if (!shared) { printf "%*s%s/\n", 2 * (i - 1), "", parts[i]; shown[i] = parts[i]; delete shown[i + 1] }
    }
    delete shown[n]
    printf "%-38s %s\n", sprintf("%*s%s", 2 * (n - 1), "", parts[n]), text
  }
  FNR == 1 { if (path != "") show(); path = FILENAME; text = ""; ended = 0 }
  !ended && match($0, /^\/\/!?( |$)/) { line = $0; sub(/^\/\/!? ?/, "", line)
    if (line ~ /^(Invocation: .*)?$/) ended = 1; else text = text (text == "" ? "" : " ") line; next }
  { ended = 1 }
  END { if (path != "") show() }'
