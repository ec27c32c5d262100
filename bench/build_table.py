#!/usr/bin/env python3
"""Runs bench_build and prints its results as Markdown tables.

    bench/build_table.py [--build build-bench] [--threads 1,2] [--min-time 0.5] MESH[:LOW-HIGH] ...
    bench/build_table.py --thickness-of K [--build build-bench] [--threads 1] [--rounds 5] MESH ...

Stages and total are in seconds on the clock, of the fastest repetition; "processor" is processor time, the least of all
repetitions, which other work on the machine disturbs little. "OpenVDB" is the processor time of meshToVolume at the same cell width, a narrow band
of 3 voxels to each side without any bounds, where bench_build was built with it.

--thickness-of compares shells of depth K with those built to the same thickness, by the program `its`, in turns: bytes
kept, the least processor time of the whole process, reading and writing included, and the seconds of its build.
"""
import argparse
import json
import os
import subprocess
import sys
import tempfile

# Thickness of the paper's own model, Sapphos head, relative to the longest side (Wen et al., figure 8).
PAPER = {4: (-0.027, 0.034), 5: (-0.013, 0.017), 6: (-0.008, 0.007), 7: (-0.005, 0.003), 8: (-0.003, 0.002),
         9: (-0.001, 0.001)}


def measure(args):
    command = [f"{args.build}/bench/bench_build", "--benchmark_format=json", f"--benchmark_min_time={args.min_time}"]
    command += [f"--threads={n}" for n in args.threads.split(",")] + args.mesh
    print("$", " ".join(command), file=sys.stderr)
    return json.loads(subprocess.run(command, check=True, stdout=subprocess.PIPE).stdout)["benchmarks"]


def build_once(args, mesh, options, folder):
    """What `its build --json` says, and the process's own processor seconds."""
    output = os.path.join(folder, "shell.its")
    command = [f"{args.build}/its", "build", mesh, "-o", output, "--force", "--json", "--threads", args.threads] + options
    child = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL)
    text = child.stdout.read()
    _, _, usage = os.wait4(child.pid, 0)
    report = json.loads(text)
    report["processor"] = usage.ru_utime + usage.ru_stime
    report["peak"] = 1024 * usage.ru_maxrss
    return report


def compare_thickness(args):
    print("| model | triangles | thickness/s | surface cells: one size | adaptive | ratio | MB kept | | ratio | processor s | "
          "| ratio | seconds of the build | | peak MB | |")
    print("|---|--:|--:|--:|--:|--:|--:|--:|--:|--:|--:|--:|--:|--:|--:|--:|")
    with tempfile.TemporaryDirectory() as folder:
        for mesh in args.mesh:
            one = several = None
            for _ in range(args.rounds):
                a = build_once(args, mesh, ["--depth", str(args.thickness_of)], folder)
                b = build_once(args, mesh, ["--thickness", repr(a["thickness"])], folder)
                least = lambda old, new: new if old is None or new["processor"] < old["processor"] else old
                one, several = least(one, a), least(several, b)
            a, b = one, several
            ratio = lambda get: f"{get(b) / get(a):.3f}"
            print(f"| {os.path.basename(mesh)} | {a['mesh']['triangles']:,} | {a['thickness_relative']:.6f} | "
                  f"{a['surface_cells']:,} | {b['surface_cells']:,} | {ratio(lambda r: r['surface_cells'])} | "
                  f"{a['memory_bytes'] / 1e6:.2f} | {b['memory_bytes'] / 1e6:.2f} | {ratio(lambda r: r['memory_bytes'])} | "
                  f"{a['processor']:.3f} | {b['processor']:.3f} | {ratio(lambda r: r['processor'])} | "
                  f"{a['seconds']['total']:.3f} | {b['seconds']['total']:.3f} | {a['peak'] / 1e6:.0f} | {b['peak'] / 1e6:.0f} |")
            sys.stdout.flush()


def key(row):
    tool, model, depth, threads = row["name"].split("/")[:4]
    return tool, model, int(depth), int(threads)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--build", default="build-bench")
    parser.add_argument("--threads", default="1,2")
    parser.add_argument("--min-time", default="0.5")
    parser.add_argument("--thickness-of", type=int, metavar="K")
    parser.add_argument("--rounds", type=int, default=5)
    parser.add_argument("mesh", nargs="+")
    args = parser.parse_args()
    if args.thickness_of is not None:
        if "," in args.threads:
            args.threads = "1"
        return compare_thickness(args)
    rows = {key(row): row for row in measure(args)}
    ours = {k: v for k, v in rows.items() if k[0] == "its"}

    print("| model | triangles | K | threads | surface cells | octree | distance | extrema | other | total | processor | OpenVDB |"
          " bytes a cell |")
    print("|---|--:|--:|--:|--:|--:|--:|--:|--:|--:|--:|--:|--:|")
    for (_, model, depth, threads), r in ours.items():
        total = r["total"]
        other = total - r["octree"] - r["distance"] - r["extrema"]

        def share(seconds):
            return f"{seconds:.3f} ({100 * seconds / total:.0f} %)"

        peer = rows.get(("openvdb", model, depth, threads))
        peer = f"{peer['processor']:.3f}" if peer else "–"
        print(f"| {model} | {r['triangles']:,.0f} | {depth} | {threads} | {r['surface_cells']:,.0f} | "
              f"{share(r['octree'])} | {share(r['distance'])} | {share(r['extrema'])} | {share(other)} | "
              f"{total:.3f} | **{r['processor']:.3f}** | {peer} | {r['bytes_per_cell']:.0f} |")

    print("\n| model | K | ε₁/s | ε₂/s | thickness/s | paper's model: ε₁ | ε₂ | thickness |")
    print("|---|--:|--:|--:|--:|--:|--:|--:|")
    seen = set()
    for (_, model, depth, _), r in ours.items():
        if (model, depth) in seen:
            continue
        seen.add((model, depth))
        inner, outer = PAPER.get(depth, (None, None))
        paper = f"{inner} | {outer} | {outer - inner:.3f}" if inner else "– | – | –"
        print(f"| {model} | {depth} | {r['epsilon_inner']:.6f} | {r['epsilon_outer']:.6f} | {r['thickness']:.6f} | "
              f"{paper} |")


if __name__ == "__main__":
    main()
