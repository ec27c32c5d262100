// Loading a shell: seconds until load() returns, until a Query is ready, and of the first answer. Usage:
//   bench_load SHELL.its [ROUNDS]
// The file should be in the page cache: the first round shows whether it was.

#include <fmt/format.h>

#include <chrono>
#include <cstdlib>
#include <exception>
#include <filesystem>

#include "its/query.h"
#include "its/shell_file.h"
#include "main.h"

namespace its::bench {
namespace {

using Clock = std::chrono::steady_clock;

double milliseconds(Clock::time_point from, Clock::time_point to) {
    return std::chrono::duration<double, std::milli>(to - from).count();
}

void measure(const char* name, const std::filesystem::path& path, const LoadOptions& options) {
    const auto begin = Clock::now();
    const ThinShell shell = load(path, options);
    const auto loaded = Clock::now();
    const Query query(shell);
    const auto ready = Clock::now();
    const Box& root = shell.info().root;
    const Vec3 centre = {(root.min.x + root.max.x) / 2, (root.min.y + root.max.y) / 2,
                         (root.min.z + root.max.z) / 2};
    const Side side = query.classify(centre);
    const auto answered = Clock::now();
    fmt::print("{:<22}{:>10.2f}{:>10.2f}{:>12.4f}   {}\n", name, milliseconds(begin, loaded),
               milliseconds(loaded, ready), milliseconds(ready, answered), int(side));
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
