# Sourced by builds for Linux: puts zig, which links against old C libraries, and cargo-zigbuild into PATH.
zig_tools=${CARGO_TARGET_DIR:-target}/dist/zig
if ! cmp -s ci/requirements-zig.txt "$zig_tools/installed.txt"; then
  rm -rf "$zig_tools"
  "${PYTHON:-python3}" -m venv "$zig_tools"
  "$zig_tools/bin/pip" install --quiet -r ci/requirements-zig.txt
  cp ci/requirements-zig.txt "$zig_tools/installed.txt"
fi
# Others look for a program of this name.
printf '#!/bin/sh\nexec "%s" -m ziglang "$@"\n' "$(realpath "$zig_tools")/bin/python" >"$zig_tools/bin/zig"
chmod +x "$zig_tools/bin/zig"
PATH=$(realpath "$zig_tools")/bin:$PATH
export PATH
