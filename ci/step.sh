# Sourced by the checks: `step NAME COMMAND...` runs a command under a heading, tells how long it took, and
# ends the script if it fails. `beside NAME COMMAND...` begins one that the following steps do not wait for,
# since hardly any keeps all processors busy; `wait_for_all` shows what they printed, and fails if one of them
# did.
step() {
  local name=$1 start=$SECONDS
  shift
  printf '\n==> %s\n' "$name"
  "$@" || { printf '\n==> failed: %s\n' "$name" >&2; exit 1; }
  printf '    %d s: %s\n' $((SECONDS - start)) "$name"
}

# The process group of each step that runs beside others, and the file with its output.
groups=() outputs=()

beside() {
  local output
  output=$(mktemp)
  set -m
  (trap - EXIT; step "$@") >"$output" 2>&1 &
  set +m
  groups+=($!) outputs+=("$output")
}

wait_for_all() {
  local k failed=0
  for k in "${!groups[@]}"; do
    wait "${groups[k]}" || failed=1
    cat "${outputs[k]}"
    rm "${outputs[k]}"
    unset "groups[k]" "outputs[k]"
  done
  return $failed
}

# Ends what runs beside a step that failed, and shows how far it came.
end_all() {
  local k
  for k in "${!groups[@]}"; do
    kill -- "-${groups[k]}" 2>/dev/null || true
    cat "${outputs[k]}"
    rm "${outputs[k]}"
  done
}
trap end_all EXIT
