#!/usr/bin/env bash
# meshio 5.3.5, numpy 2.4.6. PLY names eight types: char, uchar, short, ushort, int, uint, float, double.
# One would guess: a binary file with a property of type char is read, as a text file with one is.
# What happens: KeyError 'char', while "int8", the newer name of the same type, is read.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" -q install meshio==5.3.5 numpy==2.4.6
cat >"$folder/read.py" <<'PYTHON'
import struct
import sys
import meshio
for kind in "char", "int8":
    head = ("ply\nformat binary_little_endian 1.0\nelement vertex 3\nproperty double x\nproperty double y\n"
            "property double z\nproperty %s side\nelement face 1\nproperty list uchar int vertex_indices\nend_header\n" % kind)
    rows = b"".join(struct.pack("<dddb", *row) for row in ((0, 0, 0, -1), (1, 0, 0, 0), (0, 1, 0, 1)))
    with open(sys.argv[1], "wb") as file:
        file.write(head.encode() + rows + struct.pack("<Biii", 3, 0, 1, 2))
    try:
        print(kind, meshio.read(sys.argv[1]).point_data["side"].tolist())
    except KeyError as error:
        print(kind, "KeyError:", error)
PYTHON
output=$("$folder/venv/bin/python" "$folder/read.py" "$folder/side.ply")
echo "$output"
diff <(echo "$output") - <<'EXPECTED'
char KeyError: 'char'
int8 [-1, 0, 1]
EXPECTED
