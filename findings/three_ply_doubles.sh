#!/usr/bin/env bash
# three 0.187.0. A PLY file may have coordinates of type double; PLYLoader reads them.
# One would guess: what the loader returns can be drawn.
# What happens: its position attribute is a Float64Array, and the renderer refuses that type when it is to draw it:
# "Unsupported buffer data format". (WebGL has no such type; the fake context here only counts calls.)
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
echo '{"type": "module"}' >package.json
npm install --silent --no-audit --no-fund three@0.187.0
cat >load.js <<'JAVASCRIPT'
import { WebGLAttributes } from 'three/src/renderers/webgl/WebGLAttributes.js';
import { PLYLoader } from 'three/addons/loaders/PLYLoader.js';
for (const type of ['float', 'double']) {
  const text = `ply\nformat ascii 1.0\nelement vertex 3\nproperty ${type} x\nproperty ${type} y\nproperty ${type} z\n`
    + 'element face 1\nproperty list uchar int vertex_indices\nend_header\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n';
  const position = new PLYLoader().parse(text).attributes.position;
  const gl = { createBuffer: () => ({}), bindBuffer() {}, bufferData() {}, ARRAY_BUFFER: 34962, FLOAT: 5126 };
  let result = 'drawn';
  try { new WebGLAttributes(gl).update(position, gl.ARRAY_BUFFER); } catch (error) { result = error.message.split(':')[1].trim(); }
  console.log(`${type}: ${position.array.constructor.name}, ${result}`);
}
JAVASCRIPT
output=$(node load.js)
echo "$output"
diff <(echo "$output") - <<'EXPECTED'
float: Float32Array, drawn
double: Float64Array, Unsupported buffer data format
EXPECTED
