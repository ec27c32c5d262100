#!/usr/bin/env bash
# Builds the core for AArch64, runs its tests of geometry, octree, field, shell and query under an emulator, and compares
# shells with those of this machine's program, byte by byte. Libraries come from Debian's packages for arm64, unpacked
# into a folder of the build, not installed.
#   scripts/cross.sh [BUILD]      default: build-aarch64; ITS_PROGRAM: this machine's program (default: build/its)
# Exit 0 when all passed, 77, and one line, when the packages cannot be had, 1 otherwise.
set -euo pipefail
cd "$(dirname "$0")/.."
build=${1:-build-aarch64}
program=${ITS_PROGRAM:-build/its}
jobs=$(nproc)
machine=aarch64-linux-gnu
packages=(libtbb-dev libfmt-dev libxxhash-dev zlib1g-dev libboost-dev libeigen3-dev nlohmann-json3-dev libtinygltf-dev
          libcli11-dev libgtest-dev libgmock-dev libcgal-dev libgmp-dev libmpfr-dev)
tests=(geometry octree field shell query)

skip() {
    echo "cross.sh: skipped: $*"
    exit 77
}

command -v apt-get dpkg >/dev/null || skip "no Debian"
{ command -v $machine-g++ && command -v qemu-aarch64; } >/dev/null || scripts/install.sh cross >/dev/null 2>&1 ||
    skip "no g++-$machine or qemu-user, and no right to install them"

# apt works on folders of its own, for another architecture than the machine's, and as anyone.
mkdir -p "$build"
root=$(realpath "$build")/sysroot
apt=$(realpath "$build")/apt
run_apt() {
    apt-get -qq -o APT::Architecture=arm64 -o APT::Architectures::=arm64 -o Debug::NoLocking=1 -o Dir::State="$apt" \
        -o Dir::State::status="$apt/status" -o Dir::Cache="$apt" -o APT::Sandbox::User="$(id -un)" "$@"
}
fetch() {
    rm -rf "$root" "$apt"
    mkdir -p "$root" "$apt/lists/partial" "$apt/archives/partial"
    : >"$apt/status"
    run_apt update && run_apt install -y --no-install-recommends --download-only "${packages[@]}" || return 1
    local package
    for package in "$apt"/archives/*.deb; do
        case ${package##*/} in
            libc6* | linux-libc-dev* | libstdc++* | libgcc* | gcc-*) ;;  # the compiler has its own
            *) dpkg -x "$package" "$root" ;;
        esac
    done
    rm -rf "$apt"
    touch "$root/complete"
}
[[ -f $root/complete ]] || fetch >"$build/fetch.log" 2>&1 ||
    skip "the packages for arm64 cannot be fetched; see $build/fetch.log"

cat >"$build/toolchain.cmake" <<EOF
set(CMAKE_SYSTEM_NAME Linux)
set(CMAKE_SYSTEM_PROCESSOR aarch64)
set(CMAKE_C_COMPILER $machine-gcc)
set(CMAKE_CXX_COMPILER $machine-g++)
set(CMAKE_FIND_ROOT_PATH $root)
set(CMAKE_PREFIX_PATH /usr)
set(CMAKE_LIBRARY_ARCHITECTURE $machine)
set(CMAKE_FIND_ROOT_PATH_MODE_PROGRAM NEVER)
set(CMAKE_FIND_ROOT_PATH_MODE_LIBRARY ONLY)
set(CMAKE_FIND_ROOT_PATH_MODE_INCLUDE ONLY)
set(CMAKE_FIND_ROOT_PATH_MODE_PACKAGE ONLY)
set(CMAKE_CXX_FLAGS_INIT "-Wno-psabi -DITS_EMULATED")  # notes about an old ABI; see tests/support/tries.h
set(CMAKE_EXE_LINKER_FLAGS_INIT "-Wl,-rpath-link,$root/usr/lib/$machine -Wl,-rpath,$root/usr/lib/$machine")
set(CMAKE_CROSSCOMPILING_EMULATOR qemu-aarch64;-L;/usr/$machine)
EOF
export PKG_CONFIG_LIBDIR=$root/usr/lib/$machine/pkgconfig:$root/usr/share/pkgconfig PKG_CONFIG_SYSROOT_DIR=$root
cmake -S . -B "$build" -G Ninja -DCMAKE_BUILD_TYPE=Release \
    -DCMAKE_TOOLCHAIN_FILE="$(realpath "$build")/toolchain.cmake" -DITS_WERROR=ON -DITS_PICTURE=OFF -DITS_PAGE=OFF -DITS_VDB=OFF -DITS_EXAMPLES=OFF -DITS_TESTS=ON --log-level=NOTICE
cmake --build "$build" -j "$jobs" --target its_cli "${tests[@]/#/test_}"

# Bumpy spheres: closed, with a hole, and with a flap that makes edges of three triangles.
wavy() {  # wavy KIND
    awk -v kind="$1" 'BEGIN {
        n = 40; m = 20; pi = atan2(0, -1)
        for (j = 0; j <= m; ++j) for (i = 0; i < n; ++i) {
            u = 2 * pi * i / n; v = pi * j / m; r = 3 + 0.4 * sin(5 * u) * sin(4 * v)
            printf "v %.9f %.9f %.9f\n", r * sin(v) * cos(u), 0.7 * r * sin(v) * sin(u), 1.3 * r * cos(v)
        }
        print "v 5.1 0.3 0.2"
        for (j = 0; j < m; ++j) for (i = 0; i < n; ++i) {
            if (kind == "open" && j > 7 && j < 11 && i > 3 && i < 17) continue
            a = j * n + i + 1; b = j * n + (i + 1) % n + 1
            print "f", a, a + n, b; print "f", b, a + n, b + n
        }
        if (kind == "flap") print "f", 400, 401, (m + 1) * n + 1
    }' >"$build/wavy_$1.obj"
}
for kind in closed open flap; do wavy $kind; done

failed=0
emulate=(qemu-aarch64 -L "/usr/$machine")
# Left out: what takes minutes here, or looks at memory, which is the emulator's.
left_out='*Slow*:*RealMeshes*:*OnClosedMeshes:ExtremeSizes.*:Memory.*:*Estimate*'
run_test() {  # run_test NAME, its output to a log
    "${emulate[@]}" "$build/tests/test_$1" --gtest_brief=1 --gtest_filter="-$left_out" \
        >"$build/$1.log" 2>&1 || { cat "$build/$1.log"; touch "$build/failed"; }
    echo "$1: $(tail -n 1 "$build/$1.log")"
}
rm -f "$build/failed"
for name in "${tests[@]}"; do
    while (($(jobs -rp | wc -l) >= jobs)); do wait -n || true; done
    run_test "$name" &
done
wait
[[ ! -e $build/failed ]] || failed=1

# Closed, open and unsigned; at 1,000 times and a thousandth of the size, far away; needles, and what all branches meet.
same() {  # same MESH OPTION...
    rm -f "$build"/here.its "$build"/there.its
    "$program" build "$@" -o "$build/here.its" --quiet &&
        "${emulate[@]}" "$build/its" build "$@" -o "$build/there.its" --quiet &&
        cmp "$build/here.its" "$build/there.its" && echo "same bytes: its build $*" || failed=1
}
if [[ -x $program ]]; then
    echo "== bytes"
    for mesh in "$build"/wavy*.obj; do
        same "$mesh" --depth 6
        same "$mesh" --thickness 0.5%
    done
    same "$build/wavy_closed.obj" --depth 7 --extrema candidates
    same "$build/wavy_closed.obj" --depth 5 --solver lscg
    same "$build/wavy_open.obj" --depth 6 --sign unsigned
    shopt -s nullglob
    for mesh in tests/data/*.{obj,off,stl,ply}; do
        if "$program" check "$mesh" --quiet >/dev/null 2>&1; then same "$mesh" --depth 5; fi
    done
else
    echo "cross.sh: no $program to compare with; build it first"
    failed=1
fi
exit $failed
