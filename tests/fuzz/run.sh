#!/usr/bin/env bash
# Runs every fuzz target for SECONDS of processor time (default 60), or only the TARGETs named; fails on a finding,
# which is left in build-fuzz/findings. CXX chooses the compiler (a clang).
#   tests/fuzz/run.sh [SECONDS [TARGET...]]
set -euo pipefail
cd "$(dirname "$0")/../.."
seconds=${1:-60}
(($#)) && shift
targets=("$@")
if ((${#targets[@]} == 0)); then
    for source in tests/fuzz/fuzz_*.cpp; do targets+=("$(basename "$source" .cpp)"); done
fi

build=build-fuzz
cmake -S . -B $build -G Ninja -DCMAKE_CXX_COMPILER="${CXX:-clang++}" -DCMAKE_BUILD_TYPE=None -DCMAKE_CXX_FLAGS=-O1 \
    -DITS_FUZZ=ON -DITS_TESTS=OFF -DITS_EXAMPLES=OFF -DITS_SANITIZE=address,undefined --log-level=NOTICE >/dev/null
cmake --build $build -j "${JOBS:-$(nproc)}" --target "${targets[@]}" | tail -n 1
mkdir -p $build/findings

# fuzz NAME SECONDS, its log to standard output. A small input may cost no more than 10 s and 2 GB.
fuzz() {
    $build/tests/fuzz/"$1" -max_total_time="$2" -max_len=8192 -timeout=10 -rss_limit_mb=2048 \
        -print_final_stats=1 -verbosity=0 -artifact_prefix="$build/findings/$1-" \
        "$build/corpus/$1" "tests/fuzz/seeds/${1#fuzz_}" 2>&1
}

# The fuzzer counts the clock's seconds, of which a busy machine leaves it only some.
failed=()
TIMEFORMAT=%U
for name in "${targets[@]}"; do
    mkdir -p "$build/corpus/$name"
    log=$build/$name.log left=$seconds
    : >"$log"
    while ((left > 0)); do
        used=$({ time fuzz "$name" "$left" >>"$log"; } 2>&1) || { failed+=("$name"); break; }
        left=$((left - (${used%.*} > 0 ? ${used%.*} : 1)))
    done
    inputs=$(awk '/^stat::number_of_executed_units/ {sum += $2} END {print sum + 0}' "$log")
    echo "$name: $inputs inputs in $((seconds - left)) s"
    [[ " ${failed[*]:-} " != *" $name "* ]] || tail -n 60 "$log"
done
((${#failed[@]} == 0)) || { echo "fuzzing FAILED: ${failed[*]}"; exit 1; }
