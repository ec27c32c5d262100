#!/usr/bin/env bash
# Runs every fuzz target for SECONDS of processor time (default 60), or only the TARGETs named; fails on a finding,
# which is left in build-asan/findings. JOBS targets run at a time (default: one for each processor). CXX chooses the
# compiler (a clang).
#   tests/fuzz/run.sh [SECONDS [TARGET...]]
set -euo pipefail
cd "$(dirname "$0")/../.."
seconds=${1:-60}
(($#)) && shift
targets=("$@")
if ((${#targets[@]} == 0)); then
    for source in tests/fuzz/fuzz_*.cpp; do targets+=("$(basename "$source" .cpp)"); done
fi

# The folder and options of scripts/sanitize.sh, for one library.
build=build-asan jobs=${JOBS:-$(nproc)}
cmake -S . -B $build -G Ninja -DCMAKE_CXX_COMPILER="${CXX:-clang++}" -DCMAKE_BUILD_TYPE=None -DCMAKE_CXX_FLAGS=-O2 \
    -DITS_WERROR=ON -DITS_TESTS=ON -DITS_EXAMPLES=OFF -DITS_SANITIZE=address,undefined -DITS_FUZZ=ON \
    --log-level=NOTICE >/dev/null
cmake --build $build -j "$jobs" --target "${targets[@]}" | tail -n 1
mkdir -p $build/findings

# fuzz NAME SECONDS, its log to standard output. A small input may cost no more than 10 s and 2 GB. Shells with cells of
# several sizes take more than 8 kB.
fuzz() {
    local longest=8192
    [[ $1 != fuzz_shell_* ]] || longest=16384
    $build/tests/fuzz/"$1" -max_total_time="$2" -max_len=$longest -timeout=10 -rss_limit_mb=2048 \
        -print_final_stats=1 -verbosity=0 -artifact_prefix="$build/findings/$1-" \
        "$build/corpus/$1" "tests/fuzz/seeds/${1#fuzz_}" 2>&1
}

# run NAME: for `seconds`. The fuzzer counts the clock's, of which a busy machine leaves it only some.
run() {
    local log=$build/$1.log left=$seconds used status=0
    mkdir -p "$build/corpus/$1"
    : >"$log"
    while ((left > 0)); do
        used=$({ time fuzz "$1" "$left" >>"$log"; } 2>&1) || { status=1; break; }
        left=$((left - (${used%.*} > 0 ? ${used%.*} : 1)))
    done
    echo "$1: $(awk '/^stat::number_of_executed_units/ {sum += $2} END {print sum + 0}' "$log") inputs in $((seconds - left)) s"
    ((status == 0)) || { tail -n 60 "$log"; echo "$1 FAILED"; }
    return "$status"
}

TIMEFORMAT=%U
rm -f "$build/failed"
for name in "${targets[@]}"; do
    while (($(jobs -rp | wc -l) >= jobs)); do wait -n || true; done
    { run "$name" || touch "$build/failed"; } &
done
wait
[[ ! -e $build/failed ]]
