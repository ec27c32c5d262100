#!/usr/bin/env python3
"""Runs bench_build and prints its results as Markdown tables.

    bench/build_table.py [--build build-bench] [--threads 1,2] [--min-time 0.5] MESH[:LOW-HIGH] ...

Stages and total are in seconds on the clock, of the fastest repetition; "processor" is processor time, the least of all
repetitions, which other work on the machine disturbs little. "OpenVDB" is the processor time of meshToVolume at the same cell width, a narrow band
of 3 voxels to each side without any bounds, where bench_build was built with it.
"""
import argparse
import json
import subprocess
import sys

# Thickness of the paper's own model, Sapphos head, relative to the longest side (Wen et al., figure 8).
PAPER = {4: (-0.027, 0.034), 5: (-0.013, 0.017), 6: (-0.008, 0.007), 7: (-0.005, 0.003), 8: (-0.003, 0.002),
         9: (-0.001, 0.001)}


def measure(args):
    command = [f"{args.build}/bench/bench_build", "--benchmark_format=json", f"--benchmark_min_time={args.min_time}"]
    command += [f"--threads={n}" for n in args.threads.split(",")] + args.mesh
    print("$", " ".join(command), file=sys.stderr)
    return json.loads(subprocess.run(command, check=True, stdout=subprocess.PIPE).stdout)["benchmarks"]


def key(row):
    tool, model, depth, threads = row["name"].split("/")[:4]
    return tool, model, int(depth), int(threads)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--build", default="build-bench")
    parser.add_argument("--threads", default="1,2")
    parser.add_argument("--min-time", default="0.5")
    parser.add_argument("mesh", nargs="+")
    rows = {key(row): row for row in measure(parser.parse_args())}
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
