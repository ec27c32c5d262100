#!/bin/sh
# Runs every fuzz target for SECONDS (default 60), or only the TARGETs named; fails on a finding, which is
# left in build-fuzz/findings. CXX chooses the compiler (a clang).
# usage: tests/fuzz/run.sh [SECONDS [TARGET …]]
set -eu
root=$(cd "$(dirname "$0")/../.." && pwd)
build=$root/build-fuzz
seconds=${1:-60}
[ $# -gt 0 ] && shift
cmake -S "$root" -B "$build" -G Ninja -DCMAKE_CXX_COMPILER="${CXX:-clang++}" -DITS_FUZZ=ON -DITS_TESTS=OFF \
    -DITS_EXAMPLES=OFF -DITS_SANITIZE=address,undefined >"$build.log" 2>&1 || { cat "$build.log"; exit 1; }
ninja -C "$build" fuzz_targets
mkdir -p "$build/findings"
failed=0
for source in "$root"/tests/fuzz/fuzz_*.cpp; do
    name=$(basename "$source" .cpp)
    [ $# -gt 0 ] && case " $* " in *" $name "*) ;; *) continue ;; esac
    corpus=$build/corpus/$name
    mkdir -p "$corpus"
    echo "== $name"
    # A small input may cost no more than 10 s and 2 GB.
    "$build/tests/fuzz/$name" -max_total_time="$seconds" -max_len=8192 -timeout=10 -rss_limit_mb=2048 \
        -print_final_stats=1 -verbosity=0 -artifact_prefix="$build/findings/$name-" \
        "$corpus" "$root/tests/fuzz/seeds/${name#fuzz_}" || failed=1
done
exit $failed
