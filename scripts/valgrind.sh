#!/usr/bin/env bash
# Runs the program under Valgrind's memcheck on small meshes: reading each format, a build, info, check, verify and a
# picture. Fails on any error or leak of ours. Uses build-valgrind (-O1), or the program named by ITS_PROGRAM.
#   scripts/valgrind.sh
set -euo pipefail
cd "$(dirname "$0")/.."
its=${ITS_PROGRAM:-}
if [[ -z $its ]]; then
    echo "+ cmake and ninja, in build-valgrind/"
    # No -march flags anywhere, so Valgrind knows all instructions; -g1 names lines.
    cmake -S . -B build-valgrind -G Ninja -DCMAKE_BUILD_TYPE=None -DCMAKE_CXX_FLAGS="-O1 -g1" -DITS_TESTS=OFF \
        -DITS_EXAMPLES=OFF --log-level=NOTICE >/dev/null
    cmake --build build-valgrind -j "$(nproc)" --target its_cli | tail -n 1
    its=build-valgrind/its
fi

work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
check() {  # check ARGUMENT...: runs `its` with them; 99 is Valgrind's finding
    local status=0
    echo "+ its $*"
    valgrind --quiet --error-exitcode=99 --leak-check=full --errors-for-leak-kinds=definite,indirect \
        --suppressions=scripts/valgrind.supp "$its" "$@" >"$work/out" 2>"$work/err" || status=$?
    if ((status != 0)); then
        cat "$work/out" "$work/err"
        echo "valgrind.sh: error: exit status $status" >&2
        exit 1
    fi
}

for seed in tests/fuzz/seeds/{obj,stl,ply,off,gltf,3mf}/*.{obj,stl,ply,off,glb,gltf,3mf}; do
    [[ -f $seed && $(basename "$seed") != bad_* ]] && check check "$seed"
done
mesh=tests/fuzz/seeds/gltf/tetrahedron.glb
for sign in winding unsigned; do
    check build tests/fuzz/seeds/obj/tetrahedron.obj -o "$work/a.its" --depth 4 --sign "$sign" --threads 2
    check info "$work/a.its"
    check verify "$work/a.its" tests/fuzz/seeds/obj/tetrahedron.obj --samples 200
done
check build "$mesh" -o "$work/b.its" --depth 3 --extrema candidates --solver lscg
check slice "$work/b.its" -o "$work/b.png" --size 64
echo "valgrind: clean"
