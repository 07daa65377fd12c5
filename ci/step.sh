# Sourced by the checks: `step NAME COMMAND...` runs a command under a heading, tells how long it took, and
# ends the script if it fails. `beside NAME COMMAND...` begins one that the following steps do not wait for,
# since hardly any keeps all processors busy; `wait_for_all` shows what they printed, and ends the script if
# one of them failed.
step() {
  local name=$1 start=$SECONDS
  shift
  printf '\n==> %s\n' "$name"
  "$@" || { printf '\n==> failed: %s\n' "$name" >&2; exit 1; }
  printf '    %d s: %s\n' $((SECONDS - start)) "$name"
}

# Process and output of each step that runs beside others.
declare -A outputs=()
trap 'kill "${!outputs[@]}" 2>/dev/null || true; rm -f "${outputs[@]}"' EXIT

beside() {
  local output
  output=$(mktemp)
  (trap - EXIT; step "$@") >"$output" 2>&1 &
  outputs[$!]=$output
}

wait_for_all() {
  local process failed=0
  for process in "${!outputs[@]}"; do
    wait "$process" || failed=1
    cat "${outputs[$process]}"
    rm "${outputs[$process]}"
    unset "outputs[$process]"
  done
  return $failed
}
