#!/usr/bin/env bash
# trimesh 5.2.0, numpy 2.4.6. glTF 2.0, 3.12: a client that does not know an extension of extensionsRequired must not
# load the file. This one draws a triangle three times by EXT_mesh_gpu_instancing, and requires that.
# One would guess: three triangles from x = 0 to 21, or an error.
# What happens: one triangle from 0 to 1, no error, no warning.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" -q install trimesh==5.2.0 numpy==2.4.6
cat >"$folder/read.py" <<'PYTHON'
import base64
import json
import struct
import sys
import trimesh
data = struct.pack("<18f", 0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 0, 10, 0, 0, 20, 0, 0)
name = "EXT_mesh_gpu_instancing"
model = {
    "asset": {"version": "2.0"}, "extensionsUsed": [name], "extensionsRequired": [name],
    "scene": 0, "scenes": [{"nodes": [0]}],
    "nodes": [{"mesh": 0, "extensions": {name: {"attributes": {"TRANSLATION": 1}}}}],
    "meshes": [{"primitives": [{"attributes": {"POSITION": 0}}]}],
    "accessors": [{"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3", "min": [0, 0, 0], "max": [1, 1, 0]},
                  {"bufferView": 1, "componentType": 5126, "count": 3, "type": "VEC3"}],
    "bufferViews": [{"buffer": 0, "byteLength": 36}, {"buffer": 0, "byteOffset": 36, "byteLength": 36}],
    "buffers": [{"byteLength": 72, "uri": "data:application/octet-stream;base64," + base64.b64encode(data).decode()}]}
with open(sys.argv[1], "w") as file:
    json.dump(model, file)
scene = trimesh.load(sys.argv[1])
print(sum(len(mesh.faces) for mesh in scene.geometry.values()), "triangle, x to", scene.bounds[1][0])
PYTHON
output=$("$folder/venv/bin/python" "$folder/read.py" "$folder/instances.gltf")
echo "$output"
diff <(echo "$output") - <<'EXPECTED'
1 triangle, x to 1.0
EXPECTED
