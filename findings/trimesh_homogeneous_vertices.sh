#!/usr/bin/env bash
# trimesh 5.2.0, numpy 2.4.6. "v x y z w" of OBJ and the vertices of 4OFF are homogeneous: the point is (x, y, z) / w.
# One would guess: they are divided by w, or refused where w is not 1.
# What happens: w is ignored without a word. Both files below are the tetrahedron (0,0,0) (1,0,0) (0,2,0) (0,0,3),
# of volume 1; they are read as one of volume 4.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" -q install trimesh==5.2.0 numpy==2.4.6
printf '%s\n' 'v 0 0 0 1' 'v 2 0 0 2' 'v 0 4 0 2' 'v 0 0 3 1' 'f 1 3 2' 'f 1 2 4' 'f 1 4 3' 'f 2 3 4' >"$folder/w.obj"
printf '%s\n' 4OFF '4 4 6' '0 0 0 1' '2 0 0 2' '0 4 0 2' '0 0 3 1' '3 0 2 1' '3 0 1 3' '3 0 3 2' '3 1 2 3' \
    >"$folder/w.off"
output=$(for file in w.obj w.off; do
    "$folder/venv/bin/python" -c 'import sys, trimesh; print("volume", round(trimesh.load(sys.argv[1]).volume, 9))' \
        "$folder/$file"
done)
echo "$output"
diff <(echo "$output") - <<'EXPECTED'
volume 4.0
volume 4.0
EXPECTED
