#!/usr/bin/env bash
# Everything that must hold before a change is merged: build without warnings, tests, format, the Python package,
# Valgrind, clang-tidy, sanitizers, fuzzing, another architecture. ITS_TEST_MESHES names a folder of further meshes.
#   scripts/test.sh [--quick]      --quick: build, tests but those named Slow, format, the Python package, Valgrind
# Steps that lack what they need are skipped, and the summary says so; with ITS_NO_SKIP=1 they count as failed.
# Exit 0 when all passed, 1 otherwise, 2 when packages are missing. Goes on after a failure, except of the build, and
# ends with the time of each step, by the clock and of all processors.
set -uo pipefail
cd "$(dirname "$0")/.."
jobs=$(nproc)
scripts/install.sh test || exit 2

failed=()
times=()
# Hundredths of a second of all processors that commands so far took: of a busy machine, the clock tells little.
processor() { awk '{print $16 + $17}' "/proc/$$/stat"; }
step() {  # step NAME COMMAND...
    local name=$1 start=$SECONDS used result=passed
    used=$(processor)
    shift
    echo "== $name: $*"
    "$@" || { (($? == 77)) && [[ -z ${ITS_NO_SKIP:-} ]] && result=skipped; } || { failed+=("$name") && result=FAILED; }
    used=$((($(processor) - used) / 100))
    times+=("$(printf '%-12s %6d s, %6d s of processors  %s' "$name" $((SECONDS - start)) $used $result)")
    echo "== ${times[-1]}"
}
finish() {
    echo
    echo "== summary"
    [[ ! -f build/Testing/release.log ]] || sed -n '/tests passed/,$p' build/Testing/release.log
    printf '%s\n' "${times[@]}"
    if ((${#failed[@]})); then
        echo "FAILED: ${failed[*]}"
        exit 1
    fi
    echo "all passed"
    exit 0
}

configure_and_build() {
    cmake -S . -B build -G Ninja -DCMAKE_BUILD_TYPE=Release -DITS_WERROR=ON -DITS_TESTS=ON --log-level=NOTICE &&
        cmake --build build -j "$jobs"
}
run_tests() {  # run_tests OPTION OF CTEST...
    mkdir -p build/Testing
    ctest --test-dir build -j "$jobs" --output-on-failure --no-tests=error "$@" | tee build/Testing/release.log
}
check_format() { git ls-files -z -- '*.h' '*.cpp' | xargs -0 clang-format --dry-run -Werror; }

echo "ITS_TEST_MESHES=${ITS_TEST_MESHES:-(not set: generated meshes only)}"
rm -f build/Testing/release.log
step build configure_and_build
((${#failed[@]} == 0)) || finish
if [[ ${1:-} == --quick ]]; then step tests run_tests -E '[./]Slow'; else step tests run_tests; fi
step format check_format
step python scripts/test-python.sh
step valgrind env ITS_PROGRAM=build/its scripts/valgrind.sh
[[ ${1:-} != --quick ]] || finish
step tidy scripts/tidy.sh
step asan scripts/sanitize.sh asan
step tsan scripts/sanitize.sh tsan
step fuzz tests/fuzz/run.sh "${FUZZ_SECONDS:-60}"
step cross scripts/cross.sh
finish
