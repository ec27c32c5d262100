#!/usr/bin/env bash
# Everything that must hold before a change is merged: build without warnings, tests, format, clang-tidy,
# sanitizers. ITS_TEST_MESHES names a folder of further meshes for the tests.
#   scripts/test.sh [--quick]      --quick: build, tests and format only
# Exit 0 when all passed, 1 otherwise, 2 when packages are missing. Goes on after a failure, except of the build.
set -uo pipefail
cd "$(dirname "$0")/.."
jobs=$(nproc)
scripts/install.sh test || exit 2

failed=()
step() {  # step NAME COMMAND...
    local name=$1 start=$SECONDS
    shift
    echo "== $name: $*"
    "$@" || failed+=("$name")
    echo "== $name: $((SECONDS - start)) s"
}

configure_and_build() {
    cmake -S . -B build -G Ninja -DCMAKE_BUILD_TYPE=Release -DITS_WERROR=ON -DITS_TESTS=ON --log-level=NOTICE &&
        cmake --build build -j "$jobs"
}

echo "ITS_TEST_MESHES=${ITS_TEST_MESHES:-(not set: generated meshes only)}"
step build configure_and_build
((${#failed[@]} == 0)) || exit 1
mkdir -p build/Testing
run_tests() {
    ctest --test-dir build -j "$jobs" --output-on-failure --no-tests=error | tee build/Testing/release.log
}
step tests run_tests
if [[ ${1:-} == --quick ]]; then
    check_format() { git ls-files -z -- '*.h' '*.cpp' | xargs -0 clang-format --dry-run -Werror; }
    step format check_format
else
    step tidy scripts/tidy.sh
    step sanitizers scripts/sanitize.sh
fi

echo "== summary of the tests without sanitizers:"
sed -n '/tests passed/,$p' build/Testing/release.log
if ((${#failed[@]})); then
    echo "FAILED: ${failed[*]}"
    exit 1
fi
echo "all passed"
