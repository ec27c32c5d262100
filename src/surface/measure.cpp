#include "surface/measure.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "base/parallel.h"
#include "distance/closest_point.h"
#include "geometry/vec3.h"

namespace its {

namespace {

constexpr std::uint64_t triangle_grain = 256;

}  // namespace

double measure_distance(const MeshView& from, const MeshView& to, const Progress& progress) {
    const ClosestPointTree tree(to.vertices, to.triangles);
    Stage stage(progress, "surface distances", from.triangles.size());
    std::vector<double> squared(chunk_count(from.triangles.size(), triangle_grain), 0.0);
    for_chunks(from.triangles.size(), triangle_grain,
               [&](std::uint64_t chunk, std::uint64_t begin, std::uint64_t end) {
                   const auto measure = [&](const Vec3& p) {
                       squared[chunk] = std::max(squared[chunk], tree.find(p).squared);
                   };
                   for (std::uint64_t i = begin; i < end; ++i) {
                       const Triangle& t = from.triangles[i];
                       const Vec3 a = from.vertices[t[0]], b = from.vertices[t[1]], c = from.vertices[t[2]];
                       measure(a);
                       measure(b);
                       measure(c);
                       measure(1.0 / 3 * (a + b + c));
                   }
                   stage.advance(end - begin);
               });
    return std::sqrt(*std::max_element(squared.begin(), squared.end()));
}

}  // namespace its
