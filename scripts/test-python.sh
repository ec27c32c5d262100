#!/usr/bin/env bash
# The Python package: installs it in a virtual environment of build-python/ by pip, as users do, then formatting, types
# and tests.
#   scripts/test-python.sh [PYTEST ARGUMENTS]
# Exit 77, and one line, where there is no venv or packages cannot be fetched; 1 when something fails.
set -euo pipefail
cd "$(dirname "$0")/.."
venv=$PWD/build-python/venv
python=$venv/bin/python

skip() {
    echo "test-python.sh: skipped: $*"
    exit 77
}
[[ -x $python ]] || python3 -m venv "$venv" || skip "python3 -m venv does not work here (Debian: python3-venv)"
requirements=python/tests/requirements.txt
if ! cmp -s "$requirements" "$venv/installed.txt"; then
    "$python" -m pip install --quiet --disable-pip-version-check --retries 1 -r "$requirements" ||
        skip "pip could not fetch what the tests need"
    cp "$requirements" "$venv/installed.txt"
fi

# The same flags as scripts/test.sh: ccache has compiled the library already.
"$python" -m pip install --quiet --disable-pip-version-check --no-build-isolation --no-deps --force-reinstall \
    -C cmake.define.ITS_WERROR=ON .
"$venv/bin/ruff" format --check python bench/python_peers.py bench/batch_overhead.py
"$venv/bin/ruff" check python bench/python_peers.py bench/batch_overhead.py
"$venv/bin/mypy" -p its --python-executable "$python"
"$venv/bin/mypy" python/tests --python-executable "$python"
PYTHONDONTWRITEBYTECODE=1 "$python" -m pytest "$@"
