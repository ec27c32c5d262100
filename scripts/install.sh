#!/usr/bin/env bash
# Installs the Debian 12 packages that are missing; does nothing when all are there.
#   scripts/install.sh [build|test|bench|cross]...      default: build; cross: for scripts/cross.sh
# Exit 0: all there now. Exit 2: something is missing and could not be installed.
set -euo pipefail

build=(g++ cmake ninja-build ccache libeigen3-dev libtbb-dev libfmt-dev libpng-dev libxxhash-dev
       libcli11-dev nlohmann-json3-dev zlib1g-dev libdraco-dev libmeshoptimizer-dev libboost-dev pkgconf dpkg-dev libfreetype-dev
       fonts-roboto-unhinted libembree-dev)
test=(libgtest-dev libgmock-dev libcgal-dev libassimp-dev libgmp-dev libmpfr-dev libopenvdb-dev libboost-iostreams-dev
      libimath-dev chromium clang clang-format clang-tidy libclang-rt-14-dev valgrind python3-venv python3-dev)
bench=(libbenchmark-dev libopenvdb-dev libboost-iostreams-dev libembree-dev libcgal-dev libimath-dev)
cross=(g++-aarch64-linux-gnu qemu-user)
command -v npm >/dev/null || build+=(nodejs npm)  # for the page of its view; another npm serves as well

fail() {
    echo "install.sh: error: $*" >&2
    exit 2
}

wanted=("${build[@]}")  # every group builds the library
for group in "${@:-build}"; do
    case $group in
        build) ;;
        test) wanted+=("${test[@]}") ;;
        bench) wanted+=("${bench[@]}") ;;
        cross) wanted+=("${cross[@]}") ;;
        *) fail "unknown group '$group'; choose among build, test, bench and cross" ;;
    esac
done

command -v dpkg-query >/dev/null ||
    fail "this is no Debian; install the equivalents of these packages yourself: ${wanted[*]}"

# dpkg-query complains about packages it never heard of: those are missing as well.
present=$(dpkg-query -W -f '${db:Status-Status} ${Package}\n' "${wanted[@]}" 2>/dev/null || true)
missing=()
for package in "${wanted[@]}"; do
    grep -qx "installed $package" <<<"$present" || missing+=("$package")
done
if ((${#missing[@]} == 0)); then
    exit 0
fi

if [[ $(id -u) == 0 ]]; then
    as_root=()
elif command -v sudo >/dev/null && sudo -n true 2>/dev/null; then
    as_root=(sudo)
elif command -v sudo >/dev/null && [[ -t 0 ]]; then
    as_root=(sudo)  # asks for the password
else
    fail "missing packages, and no right to install them; run as root: apt-get install ${missing[*]}"
fi

echo "install.sh: installing ${missing[*]}"
export DEBIAN_FRONTEND=noninteractive
run_apt() { "${as_root[@]}" env DEBIAN_FRONTEND=noninteractive apt-get -qq -o Dpkg::Use-Pty=0 "$@"; }
run_apt update || fail "apt-get update failed; see above"
run_apt install -y --no-install-recommends "${missing[@]}" >/dev/null ||
    fail "apt-get install failed; see above"
echo "install.sh: done"
