#!/usr/bin/env bash
# Runs every fuzz target for SECONDS (default 60), or only the TARGETs named; fails on a finding, which is
# left in build-fuzz/findings. CXX chooses the compiler (a clang).
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
failed=()
for name in "${targets[@]}"; do
    corpus=$build/corpus/$name log=$build/$name.log
    mkdir -p "$corpus"
    # A small input may cost no more than 10 s and 2 GB.
    $build/tests/fuzz/"$name" -max_total_time="$seconds" -max_len=8192 -timeout=10 -rss_limit_mb=2048 \
        -print_final_stats=1 -verbosity=0 -artifact_prefix="$build/findings/$name-" \
        "$corpus" "tests/fuzz/seeds/${name#fuzz_}" >"$log" 2>&1 || failed+=("$name")
    echo "$name: $(sed -n 's/^stat::number_of_executed_units: *//p' "$log") inputs in $seconds s"
    [[ " ${failed[*]:-} " != *" $name "* ]] || tail -n 60 "$log"
done
((${#failed[@]} == 0)) || { echo "fuzzing FAILED: ${failed[*]}"; exit 1; }
