#include <cstddef>
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

/// One of many surfaces: all of them would take seconds for each input.
void extract(const its::ThinShell& shell, unsigned choice) {
    constexpr its::SurfaceSide sides[] = {its::SurfaceSide::outer, its::SurfaceSide::inner,
                                          its::SurfaceSide::zero};
    constexpr int resolutions[] = {0, 3, 20};
    its::extract_surface(shell, {.side = sides[choice % 3],
                                 .resolution = resolutions[choice / 3 % 3],
                                 .coordinates = choice / 9 % 2 == 0 ? its::Coordinates::doubles
                                                                    : its::Coordinates::single_offset,
                                 .max_memory = 256 << 20,
                                 .run = {.threads = 1}});
}

/// The same for the same input, so that a finding can be had again.
unsigned choice(std::span<const std::byte> input) {
    unsigned sum = 0;
    for (const std::byte byte : input) sum = 31 * sum + std::to_integer<unsigned>(byte);
    return sum % 18;
}

}  // namespace

/// What the commands do with a shell that a full load accepts: each ends, in an answer or in an error of ours.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    const auto input = std::as_bytes(std::span(data, size));
    std::vector<std::byte> file(input.begin(), input.end());
    its::shell_file::mend_checksums(file);
    attempt([&] {
        const its::ThinShell shell = its::shell::Access::make(its::shell_file::decode(file));
        attempt([&] { query(shell); });
        attempt([&] { extract(shell, choice(input)); });
        attempt([&] { its::slice(shell, {.size = 16}); });
    });
    return 0;
}
