#!/usr/bin/env bash
# trimesh 5.2.0, numpy 2.4.6. An OFF file may have comments anywhere (Geomview's manual: "#" to the end of the line).
# One would guess: a comment between two vertices is skipped, as one before the counts is.
# What happens: no error and no warning, but another mesh: the line of the counts is read as a vertex, (4, 4, 6), and
# of four faces one is left.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" -q install trimesh==5.2.0 numpy==2.4.6
printf '%s\n' OFF '4 4 6' '0 0 0' '1 0 0' '# the third' '0 2 0' '0 0 3' \
    '3 0 2 1' '3 0 1 3' '3 0 3 2' '3 1 2 3' >"$folder/comment.off"
grep -v '#' "$folder/comment.off" >"$folder/plain.off"
cat >"$folder/read.py" <<'PYTHON'
import sys
import trimesh
for name in sys.argv[1:]:
    mesh = trimesh.load(name, process=False)
    print(len(mesh.faces), "faces,", mesh.vertices.tolist())
PYTHON
output=$("$folder/venv/bin/python" "$folder/read.py" "$folder/plain.off" "$folder/comment.off")
echo "$output"
diff <(echo "$output") - <<'EXPECTED'
4 faces, [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 2.0, 0.0], [0.0, 0.0, 3.0]]
1 faces, [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [4.0, 4.0, 6.0], [0.0, 0.0, 0.0]]
EXPECTED
