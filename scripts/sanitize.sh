#!/usr/bin/env bash
# Builds and runs the tests under sanitizers: address + undefined behaviour in build-asan, threads in build-tsan. The
# compiler is clang (or CXX), so that both compilers build everything; fuzz targets (tests/fuzz/run.sh) share build-asan.
#   scripts/sanitize.sh [asan|tsan]...      default: both
#
# Left out, and counted in what is printed: tests whose suite or own name begins with Slow; because ITS_TEST_MESHES is
# unset, what tests do with the meshes of that folder; the programs in `aside`, below, which look at threads and symbols.
# Instrumented code is 3 to 15 times slower, and those repeat the same code paths on more data;
# scripts/test.sh runs them without sanitizers.
# Under tsan run the tests named after `racing`, below: every parallel call has one that compares numbers of threads,
# reports progress from several, or is stopped midway; what else there is takes the same loops. None of OpenVDB, which
# runs threads of its own, on a TBB that the sanitizer cannot see into.
set -uo pipefail
cd "$(dirname "$0")/.."
jobs=${JOBS:-$(nproc)}
unset ITS_TEST_MESHES
aside=" cgal fuzz structure support threads "  # folders of tests
racing='Thread|Progress|Stop|Cancel|AtOnce'
serial=" cli formats geometry mesh octree vdb winding "  # have none of those

export ASAN_OPTIONS=detect_stack_use_after_return=1:strict_string_checks=1
export UBSAN_OPTIONS=print_stacktrace=1
# No suppressions: under -fsanitize=thread our parallel loops run on plain threads, see src/base/parallel.h.
export TSAN_OPTIONS=second_deadlock_stack=1

run() {
    echo "+ $*"
    "$@"
}

check() {  # check FOLDER SANITIZERS OPTION...
    local folder=$1 sanitizers=$2 left_out targets=() suites=() name
    for name in tests/*/*.cpp; do
        name=${name#tests/} && name=${name%%/*}
        [[ "$aside ${suites[*]:-} " == *" $name "* ]] && continue
        [[ $sanitizers == thread && $serial == *" $name "* ]] && continue
        suites+=("$name") targets+=("test_$name")
    done
    echo "== sanitizers $sanitizers: ${suites[*]}"
    # -O2 with assertions: tests run 2.6 times as fast as at -O1, where clang inlines next to nothing.
    run cmake -S . -B "$folder" -G Ninja -DCMAKE_CXX_COMPILER="${CXX:-clang++}" -DCMAKE_BUILD_TYPE=None \
        -DCMAKE_CXX_FLAGS=-O2 -DITS_WERROR=ON -DITS_TESTS=ON -DITS_EXAMPLES=OFF -DITS_SANITIZE="$sanitizers" \
        "${@:3}" --log-level=NOTICE || return 1
    run cmake --build "$folder" -j "$jobs" --target "${targets[@]}" || return 1
    local these="^($(IFS='|'; echo "${suites[*]}"))[.]"
    left_out=$(ctest --test-dir "$folder" -N -R '[./]Slow' | sed -n 's/^ *Test *#[0-9]*: /    /p' | grep -v NOT_BUILT)
    echo "left out: ITS_TEST_MESHES, $(grep -c . <<<"$left_out") tests named Slow${left_out:+:}"
    [[ -z $left_out ]] || echo "$left_out"
    [[ $sanitizers != thread ]] || these+=".*($racing)"
    run ctest --test-dir "$folder" -j "$jobs" --output-on-failure -R "$these" -E '[./]Slow' --no-tests=error
}

(($#)) || set -- asan tsan
status=0
for which in "$@"; do
    case $which in
        asan) check build-asan address,undefined -DITS_FUZZ=ON || status=1 ;;
        tsan) check build-tsan thread || status=1 ;;
        *) echo "sanitize.sh: error: unknown '$which'; choose asan or tsan" >&2; exit 2 ;;
    esac
done
exit $status
