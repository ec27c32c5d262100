#!/usr/bin/env bash
# Checks format (clang-format) and code (clang-tidy, see .clang-tidy) of everything; exit 1 on any finding.
#   scripts/tidy.sh [--fix]      --fix: reformats instead of complaining about the format
#
# clang-tidy runs as part of a build of its own, build-tidy: Ninja then knows which files a change touches,
# and a second run checks only those. Tests are formatted but not checked: GoogleTest's and CGAL's headers alone
# would take longer than everything else together.
set -euo pipefail
cd "$(dirname "$0")/.."

mapfile -t files < <(git ls-files --cached --others --exclude-standard -- '*.h' '*.cpp')
if [[ ${1:-} == --fix ]]; then
    clang-format -i "${files[@]}"
else
    echo "+ clang-format --dry-run -Werror (${#files[@]} files)"
    clang-format --dry-run -Werror "${files[@]}"
fi

# The hash makes Ninja start over when the checks themselves change.
checks=$(sha256sum .clang-tidy | cut -c1-16)
tidy="clang-tidy;--quiet;--warnings-as-errors=*;--extra-arg=-DITS_TIDY_CHECKS_$checks"
echo "+ clang-tidy, in build-tidy"
# Without precompiled headers: clang-tidy cannot read those of GCC.
cmake -S . -B build-tidy -G Ninja -DCMAKE_BUILD_TYPE=Release -DITS_WERROR=ON -DITS_TESTS=OFF -DITS_PCH=OFF \
    -DCMAKE_CXX_CLANG_TIDY="$tidy" --log-level=NOTICE
cmake --build build-tidy -j "$(nproc)" -- -k 0  # all findings, not the first
