#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "its/picture.h"
#include "its/query.h"
#include "its/surface.h"
#include "shell/access.h"
#include "shell_file/shell_file.h"

namespace {

template <class F>
void attempt(F&& what) {
    try {
        what();
    } catch (const its::Error&) {  // anything else is a finding
    }
}

void query(const its::ThinShell& shell) {
    const its::Query query(shell);
    std::vector<its::Vec3> points = shell.mesh().vertices;
    points.push_back(shell.info().root.min);
    std::vector<std::int8_t> sides(points.size());
    std::vector<double> values(points.size());
    query.classify(points, sides);
    query.value(points, values);
    for (const its::Vec3& p : points) (void)query.gradient(p);
}

}  // namespace

/// What the commands do with a shell that a full load accepts: each ends, in an answer or in an error of ours.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    const auto input = std::as_bytes(std::span(data, size));
    std::vector<std::byte> file(input.begin(), input.end());
    its::shell_file::mend_checksums(file);
    attempt([&] {
        const its::ThinShell shell = its::shell::Access::make(its::shell_file::decode(file));
        constexpr std::uint64_t memory = 256 << 20;
        attempt([&] { query(shell); });
        for (const auto side : {its::SurfaceSide::outer, its::SurfaceSide::inner, its::SurfaceSide::zero})
            for (const int resolution : {0, 3, 50})
                for (const auto numbers : {its::Coordinates::doubles, its::Coordinates::single_offset})
                    attempt([&] {
                        its::extract_surface(shell, {.side = side,
                                                     .resolution = resolution,
                                                     .coordinates = numbers,
                                                     .max_memory = memory,
                                                     .run = {.threads = 1}});
                    });
        attempt([&] { its::slice(shell, {.size = 16}); });
    });
    return 0;
}
