#!/usr/bin/env bash
# trimesh 5.2.0, numpy 2.4.6. Colours in 8 bits of PLY are sRGB, as all programs show them; COLOR_0 of glTF is linear
# (glTF 2.0, 3.9.2), so that sRGB 128, of 21.6 % of the light, is 55 in 8 linear bits.
# One would guess: PLY to GLB converts, or warns.
# What happens: 128 becomes 128, which a viewer of glTF shows as sRGB 188: the mesh is paler.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" -q install trimesh==5.2.0 numpy==2.4.6
cat >"$folder/convert.py" <<'PYTHON'
import json
import struct
import sys
import trimesh
with open(sys.argv[1], "w") as file:
    file.write("ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n"
               "property uchar red\nproperty uchar green\nproperty uchar blue\nelement face 1\n"
               "property list uchar int vertex_indices\nend_header\n"
               "0 0 0 128 64 200\n1 0 0 128 64 200\n0 1 0 128 64 200\n3 0 1 2\n")
glb = trimesh.load(sys.argv[1]).export(file_type="glb")
length = struct.unpack("<I", glb[12:16])[0]
model = json.loads(glb[20:20 + length])
accessor = model["accessors"][model["meshes"][0]["primitives"][0]["attributes"]["COLOR_0"]]
begin = 20 + length + 8 + model["bufferViews"][accessor["bufferView"]].get("byteOffset", 0)
print("component type", accessor["componentType"], list(glb[begin:begin + 3]))
PYTHON
output=$("$folder/venv/bin/python" "$folder/convert.py" "$folder/colours.ply")
echo "$output"
diff <(echo "$output") - <<'EXPECTED'
component type 5121 [128, 64, 200]
EXPECTED
