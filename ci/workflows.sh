#!/usr/bin/env bash
# Lints the workflows, the issue forms, dependabot.yml, CITATION.cff and the bill of materials: actionlint
# (with shellcheck, if it is installed), zizmor, the schemas of check-jsonschema. Needs Python, npm and the
# network.
set -euo pipefail
cd "$(dirname "$0")/.."
export PIP_DISABLE_PIP_VERSION_CHECK=1
work=$(realpath -m "${CARGO_TARGET_DIR:-target}")/workflows

mkdir -p "$work"
if ! cmp -s ci/requirements-workflows.txt "$work/installed.txt"; then
  rm -rf "$work/tools"
  "${PYTHON:-python3}" -m venv "$work/tools"
  "$work/tools/bin/pip" install --quiet -r ci/requirements-workflows.txt
  cp ci/requirements-workflows.txt "$work/installed.txt"
fi
tools=$work/tools/bin
# actionlint looks for shellcheck there.
PATH=$tools:$PATH

actionlint .github/workflows/*.yml
zizmor --quiet --offline --persona pedantic .github/workflows
schema() {
  check-jsonschema --builtin-schema "vendor.$1" "${@:2}" >"$work/schema.txt" ||
    { cat "$work/schema.txt" >&2; exit 1; }
}
schema github-workflows .github/workflows/*.yml
schema github-issue-forms .github/ISSUE_TEMPLATE/bug.yml .github/ISSUE_TEMPLATE/idea.yml
schema github-issue-config .github/ISSUE_TEMPLATE/config.yml
schema dependabot .github/dependabot.yml
schema citation-file-format CITATION.cff
"${PYTHON:-python3}" ci/licenses.py --sbom "$work/rtfmesh.cdx.json"
"$tools/python" - "$work/rtfmesh.cdx.json" <<'END'
import pathlib
import sys

from cyclonedx.schema import SchemaVersion
from cyclonedx.validation.json import JsonStrictValidator

problem = JsonStrictValidator(SchemaVersion.V1_5).validate_str(pathlib.Path(sys.argv[1]).read_text())
if problem:
    sys.exit(f"workflows: the bill of materials is not valid: {problem}")
END
