# Sourced by the checks: `step NAME COMMAND...` runs a command under a heading, and ends the script if it
# fails.
step() {
  local name=$1
  shift
  printf '\n==> %s\n' "$name"
  "$@" || { printf '\n==> failed: %s\n' "$name" >&2; exit 1; }
}
