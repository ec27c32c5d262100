#!/usr/bin/env python3
"""Runs bench_query and prints its results as Markdown tables.

    bench/query_table.py [--build build-bench] [--repetitions 5] [--min-time 0.02] MESH [options of bench_query]

Nanoseconds a point, of the fastest repetition (elapsed time; the processor's time where --cpu is given: less
disturbed on a shared machine, but meaningless for several threads). Agreement is with CGAL's answer.
"""
import argparse
import json
import subprocess
import sys

POINTS = 100_000
LABELS = {
    "its_single": "ITS exact, one call a point", "its_batch": "ITS exact, batch", "its_shell": "ITS shell, batch",
    "its_fallback": "ITS shell + closest points, batch", "its_value": "ITS f, batch",
    "its_gradient": "ITS ∇f, batch", "embree_parity": "Embree ray parity",
    "embree_point_query": "Embree point query", "cgal_side": "CGAL Side_of_triangle_mesh",
    "openvdb_sampler": "OpenVDB sampler",
}


def measure(args, rest):
    command = [f"{args.build}/bench/bench_query", args.mesh, "--benchmark_format=json",
               f"--benchmark_min_time={args.min_time}", f"--benchmark_repetitions={args.repetitions}"] + rest
    print("$", " ".join(command), file=sys.stderr)
    return json.loads(subprocess.run(command, check=True, stdout=subprocess.PIPE).stdout)["benchmarks"]


def fastest(runs, time):
    best = {}
    for run in runs:
        if run.get("run_type") == "aggregate":
            continue
        key = tuple(run["name"].split("/")[:4])  # tool, depth, threads, points
        if key not in best or run[time] < best[key][time]:
            best[key] = run
    return best


def print_times(best, time):
    sets = list(dict.fromkeys(k[3] for k in best if k[3] != "-"))
    print("| | K | threads | " + " | ".join(sets) + " | agree 1x | agree near |")
    print("|---|--:|--:|" + "--:|" * (len(sets) + 2))
    for tool, depth, threads in dict.fromkeys(k[:3] for k in best):
        if tool not in LABELS:
            continue
        rows = [best.get((tool, depth, threads, s)) for s in sets]
        times = " | ".join(f"{r[time] / POINTS:.1f}" if r else "" for r in rows)

        def agreement(name):
            row = best.get((tool, depth, threads, name), {})
            value = row.get("agree")
            return f"{100 * value:.4f} %" if isinstance(value, float) and value == value else ""

        print(f"| {LABELS[tool]} | {depth if depth != '0' else ''} | {threads} | {times} | "
              f"{agreement('1x')} | {agreement('near')} |")


def print_statistics(best):
    print("\n| points | K | in cells that meet M | in the global band | needed triangles | settled by a walk |")
    print("|---|--:|--:|--:|--:|--:|")
    for (tool, depth, _, points), r in best.items():
        if tool == "its_statistics":
            print(f"| {points} | {depth} | {100 * r['hit']:.3f} % | {100 * r['global']:.3f} % | "
                  f"{100 * r['local']:.3f} % | {100 * r['walk']:.4f} % |")
    print("\n| K | index, ms | index, MB | shell, MB |")
    print("|--:|--:|--:|--:|")
    for (tool, depth, _, _), r in best.items():
        if tool == "its_index":
            print(f"| {depth} | {r['real_time'] / 1e6:.2f} | {r['bytes'] / 1e6:.2f} | {r['shell_bytes'] / 1e6:.2f} |")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--build", default="build-bench")
    parser.add_argument("--repetitions", type=int, default=5)
    parser.add_argument("--min-time", default="0.02")
    parser.add_argument("--cpu", action="store_true")
    parser.add_argument("mesh")
    args, rest = parser.parse_known_args()
    time = "cpu_time" if args.cpu else "real_time"
    best = fastest(measure(args, rest), time)
    print_times(best, time)
    print_statistics(best)


if __name__ == "__main__":
    main()
