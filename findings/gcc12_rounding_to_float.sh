#!/usr/bin/env bash
# GCC 12.2.0 (Debian's 12.2.0-14+deb12u1), x86-64. double(float(x)) rounds x to single precision: the language says so,
# and no option of -ffast-math is given.
# One would guess: so it does at every level of optimisation.
# What happens: at -O2 two neighbours that are rounded side by side keep all their bits; the third is rounded. At -O1, or
# with -fno-tree-slp-vectorize, all three are. Hence our src/base/single.h.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
version=12.2.0-14+deb12u1
apt-get -qq download g++-12=$version gcc-12=$version cpp-12=$version libgcc-12-dev=$version libstdc++-12-dev=$version
for package in *.deb; do dpkg -x "$package" gcc; done
cat >round.cpp <<'CPP'
extern "C" int printf(const char*, ...);
struct Point { double x, y, z; };
__attribute__((noinline)) void round_all(Point* points, int count) {
    for (int i = 0; i < count; ++i) {
        Point& p = points[i];
        p = {double(float(p.x)), double(float(p.y)), double(float(p.z))};
    }
}
int main() {
    Point p{0.1, 0.1, 0.1};
    round_all(&p, 1);
    printf("%.17g %.17g %.17g\n", p.x, p.y, p.z);
}
CPP
for options in -O1 -O2 "-O2 -fno-tree-slp-vectorize"; do
    # shellcheck disable=SC2086
    gcc/usr/bin/x86_64-linux-gnu-g++-12 $options round.cpp -o round
    echo "$options: $(./round)"
done | tee output
diff output - <<'EXPECTED'
-O1: 0.10000000149011612 0.10000000149011612 0.10000000149011612
-O2: 0.10000000000000001 0.10000000000000001 0.10000000149011612
-O2 -fno-tree-slp-vectorize: 0.10000000149011612 0.10000000149011612 0.10000000149011612
EXPECTED
