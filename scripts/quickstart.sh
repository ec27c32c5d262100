#!/usr/bin/env bash
# From a fresh clone to a checked shell with pictures and a page: installs what is missing, builds the tool, makes a model
# (or takes yours) and its shell in out/.
#   scripts/quickstart.sh [MESH]      MESH: .obj .stl .ply .off .glb .gltf .3mf
# THICKNESS=LENGTH sets the shell's (default 1%, of the model's longest side: pictures show it).
set -euo pipefail
mesh=${1:+$(realpath -- "$1")}
cd "$(dirname "$0")/.."
thickness=${THICKNESS:-1%}

scripts/install.sh build
options=(-DCMAKE_BUILD_TYPE=Release)
[[ -f build/CMakeCache.txt ]] || options+=(-DITS_TESTS=OFF)  # a build folder in use keeps its options
echo "+ cmake and ninja, in build/"
cmake -S . -B build -G Ninja "${options[@]}" --log-level=NOTICE >/dev/null
targets=(its_cli)
[[ -n $mesh ]] || targets+=(example_make_model)
cmake --build build -j "$(nproc)" --target "${targets[@]}" | tail -n 1

mkdir -p out
if [[ -z $mesh ]]; then
    mesh=out/model.obj
    build/examples/make_model "$mesh"
fi
name=$(basename "${mesh%.*}")
shell=out/$name.its

step() {
    echo
    echo "+ its ${*:2}"
    "$@"
}
step build/its check "$mesh"
step build/its build "$mesh" -o "$shell" --thickness "$thickness"
step build/its info "$shell"
step build/its verify "$shell" "$mesh"
has() { build/its "$1" --help >/dev/null; }  # a program that was built without pictures or pages says so
made=()
if has slice; then
    step build/its slice "$shell" -o "out/$name.png" --cells
    step build/its render "$shell" -o "out/$name-render.png"
    made+=("A slice      out/$name.png          (f in colour, its zero, ε₁ and ε₂ as lines, the mesh in black)"
           "A picture    out/$name-render.png   (mesh, inner and outer surface, and all three cut open)")
fi
if has view; then
    step build/its view "$shell" -o "out/$name.html"
    made+=("A page       out/$name.html         (the same in three dimensions; open it in a browser)")
fi

echo
echo "The model    $mesh"
echo "Its shell    $shell"
printf '%s\n' "${made[@]}"
