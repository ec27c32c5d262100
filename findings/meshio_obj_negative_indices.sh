#!/usr/bin/env bash
# meshio 5.3.5, numpy 2.4.6. In OBJ, -1 is the last vertex so far, -4 the fourth from the end.
# One would guess: negative indices are resolved, or refused.
# What happens: 1 is subtracted from them as from positive ones. With four vertices, -4 becomes -5, which no array of
# four has, and -1 becomes -2, which numpy takes for the last vertex but one: no error, other triangles.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" -q install meshio==5.3.5 numpy==2.4.6
printf '%s\n' 'v 0 0 0' 'v 1 0 0' 'v 0 2 0' 'v 0 0 3' 'f 1 3 2' 'f -3 -2 -1' 'f -4 -2 -3' >"$folder/negative.obj"
output=$("$folder/venv/bin/python" -c 'import sys, meshio; print(meshio.read(sys.argv[1]).cells[0].data.tolist())' \
    "$folder/negative.obj")
echo "$output"  # [[0, 2, 1], [1, 2, 3], [0, 2, 1]] would be right
diff <(echo "$output") - <<'EXPECTED'
[[0, 2, 1], [-4, -3, -2], [-5, -3, -4]]
EXPECTED
