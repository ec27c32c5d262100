#!/usr/bin/env python3
"""Writes the small files that fuzzing starts from (and that tests cut and damage) to seeds/FORMAT/."""
import base64
import json
import pathlib
import struct
import zipfile

SEEDS = pathlib.Path(__file__).parent / "seeds"
DATA = pathlib.Path(__file__).parent.parent / "data"
VERTICES = [(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1.5)]
FACES = [(0, 2, 1), (0, 1, 3), (0, 3, 2), (1, 2, 3)]


def put(name, data):
    path = SEEDS / name
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_bytes(data if isinstance(data, bytes) else data.encode())


def obj():
    vertices = "".join("v %g %g %g\n" % v for v in VERTICES)
    put("obj/tetrahedron.obj", vertices + "".join("f %d %d %d\n" % tuple(i + 1 for i in f) for f in FACES))
    put("obj/forms.obj", "# forms\r\no a\r\nv -1 0 0 1 0 0\r\nv +1 0 1e-3\r\nv 1 1 0\r\nv .2 .3 0\r\nv 0 1 0\r\nvt 0 0\r\n"
        "vn 0 0 1\r\ng b\r\nusemtl m\r\nf 1/1 2/1 \\\r\n 3/1 4/1 5/1\r\nf -5//1 -4//1 -3//1 # end\r\ns 1\r\nf 1/1/1 3/1/1 5/1/1\r\n")
    put("obj/joined.obj", "v 0 0 \\\n0\nv 2 0 0 2\ng C:\\x\\\nv 0 1 0 1\n# \\\nf 1 2\\\r\n3\n")


def stl():
    put("stl/ascii.stl", "solid s\n" + "".join(
        "facet normal 0 0 0\nouter loop\n" + "".join("vertex %g %g %g\n" % VERTICES[i] for i in f) + "endloop\nendfacet\n"
        for f in FACES) + "endsolid s\n")
    body = b"".join(struct.pack("<12fH", 0, 0, 0, *(c for i in f for c in VERTICES[i]), 0) for f in FACES)
    put("stl/binary.stl", b"solid but binary".ljust(80, b"\0") + struct.pack("<I", len(FACES)) + body)
    put("stl/one_line.stl", "solid s " + " ".join(
        "facet normal 0 0 0 outer loop " + " ".join("vertex %g %g %g" % VERTICES[i] for i in f) + " end loop end facet"
        for f in FACES) + " endsolid s")


def ply():
    def header(kind, extra=""):
        return ("ply\nformat %s 1.0\ncomment c\nelement vertex 4\nproperty float x\nproperty float y\nproperty double z\n"
                "property uchar red\nelement face 4\nproperty list uchar int vertex_indices\n%send_header\n" % (kind, extra))
    put("ply/ascii.ply", header("ascii") + "".join("%g %g %g 7\n" % v for v in VERTICES) +
        "".join("3 %d %d %d\n" % f for f in FACES))
    for kind, order in (("binary_little_endian", "<"), ("binary_big_endian", ">")):
        data = b"".join(struct.pack(order + "ffdB", *v, 7) for v in VERTICES)
        data += b"".join(struct.pack(order + "BiiiBhh", 3, *f, 2, 5, 6) for f in FACES)
        put("ply/%s.ply" % kind, header(kind, "property list uchar short other\n").encode() + data)
    put("ply/strips.ply", "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\n"
        "element nothing 9\nelement tristrips 1\nproperty list int int vertex_indices\nend_header\n"
        "0 0 0\n1 0 0\n0 1 0\n1 1 0\n8 0 1 2 3 -1 0 1 3\n")


def off():
    put("off/tetrahedron.off", "OFF\n# c\n4 4 6\n" + "".join("%g %g %g\n" % v for v in VERTICES) +
        "".join("3 %d %d %d\n" % f for f in FACES))
    put("off/colours.off", "COFF4 1 0\n0 0 0 255 0 0 255\n1 0 0 0 255 0 255\n1 1 0 0 0 255 255\n0.2 .3 0 9 9 9 9\n4 0 1 2 3 0.5 0.5 0.5\n")
    put("off/free.off", "4nOFF\n3\n4\n4 # c\n6\n0 0 0 1 2 0 0\n2 0 1 0 1\n0 0 1.5 1 " +
        "".join("3 %d %d %d 1\n" % f for f in FACES))
    put("off/undeclared.off", "OFF\n4 4\n" + "".join("%g %g %g 9 9 9\n" % v for v in VERTICES) +
        "".join("3 %d %d %d\n" % f for f in FACES))


def gltf():
    points = b"".join(struct.pack("<3f", *v) for v in VERTICES)
    indices = struct.pack("<12H", *(i for f in FACES for i in f))
    data = points + indices

    def model(buffer):
        return json.dumps({
            "asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0]}],
            "nodes": [{"children": [1], "scale": [2, 2, 2]}, {"mesh": 0, "translation": [1, 0, 0], "rotation": [0, 0, 1, 0]}],
            "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "indices": 1},
                                       {"attributes": {"POSITION": 0}, "mode": 5}]}],
            "accessors": [{"bufferView": 0, "componentType": 5126, "count": 4, "type": "VEC3", "min": [0, 0, 0], "max": [1, 1, 1.5]},
                          {"bufferView": 1, "componentType": 5123, "count": 12, "type": "SCALAR"}],
            "bufferViews": [{"buffer": 0, "byteLength": len(points)},
                            {"buffer": 0, "byteOffset": len(points), "byteLength": len(indices)}],
            "buffers": [buffer]}, separators=(",", ":"))
    text = model({"byteLength": len(data)}).encode()
    text += b" " * (-len(text) % 4)
    put("gltf/tetrahedron.glb", b"glTF" + struct.pack("<II", 2, 12 + 8 + len(text) + 8 + len(data)) +
        struct.pack("<I4s", len(text), b"JSON") + text + struct.pack("<I4s", len(data), b"BIN\0") + data)
    uri = "data:application/octet-stream;base64," + base64.b64encode(data).decode()
    put("gltf/tetrahedron.gltf", model({"byteLength": len(data), "uri": uri}))
    put("gltf/instances.glb", (DATA / "gpu_instancing_required.glb").read_bytes())
    for packed in "draco_edgebreaker", "draco_sequential", "meshopt_high", "meshopt_quantize":
        put("gltf/%s.glb" % packed, (DATA / (packed + ".glb")).read_bytes())


def threemf():
    model = ('<?xml version="1.0" encoding="UTF-8"?><model unit="millimeter" xml:lang="en-US" '
             'xmlns="http://schemas.microsoft.com/3dmanufacturing/core/2015/02"><resources><object id="1" type="model"><mesh><vertices>' +
             "".join('<vertex x="%g" y="%g" z="%g"/>' % v for v in VERTICES) + "</vertices><triangles>" +
             "".join('<triangle v1="%d" v2="%d" v3="%d"/>' % f for f in FACES) +
             '</triangles></mesh></object><object id="2" type="model"><components><component objectid="1"/>'
             '<component objectid="1" transform="0 1 0 -1 0 0 0 0 1 5 0 0"/></components></object></resources>'
             '<build><item objectid="2" transform="1 0 0 0 1 0 0 0 1 0 0 7"/></build></model>')
    put("3mf_model/model.xml", model)
    parts = {
        "[Content_Types].xml": '<?xml version="1.0" encoding="UTF-8"?><Types xmlns="http://schemas.openxmlformats.org/package/2006/content-types">'
        '<Default Extension="rels" ContentType="application/vnd.openxmlformats-package.relationships+xml"/>'
        '<Default Extension="model" ContentType="application/vnd.ms-package.3dmanufacturing-3dmodel+xml"/></Types>',
        "_rels/.rels": '<?xml version="1.0" encoding="UTF-8"?><Relationships xmlns="http://schemas.openxmlformats.org/package/2006/relationships">'
        '<Relationship Target="/3D/3dmodel.model" Id="rel0" Type="http://schemas.microsoft.com/3dmanufacturing/2013/01/3dmodel"/></Relationships>',
        "3D/3dmodel.model": model}
    put("3mf/slicer.3mf", (DATA / "slicer_modifier_part.3mf").read_bytes())
    for name, method in (("stored", zipfile.ZIP_STORED), ("deflated", zipfile.ZIP_DEFLATED)):
        path = SEEDS / "3mf" / (name + ".3mf")
        path.parent.mkdir(parents=True, exist_ok=True)
        with zipfile.ZipFile(path, "w") as archive:
            for part, text in parts.items():
                archive.writestr(zipfile.ZipInfo(part, (2020, 1, 1, 0, 0, 0)), text, method)


def points():
    """The first byte chooses the reader."""
    text = "{'descr': '<f8', 'fortran_order': False, 'shape': (2, 3), }".ljust(117) + "\n"
    put("points/npy", b"\0\x93NUMPY\x01\0" + struct.pack("<H", len(text)) + text.encode() + struct.pack("<6d", *range(6)))
    put("points/csv", "\1z,x,y,name\n1,2,3,a\n\"4\";5;+6e0;b\n")
    put("points/csv_commas", "\1x;y;z\n0,5;\"1,5\";2\n1;2;3,25\n")
    put("points/xyz", "\2# c\n1 2 3\n4 5 6 7\n")
    put("points/ply", b"\3" + (SEEDS / "ply/binary_little_endian.ply").read_bytes())


for make in (obj, stl, ply, off, gltf, threemf, points):
    make()
