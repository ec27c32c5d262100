#!/usr/bin/env bash
# fcpw 1.2.0, numpy 2.4.6. scene_3D.contains(points, result) takes numpy arrays, points (n, 3) of float32 and result
# (n) of int32, both in the signature that its help shows.
# One would guess: result has a 1 for each point that is inside.
# What happens: no error, and result stays as it was; with fcpw's own lists the same call gives the right answers.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" -q install fcpw==1.2.0 numpy==2.4.6
cat >"$folder/inside.py" <<'PYTHON'
import fcpw
import numpy as np
corners = [[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)]
faces = [[0, 1, 3], [0, 3, 2], [4, 6, 7], [4, 7, 5], [0, 4, 5], [0, 5, 1],
         [2, 3, 7], [2, 7, 6], [0, 2, 6], [0, 6, 4], [1, 5, 7], [1, 7, 3]]
scene = fcpw.scene_3D()
scene.set_object_count(1)
scene.set_object_vertices(np.asfortranarray(corners, np.float32), 0)
scene.set_object_triangles(np.asfortranarray(faces, np.int32), 0)
scene.build(fcpw.aggregate_type.bvh_surface_area, True)
points = np.asfortranarray([[0.4, 0.5, 0.6], [2, 2, 2]], np.float32)
result = np.array([7, 7], np.int32)
scene.contains(points, result)
print("arrays:", result.tolist())
of_list = fcpw.uint32_list()
scene.contains(fcpw.float_3D_list(list(np.ascontiguousarray(points))), of_list)
print("lists:", [int(x) for x in of_list])
PYTHON
output=$("$folder/venv/bin/python" "$folder/inside.py" | grep -E "^(arrays|lists):")
echo "$output"
diff <(echo "$output") - <<'EXPECTED'
arrays: [7, 7]
lists: [1, 0]
EXPECTED
