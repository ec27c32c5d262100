// Mesh in memory to certified shell, stage by stage. Usage:
//   bench_build MESH[:LOW-HIGH]… [--threads=N] [Google Benchmark's options]
// LOW-HIGH: the depths, 4-9 unless given. bench/build_table.py prints the results as tables.

#include <benchmark/benchmark.h>
#include <fmt/format.h>
#include <algorithm>
#include <ctime>
#include <filesystem>

#include "its/inspect.h"
#include "its/mesh_file.h"
#include "its/shell.h"
#include "main.h"
#ifdef ITS_BENCH_OPENVDB
#include "peer_openvdb.h"
#endif

namespace its::bench {
namespace {

/// Of all threads together: what a build costs on a machine that others use as well.
double processor_seconds() {
    return double(std::clock()) / CLOCKS_PER_SEC;
}

void run_build(benchmark::State& state, const Mesh& mesh, int depth, int threads) {
    BuildOptions options;
    options.depth = depth;
    options.run.threads = threads;
    BuildSeconds best;
    best.total = 1e300;
    double processor = 1e300;
    std::shared_ptr<ThinShell> shell;
    for (auto _ : state) {
        shell.reset();
        const double before = processor_seconds();
        shell = std::make_shared<ThinShell>(build(mesh, options));
        const BuildSeconds& times = shell->build_seconds();
        processor = std::min(processor, processor_seconds() - before);
        state.SetIterationTime(times.total);
        if (times.total < best.total) best = times;
    }
    const ShellInfo& info = shell->info();
    state.counters["triangles"] = double(mesh.triangles.size());
    state.counters["depth"] = depth;
    state.counters["threads"] = threads;
    state.counters["octree"] = best.octree;
    state.counters["distance"] = best.distance;
    state.counters["field"] = best.field;
    state.counters["extrema"] = best.extrema;
    state.counters["total"] = best.total;
    state.counters["processor"] = processor;
    state.counters["surface_cells"] = double(info.surface_cells);
    state.counters["bytes_per_cell"] = double(info.memory_bytes) / double(info.surface_cells);
    state.counters["epsilon_inner"] = info.epsilon_inner / info.scale;
    state.counters["epsilon_outer"] = info.epsilon_outer / info.scale;
    state.counters["thickness"] = info.thickness() / info.scale;
}

#ifdef ITS_BENCH_OPENVDB
void run_openvdb(benchmark::State& state, const Mesh& mesh, double width, int depth, int threads) {
    Mesh scaled = mesh;
    for (Vec3& v : scaled.vertices) v = {v.x / width, v.y / width, v.z / width};
    double processor = 1e300;
    for (auto _ : state) {
        const double before = processor_seconds();
        benchmark::DoNotOptimize(openvdb_mesh_to_volume(scaled, threads));
        processor = std::min(processor, processor_seconds() - before);
    }
    state.counters["processor"] = processor;
    state.counters["triangles"] = double(mesh.triangles.size());
    state.counters["depth"] = depth;
    state.counters["threads"] = threads;
}
#endif

struct Job {
    std::string path;
    int low = 4, high = 9;
};

Job parse(const std::string& text) {
    Job job;
    const auto colon = text.rfind(':');
    job.path = text.substr(0, colon);
    if (colon != std::string::npos && std::sscanf(text.c_str() + colon, ":%d-%d", &job.low, &job.high) != 2)
        throw OptionError(text + ": expected MESH:LOW-HIGH");
    return job;
}

void add(const Job& job, const Mesh& mesh, int threads) {
    const std::string model = std::filesystem::path(job.path).stem().string();
    const Box box = inspect(mesh).bounds;
    [[maybe_unused]] const double side =
        std::max({box.max.x - box.min.x, box.max.y - box.min.y, box.max.z - box.min.z});
    for (int depth = job.low; depth <= job.high; ++depth) {
        benchmark::RegisterBenchmark(fmt::format("its/{}/{}/{}", model, depth, threads).c_str(),
                                     [=, &mesh](benchmark::State& s) { run_build(s, mesh, depth, threads); })
            ->UseManualTime()
            ->Unit(benchmark::kMillisecond);
#ifdef ITS_BENCH_OPENVDB
        benchmark::RegisterBenchmark(fmt::format("openvdb/{}/{}/{}", model, depth, threads).c_str(),
                                     [=, &mesh](benchmark::State& s) {
                                         run_openvdb(s, mesh, side / double(1 << depth), depth, threads);
                                     })
            ->UseRealTime()
            ->Unit(benchmark::kMillisecond);
#endif
    }
}

int run(int argc, char** argv) {
    benchmark::Initialize(&argc, argv);
    std::vector<int> threads;
    std::vector<Job> jobs;
    for (int i = 1; i < argc; ++i) {
        const std::string argument = argv[i];
        if (argument.starts_with("--threads="))
            threads.push_back(std::stoi(argument.substr(10)));
        else if (argument.starts_with("--"))
            refuse(argument);
        else
            jobs.push_back(parse(argument));
    }
    if (threads.empty()) threads = {1, 2};
    std::vector<std::unique_ptr<Mesh>> meshes;
    for (const Job& job : jobs) {
        meshes.push_back(std::make_unique<Mesh>(read_mesh(job.path).mesh));
        for (const int n : threads) add(job, *meshes.back(), n);
    }
    benchmark::RunSpecifiedBenchmarks();
    return 0;
}

}  // namespace
}  // namespace its::bench

int main(int argc, char** argv) {
    return its::bench::guarded(argc, argv,
                               "bench_build MESH[:LOW-HIGH]... [--threads=N] [Google Benchmark's options]",
                               its::bench::run);
}
