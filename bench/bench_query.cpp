// Inside or outside, and f, for uniform points in boxes of 1× to 10× the bounding box, with peers beside ours
// in the same run. Usage:
//   bench_query MESH [--depths=6,7,8,9] [--boxes=1,10] [--threads=1,2] [--peers=0] [Google Benchmark's options]
// bench/query_table.py prints the results as tables.

#include <benchmark/benchmark.h>
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <random>
#include <sstream>

#include "geometry/predicates.h"
#include "its/distance.h"
#include "its/inspect.h"
#include "its/mesh_file.h"
#include "its/query.h"
#include "its/shell.h"
#include "main.h"
#include "query/decide.h"
#ifdef ITS_BENCH_PEERS
#include "peer_inside.h"
#include "query/access.h"
#include "shell/access.h"
#endif

namespace its::bench {
namespace {

constexpr std::size_t point_count = 100'000;  // as in the paper

struct Options {
    std::string mesh;
    std::vector<int> depths{6, 7, 8, 9}, boxes{1, 2, 4, 10}, threads{1, 2};
    bool peers = true;
};

std::vector<int> numbers(const std::string& text) {
    std::vector<int> all;
    std::istringstream stream(text);
    for (std::string item; std::getline(stream, item, ',');) all.push_back(std::stoi(item));
    return all;
}

Options parse(int argc, char** argv) {
    Options options;
    for (int i = 1; i < argc; ++i) {
        const std::string argument = argv[i];
        const auto value = argument.substr(argument.find('=') + 1);
        if (argument.starts_with("--depths="))
            options.depths = numbers(value);
        else if (argument.starts_with("--boxes="))
            options.boxes = numbers(value);
        else if (argument.starts_with("--threads="))
            options.threads = numbers(value);
        else if (argument.starts_with("--peers="))
            options.peers = value != "0";
        else if (argument.starts_with("--"))
            refuse(argument);
        else
            options.mesh = argument;
    }
    if (options.mesh.empty()) throw OptionError("usage: bench_query MESH [options]");
    return options;
}

double uniform(std::mt19937_64& random) {
    return double(random() >> 11) * 0x1p-53;
}

/// Uniform in the bounding box scaled about its centre.
std::vector<Vec3> box_points(const Box& bounds, double factor) {
    std::mt19937_64 random(20240);
    std::vector<Vec3> points(point_count);
    for (Vec3& p : points)
        for (int axis = 0; axis < 3; ++axis) {
            const double centre = 0.5 * (bounds.min[axis] + bounds.max[axis]);
            const double half = 0.5 * factor * (bounds.max[axis] - bounds.min[axis]);
            p[axis] = centre + (2 * uniform(random) - 1) * half;
        }
    return points;
}

/// On random triangles, moved by up to `off` in each coordinate.
std::vector<Vec3> near_points(const Mesh& mesh, double off) {
    std::mt19937_64 random(20241);
    std::vector<Vec3> points(point_count);
    for (Vec3& p : points) {
        const Triangle& t = mesh.triangles[random() % mesh.triangles.size()];
        double s = uniform(random), r = uniform(random);
        if (s + r > 1) s = 1 - s, r = 1 - r;
        for (int axis = 0; axis < 3; ++axis) {
            const double a = mesh.vertices[t[0]][axis];
            p[axis] = a + s * (mesh.vertices[t[1]][axis] - a) + r * (mesh.vertices[t[2]][axis] - a) +
                      (2 * uniform(random) - 1) * off;
        }
    }
    return points;
}

/// Points in Morton order: what a sweep over a volume looks like.
std::vector<Vec3> sorted(std::vector<Vec3> points, const Box& root) {
    const auto code = [&](const Vec3& p) {
        octree::Cell cell;
        for (int axis = 0; axis < 3; ++axis)
            cell[axis] = std::uint32_t(std::clamp(
                (p[axis] - root.min[axis]) / (root.max[axis] - root.min[axis]) * 2097152.0, 0.0, 2097151.0));
        return octree::morton_encode(cell);
    };
    std::ranges::sort(points, {}, code);
    return points;
}

/// Points of one kind, and the reference's answer.
struct PointSet {
    std::string name;
    std::vector<Vec3> points;
    std::vector<std::int8_t> truth;
};

double agreement(const std::vector<std::int8_t>& codes, const PointSet& set) {
    if (set.truth.empty()) return std::nan("");
    std::size_t equal = 0;
    for (std::size_t i = 0; i < codes.size(); ++i) equal += codes[i] == set.truth[i];
    return double(equal) / double(codes.size());
}

using Classify = std::function<void(const PointSet&, std::vector<std::int8_t>&)>;

void add(const std::string& name, const PointSet& set, Classify classify) {
    benchmark::RegisterBenchmark((name + "/" + set.name).c_str(),
                                 [&set, classify](benchmark::State& state) {
                                     std::vector<std::int8_t> codes(set.points.size());
                                     for (auto _ : state) classify(set, codes);
                                     state.counters["agree"] = agreement(codes, set);
                                 })
        ->UseRealTime()
        ->Unit(benchmark::kNanosecond);
}

/// Cells that meet M, points whose decision needed triangles by local bounds, by the walk, by global bounds.
void add_statistics(const std::string& name, const PointSet& set, const Query& query) {
    benchmark::RegisterBenchmark(
        (name + "/" + set.name).c_str(),
        [&set, &query](benchmark::State& state) {
            const query::QueryIndex& index = query::Access::index(query);
            const shell::ShellData& shell = shell::Access::data(query.shell());
            double hit = 0, local = 0, walk = 0, global = 0;
            for (auto _ : state)
                for (const Vec3& p : set.points) {
                    const Vec3 u = index.to_lattice(p);
                    if (!index.in_root(u)) continue;
                    const octree::Cell finest = query::finest_cell(u);
                    const query::Place at = query::descend(index.levels.data(), 0, shell.octree.depth, finest);
                    if (!at.marked) continue;
                    const query::SurfacePoint point = query::surface_point(at, finest, u);
                    double value[8];
                    const double f = query::surface_value(index, point, value);
                    const query::Decision how = query::how_decided(index, point);
                    hit += 1;
                    walk += how == query::Decision::walk;
                    local += how == query::Decision::local;
                    global += f >= shell.epsilon_inner && f <= shell.epsilon_outer;
                }
            const double count = double(set.points.size()) * double(state.iterations());
            state.counters["hit"] = hit / count;
            state.counters["walk"] = walk / count;
            state.counters["local"] = local / count;
            state.counters["global"] = global / count;
        })
        ->Iterations(1)
        ->Repetitions(1);
}

void add_index(const Query& query, int depth) {
    benchmark::RegisterBenchmark(fmt::format("its_index/{}/1/-", depth).c_str(), [&query](
                                                                                     benchmark::State& state) {
        for (auto _ : state) benchmark::DoNotOptimize(Query(query.shell()));
        state.counters["bytes"] = double(query.memory_bytes());
        state.counters["shell_bytes"] = double(query.shell().info().memory_bytes);
    })->UseRealTime();
}

/// The paper's way to an answer for all points.
void add_fallback(const std::string& name, const PointSet& set, const Query& query,
                  const ClosestSides& closest) {
    add(name, set, [&](const PointSet& s, std::vector<std::int8_t>& out) {
        query.classify_shell(s.points, out, closest, {.threads = 1});
    });
}

void add_query(const Query& query, const PointSet& set, int depth, const std::vector<int>& threads,
               const ClosestSides& closest) {
    const auto label = [&](const char* what, int n) { return fmt::format("{}/{}/{}", what, depth, n); };
    add(label("its_single", 1), set, [&query](const PointSet& s, std::vector<std::int8_t>& out) {
        for (std::size_t i = 0; i < s.points.size(); ++i) out[i] = std::int8_t(query.classify(s.points[i]));
    });
    for (const int n : threads) {
        const Run run{.threads = n};
        add(label("its_batch", n), set, [&query, run](const PointSet& s, std::vector<std::int8_t>& out) {
            query.classify(s.points, out, run);
        });
        add(label("its_shell", n), set, [&query, run](const PointSet& s, std::vector<std::int8_t>& out) {
            query.classify_shell(s.points, out, run);
        });
        benchmark::RegisterBenchmark((label("its_value", n) + "/" + set.name).c_str(),
                                     [&query, &set, run](benchmark::State& state) {
                                         std::vector<double> values(set.points.size());
                                         for (auto _ : state) query.value(set.points, values, run);
                                     })
            ->UseRealTime();
        benchmark::RegisterBenchmark((label("its_gradient", n) + "/" + set.name).c_str(),
                                     [&query, &set, run](benchmark::State& state) {
                                         std::vector<Vec3> values(set.points.size());
                                         for (auto _ : state) query.gradient(set.points, values, run);
                                     })
            ->UseRealTime();
    }
    add_fallback(label("its_fallback", 1), set, query, closest);
    add_statistics(label("its_statistics", 1), set, query);
}

int run(int argc, char** argv) {
    benchmark::Initialize(&argc, argv);
    const Options options = parse(argc, argv);
    const Mesh mesh = read_mesh(options.mesh).mesh;
    const Box bounds = inspect(mesh).bounds;

    std::vector<std::unique_ptr<Query>> queries;
    for (const int depth : options.depths) {
        BuildOptions build_options;
        build_options.depth = depth;
        queries.push_back(std::make_unique<Query>(build(mesh, build_options)));
    }
    const ShellInfo& info = queries.back()->shell().info();

    const ClosestSides closest(queries.back()->shell().mesh_view());

    std::vector<std::unique_ptr<PointSet>> sets;
    for (const int factor : options.boxes)
        sets.push_back(
            std::make_unique<PointSet>(PointSet{fmt::format("{}x", factor), box_points(bounds, factor), {}}));
    sets.push_back(std::make_unique<PointSet>(PointSet{"root", box_points(info.root, 1), {}}));
    sets.push_back(
        std::make_unique<PointSet>(PointSet{"1x_sorted", sorted(box_points(bounds, 1), info.root), {}}));
    sets.push_back(std::make_unique<PointSet>(PointSet{"near", near_points(mesh, 1e-3 * info.cell_width), {}}));

#ifdef ITS_BENCH_PEERS
    std::map<std::string, std::unique_ptr<InsidePeer>> peers;
    if (options.peers) {
        peers["cgal_side"] = cgal_side(mesh);
        peers["embree_parity"] = embree_parity(mesh);
        peers["embree_point_query"] = embree_point_query(mesh);
        for (const auto& set : sets) {
            set->truth.resize(set->points.size());
            peers["cgal_side"]->classify(set->points, set->truth);
            for (const auto& [name, peer] : peers)
                add(name + "/0/1", *set, [&peer = *peer](const PointSet& s, std::vector<std::int8_t>& out) {
                    peer.classify(s.points, out);
                });
        }
        for (const int depth : options.depths) {
            const std::string name = fmt::format("openvdb_sampler/{}/1", depth);
            peers[name] = openvdb_sampler(mesh, std::ldexp(info.scale, -depth));
            for (const auto& set : sets)
                add(name, *set, [&peer = *peers[name]](const PointSet& s, std::vector<std::int8_t>& out) {
                    peer.classify(s.points, out);
                });
        }
    }
#endif
    for (std::size_t i = 0; i < queries.size(); ++i) {
        add_index(*queries[i], options.depths[i]);
        for (const auto& set : sets) add_query(*queries[i], *set, options.depths[i], options.threads, closest);
    }
    benchmark::RunSpecifiedBenchmarks();
    return 0;
}

}  // namespace
}  // namespace its::bench

int main(int argc, char** argv) {
    return its::bench::guarded(argc, argv,
                               "bench_query MESH [--depths=6,7,8,9] [--boxes=1,10] [--threads=1,2] [--peers=0] "
                               "[Google Benchmark's options]",
                               its::bench::run);
}
