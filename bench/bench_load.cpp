// Loading a shell: seconds until load() returns, until a Query is ready, and of the first answer. Usage:
//   bench_load SHELL.its [ROUNDS]
// The file should be in the page cache: the first round shows whether it was.

#include <fmt/format.h>

#include <cstdlib>
#include <exception>
#include <filesystem>

#include "its/query.h"
#include "its/shell_file.h"
#include "its/stopwatch.h"
#include "main.h"

namespace its::bench {
namespace {

void measure(const char* name, const std::filesystem::path& path, const LoadOptions& options) {
    const Stopwatch watch;
    const ThinShell shell = load(path, options);
    const double loaded = watch.seconds();
    const Query query(shell);
    const double ready = watch.seconds();
    const Box& root = shell.info().root;
    const Vec3 centre = {(root.min.x + root.max.x) / 2, (root.min.y + root.max.y) / 2,
                         (root.min.z + root.max.z) / 2};
    const Side side = query.classify(centre);
    const double answered = watch.seconds();
    fmt::print("{:<22}{:>10.2f}{:>10.2f}{:>12.4f}   {}\n", name, 1e3 * loaded, 1e3 * (ready - loaded),
               1e3 * (answered - ready), int(side));
}

int run(int argc, char** argv) {
    fmt::print("{} bytes; milliseconds\n{:<22}{:>10}{:>10}{:>12}   side of the centre\n",
               std::filesystem::file_size(argv[1]), "", "load", "index", "first query");
    for (int rounds = argc > 2 ? std::atoi(argv[2]) : 3; rounds > 0; --rounds) {
        measure("mapped, quick check", argv[1], {.check = LoadCheck::quick, .map = true});
        measure("mapped, full check", argv[1], {.check = LoadCheck::full, .map = true});
        measure("copied, full check", argv[1], {.check = LoadCheck::full, .map = false});
    }
    return 0;
}

}  // namespace
}  // namespace its::bench

int main(int argc, char** argv) {
    return its::bench::guarded(argc, argv, "bench_load SHELL.its [ROUNDS]", its::bench::run);
}
