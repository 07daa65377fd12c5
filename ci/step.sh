# Sourced by the checks: `step NAME COMMAND...` runs a command under a heading, tells how long it took, and
# ends the script if it fails.
step() {
  local name=$1 start=$SECONDS
  shift
  printf '\n==> %s\n' "$name"
  "$@" || { printf '\n==> failed: %s\n' "$name" >&2; exit 1; }
  printf '    %d s: %s\n' $((SECONDS - start)) "$name"
}
