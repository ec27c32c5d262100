#!/usr/bin/env python3
"""Inside or outside from Python, beside peers: one thread each, uniform points in the mesh's bounding box.

  python3 -m venv venv && venv/bin/pip install . trimesh==5.2.0 rtree embreex==4.4.0.post1 libigl==2.6.3 \\
      point-cloud-utils==0.34.0 fcpw==1.2.0 open3d==0.20.0 warp-lang==1.19.0
  venv/bin/python bench/python_peers.py MESH... [--points 1000000] [--json OUT]

Peers that are not installed are left out with a line. Every peer gets what it needs (float32 where it takes no
other, its own acceleration structure and points converted before the clock starts) and its own process, which
may use one processor only. Time is the processor's, so that what else the machine does matters little; building
is not in it. Right is what its.Shell.classify says; points on the surface count for nobody. Each line also has
what a peer makes of a point with NaN.
"""

from __future__ import annotations

import argparse
import json
import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from typing import Any

import numpy as np

#: Asks about points that were converted before: the clock runs only here.
Ask = Callable[[], Any]


def with_its(v: np.ndarray, f: np.ndarray, p: np.ndarray) -> Ask:
    import its

    shell = its.build(v, f, depth=7)
    return lambda: shell.contains(p, threads=1)


def with_trimesh(v: np.ndarray, f: np.ndarray, p: np.ndarray) -> Ask:
    import embreex  # noqa: F401
    import trimesh

    mesh = trimesh.Trimesh(v, f, process=False)
    mesh.contains(v[:1])  # builds the tree
    return lambda: mesh.contains(p)


def with_open3d(v: np.ndarray, f: np.ndarray, p: np.ndarray) -> Ask:
    import open3d as o3d

    scene = o3d.t.geometry.RaycastingScene(nthreads=1)
    scene.add_triangles(o3d.core.Tensor(v.astype(np.float32)), o3d.core.Tensor(f.astype(np.uint32)))
    points = o3d.core.Tensor(p.astype(np.float32))
    scene.compute_occupancy(points[:1], nthreads=1)
    return lambda: scene.compute_occupancy(points, nthreads=1).numpy() > 0


def with_igl_winding(v: np.ndarray, f: np.ndarray, p: np.ndarray) -> Ask:
    import igl

    tree = igl.FastWindingNumberBVH()
    tree.init(np.asfortranarray(v), np.asfortranarray(f))
    points = np.asfortranarray(p)
    return lambda: tree.winding_number(points) > 0.5


def with_igl_distance(v: np.ndarray, f: np.ndarray, p: np.ndarray) -> Ask:
    import igl

    kind = igl.SIGNED_DISTANCE_TYPE_PSEUDONORMAL
    return lambda: igl.signed_distance(p, v, f, kind)[0] < 0


def with_pcu(v: np.ndarray, f: np.ndarray, p: np.ndarray) -> Ask:
    import point_cloud_utils as pcu

    return lambda: pcu.signed_distance_to_mesh(p, v, f)[0] < 0


def with_fcpw(v: np.ndarray, f: np.ndarray, p: np.ndarray) -> Ask:
    import fcpw

    scene = fcpw.scene_3D()
    scene.set_object_count(1)
    scene.set_object_vertices(np.asfortranarray(v, np.float32), 0)
    scene.set_object_triangles(np.asfortranarray(f, np.int32), 0)
    scene.build(fcpw.aggregate_type.bvh_surface_area, True)
    points = fcpw.float_3D_list(list(p.astype(np.float32)))  # of arrays, 1.2.0 leaves the results as they were

    def ask() -> Any:
        result = fcpw.uint32_list()
        scene.contains(points, result)
        return result

    return ask


PEERS: dict[str, Callable[[np.ndarray, np.ndarray, np.ndarray], Ask]] = {
    "its": with_its,
    "trimesh, embreex": with_trimesh,
    "Open3D RaycastingScene": with_open3d,
    "libigl FastWindingNumberBVH": with_igl_winding,
    "libigl signed_distance, pseudonormal": with_igl_distance,
    "point-cloud-utils": with_pcu,
    "fcpw": with_fcpw,
}


def measure(name: str, path: str, count: int) -> dict[str, Any]:
    """In a process of its own, on one processor."""
    os.sched_setaffinity(0, [min(os.sched_getaffinity(0))])
    import its

    mesh = its.read(path)
    v, f = np.array(mesh.vertices), np.array(mesh.faces, np.int64)
    if count == 0:
        return {"nan": str(np.asarray(PEERS[name](v, f, np.array([[np.nan, 0, 0], [0, 0, 0]]))())[0])}
    points = np.random.default_rng(0).uniform(v.min(axis=0), v.max(axis=0), (count, 3))
    right = its.build(v, f, depth=7).classify(points)
    PEERS[name](v, f, points[:1000])()
    ask = PEERS[name](v, f, points)
    start = time.process_time()
    answer = ask()
    seconds = time.process_time() - start
    sides = np.asarray(answer).astype(bool)
    agreement = float((sides == (right < 0))[right != 0].mean())
    return {"ns": 1e9 * seconds / count, "agreement": agreement}


def run(name: str, path: str, count: int) -> dict[str, Any]:
    """Of a peer that is not installed, crashes or takes more than ten minutes: the reason."""
    environment = {**os.environ, "OMP_NUM_THREADS": "1", "IGL_NUM_THREADS": "1"}
    command = [sys.executable, __file__, path, "--points", str(count), "--only", name]
    try:
        done = subprocess.run(command, env=environment, capture_output=True, text=True, timeout=600)
    except subprocess.TimeoutExpired:
        return {"error": "more than 600 s"}
    if done.returncode < 0:
        return {"error": signal.Signals(-done.returncode).name}
    if done.returncode > 0:
        return {"error": (done.stderr.strip().splitlines() or ["failed"])[-1]}
    result: dict[str, Any] = json.loads(done.stdout.splitlines()[-1])
    return result


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("meshes", nargs="+")
    parser.add_argument("--points", type=int, default=1_000_000)
    parser.add_argument("--json", help="write all figures to this file")
    parser.add_argument("--only", help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.only:
        print(json.dumps(measure(options.only, options.meshes[0], options.points)))
        return
    table = []
    for path in options.meshes:
        print(f"\n{os.path.basename(path)}, {options.points:,} points\n")
        print("| | ns a point | of its | right | a point with NaN |\n|---|--:|--:|--:|---|")
        own = None
        for name in PEERS:
            result = run(name, path, options.points)
            if "error" in result:
                print(f"| {name} | {result['error']} | | | |", flush=True)
                continue
            nan = run(name, path, 0)
            result["nan"] = nan.get("nan") or nan["error"]
            table.append({"mesh": os.path.basename(path), "peer": name, **result})
            own = own or result["ns"]
            ns, right = result["ns"], 100 * result["agreement"]
            print(f"| {name} | {ns:.1f} | {ns / own:.0f} × | {right:.4f} % | {result['nan']} |", flush=True)
    if options.json:
        with open(options.json, "w", encoding="utf-8") as file:
            json.dump(table, file, indent=1)


if __name__ == "__main__":
    main()
