#!/usr/bin/env python3
"""What its.batch costs beside the work itself: 1,000 meshes, shells of the default thickness.

    bench/batch_overhead.py [--meshes 1000] [--workers 2] [FOLDER WITH MORE MESHES]

Prints seconds of the clock for: a loop in this process with one thread; a batch of one worker; one of several;
the same with a ProcessPoolExecutor. Overhead a mesh = (batch of one worker - loop) / meshes, efficiency =
loop / (workers * batch).
"""

import argparse
import contextlib
import random
import tempfile
import time
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path

import numpy as np

import its


def torus(around, across, thick):
    u, v = np.meshgrid(
        np.arange(around) * 2 * np.pi / around, np.arange(across) * 2 * np.pi / across, indexing="ij"
    )
    r = 1 + thick * np.cos(v)
    vertices = np.stack([r * np.cos(u), r * np.sin(u), thick * np.sin(v)], axis=-1).reshape(-1, 3)
    i, j = (x.reshape(-1) for x in np.meshgrid(np.arange(around), np.arange(across), indexing="ij"))
    a, b = i * across + j, (i + 1) % around * across + j
    c, d = (i + 1) % around * across + (j + 1) % across, i * across + (j + 1) % across
    return vertices, np.concatenate([np.stack([a, b, c], 1), np.stack([a, c, d], 1)])


def make(folder, count, more):
    """Tori of 200 to 10,000 triangles, every fifth without some of them; and what else there is below 2 MB."""
    rng = random.Random(1)
    real = (
        [
            p
            for p in sorted(more.iterdir())
            if p.suffix in (".obj", ".stl", ".ply", ".off") and p.stat().st_size < 2e6
        ]
        if more
        else []
    )
    for n, path in enumerate(real):
        (folder / f"real{n:03}{path.suffix}").symlink_to(path.absolute())
    for n in range(count - len(real)):
        vertices, faces = torus(rng.randint(10, 100), rng.randint(10, 50), rng.uniform(0.1, 0.5))
        its.write(folder / f"torus{n:04}.ply", (vertices, faces[len(faces) // 9 if n % 5 == 0 else 0 :]))


def timed(name, work):
    start = time.perf_counter()
    report = work()
    seconds = time.perf_counter() - start
    print(f"{name:30} {seconds:8.2f} s   {report.counts if report else ''}", flush=True)
    return seconds


def loop(folder, out):
    job = its.BuildJob()
    out.mkdir()
    for path in sorted(folder.iterdir()):
        with contextlib.suppress(its.Error):
            job(str(path), str(out / path.name))


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("--meshes", type=int, default=1000)
    parser.add_argument("--workers", type=int, default=2)
    parser.add_argument("more", type=Path, nargs="?")
    args = parser.parse_args()
    with tempfile.TemporaryDirectory() as name:
        root = Path(name)
        (root / "in").mkdir()
        make(root / "in", args.meshes, args.more)
        alone = timed("loop in this process", lambda: loop(root / "in", root / "loop"))
        one = timed("batch, 1 worker", lambda: its.batch(root / "in", root / "one", workers=1))
        many = timed(
            f"batch, {args.workers} workers",
            lambda: its.batch(root / "in", root / "many", workers=args.workers),
        )
        with ProcessPoolExecutor(args.workers) as pool:
            timed("ProcessPoolExecutor", lambda: its.batch(root / "in", root / "pool", executor=pool))
        print(
            f"overhead {1e3 * (one - alone) / args.meshes:.2f} ms a mesh, "
            f"efficiency of {args.workers} workers {alone / args.workers / many:.2f}"
        )


if __name__ == "__main__":
    main()
