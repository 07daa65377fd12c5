#!/usr/bin/env bash
# House rules that neither the compiler nor clippy checks. Prints each breach with its place, or nothing.
set -euo pipefail
export LC_ALL=C.UTF-8
shopt -s lastpipe # so that the end of a pipe can count breaches
cd "$(dirname "$0")/.."

breaches=0
# The lines on standard input break the rule named by the arguments.
breach() {
  local found
  found=$(cat)
  if [ -n "$found" ]; then
    printf 'rules: %s\n%s\n' "$*" "$found" >&2
    breaches=1
  fi
}
# Files git tracks, or would track, below the given paths.
files() {
  git ls-files --cached --others --exclude-standard -- "$@" | while read -r f; do
    if [ -f "$f" ]; then echo "$f"; fi
  done
}
# Their lines that match; none is no error.
lines() { local pattern=$1; shift; files "$@" | xargs -r -d '\n' grep -nHE "$pattern" || true; }

lines '\bunsafe[[:space:]]*(\{|fn|impl|extern)' '*.rs' ':!src/gpu' | breach "unsafe code outside src/gpu"
lines 'dst_binding|PushConstantRange|local_size' 'src/*.rs' 'tests/*.rs' ':!src/gpu' |
  breach "a binding, push range or group size typed by hand; the generated declarations have them"
lines '#\[ignore|todo!\(|unimplemented!\(|dbg!\(|\b(TODO|FIXME|XXX)\b' '*.rs' '*.comp' '*.glsl' |
  breach "a stub or leftover"
files '*.rs' '*.comp' '*.glsl' '*.py' '*.sh' '*.js' '*.css' '*.html' | xargs -r -d '\n' awk '
  FNR == 1 { if (n >= 600) print file ": " n " lines"; file = FILENAME }
  { n = FNR }
  END { if (n >= 600) print file ": " n " lines" }' | breach "a file of 600 lines or more"
# From the signature to the closing brace of the same indentation, as rustfmt writes it.
files '*.rs' | xargs -r -d '\n' awk '
  FNR == 1 { start = 0 }
  !start && /^ *(pub(\([a-z ]*\))? +)?(const +)?(unsafe +)?fn [a-z_0-9]+/ {
    match($0, /^ */); indent = RLENGTH; start = FNR; name = $0; sub(/\(.*/, "", name); sub(/^.*fn /, "", name)
  }
  start && (/^ *\}$/ || (FNR == start && /\}$/)) {
    match($0, /^ */)
    if (RLENGTH == indent) { if (FNR - start + 1 >= 80) print FILENAME ":" start ": " name; start = 0 }
  }' | breach "a function of 80 lines or more"
# Tables and pictures in Markdown cannot be broken, nor can addresses; files in tests' strings may have long
# lines, and bench/results is as programs wrote it. Columns are characters, not bytes.
lines '^.{111,}' '*.rs' '*.comp' '*.glsl' '*.md' '*.sh' '*.py' ':!bench/results' |
  { grep -vE '\.md:[0-9]+:(\||!\[)|^tests/[^:]*:[0-9]+:.*\\n|https?://' || true; } |
  breach "a line of more than 110 columns"
# ci/tree.sh makes the map of the sources from these lines.
files 'src/*.rs' 'tests/*.rs' | xargs -r -d '\n' awk 'FNR == 1 && !/^\/\/! / { print FILENAME }' |
  breach "a file that does not begin with a line of documentation (//!)"
files 'glsl/*.glsl' | xargs -r -d '\n' awk 'FNR == 1 && !/^\/\/ / { print FILENAME }' |
  breach "an include that does not begin with a comment"
# Paths between backticks, from the root; those of the example of a new stage are not there.
{ grep -ohE '`(src|glsl|tests|build|bench|ci|docs|fuzz|python)/[A-Za-z0-9_./-]+`' docs/ARCHITECTURE.md \
  CONTRIBUTING.md || true; } | tr -d '\140' | { grep -v '/project/grid\.' || true; } | while read -r path; do
  if ! [ -e "$path" ]; then echo "$path"; fi
done | breach "a path in docs/ARCHITECTURE.md or CONTRIBUTING.md that is not there"
files | while read -r f; do
  bytes=$(wc -c <"$f")
  if [ "$bytes" -gt 307200 ]; then echo "$f: $bytes bytes"; fi
done | breach "a file of more than 300 KB"
exit $breaches
