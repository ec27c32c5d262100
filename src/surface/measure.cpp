#include "surface/measure.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "base/parallel.h"
#include "base/simd.h"
#include "distance/triangle_tree.h"
#include "geometry/vec3.h"

namespace its {

namespace {

constexpr std::uint64_t triangle_grain = 4096;

std::vector<Vec3> lattice_positions(const Mesh& mesh, const Lattice& lattice) {
    std::vector<Vec3> positions(mesh.vertices.size());
    parallel_for(positions.size(), triangle_grain,
                 [&](std::uint64_t i) { positions[i] = lattice.to_lattice(mesh.vertices[i]); });
    return positions;
}

/// The least squared distance from a point to the triangles of a block.
ITS_CLONES double squared_distance_to_block(const TriangleTree::Block& block, double x, double y, double z) {
    double squared[TriangleTree::arity];
    for (std::uint64_t i = 0; i < TriangleTree::arity; ++i) squared[i] = squared_distance(block, i, x, y, z);
    return *std::min_element(squared, squared + TriangleTree::arity);
}

/// The largest distance of many points to one tree. Most points are settled by the first triangle that is
/// nearer than the largest distance so far, which is likely to be near the last such one.
class FarthestPoint {
public:
    explicit FarthestPoint(const TriangleTree& tree) : tree_(tree) {}

    void include(const Vec3& p) {
        best_ = squared_distance_to_block(tree_.block[near_], p.x, p.y, p.z);
        if (best_ > farthest_) search(p, int(tree_.levels.size()) - 1, 0, tree_.levels.back().size());
        farthest_ = std::max(farthest_, best_);
    }
    double distance() const { return std::sqrt(farthest_); }

private:
    struct Near {
        double distance;
        std::uint64_t node;
    };

    /// Visits nodes [begin, end) of a level, at most `arity` of them, nearest first. Returns true once the
    /// point is known not to be the farthest.
    bool search(const Vec3& p, int level, std::uint64_t begin, std::uint64_t end) {
        if (level == 0) {
            const std::uint64_t block = begin / TriangleTree::arity;
            const double squared = squared_distance_to_block(tree_.block[block], p.x, p.y, p.z);
            if (squared < best_) {
                best_ = squared;
                near_ = block;
            }
            return best_ <= farthest_;
        }
        const TriangleTree::Spheres& spheres = tree_.levels[std::size_t(level)];
        Near order[TriangleTree::arity];
        int count = 0;
        for (std::uint64_t node = begin; node < end; ++node) {
            const Vec3 centre{spheres.x[node], spheres.y[node], spheres.z[node]};
            const Near near{norm(p - centre) - spheres.radius[node], node};
            int at = count++;
            for (; at > 0 && order[at - 1].distance > near.distance; --at) order[at] = order[at - 1];
            order[at] = near;
        }
        const std::uint64_t below = tree_.levels[std::size_t(level) - 1].size();
        for (int i = 0; i < count; ++i) {
            if (order[i].distance > 0 && order[i].distance * order[i].distance >= best_) return false;
            const std::uint64_t first = order[i].node * TriangleTree::arity;
            if (first >= below) continue;  // padding
            if (search(p, level - 1, first, std::min(below, first + TriangleTree::arity))) return true;
        }
        return false;
    }

    const TriangleTree& tree_;
    std::uint64_t near_ = 0;
    double best_ = 0, farthest_ = 0;
};

}  // namespace

double measure_distance(const Mesh& from, const Mesh& to, const Lattice& lattice, const Progress& progress) {
    const std::vector<Vec3> points = lattice_positions(from, lattice);
    const TriangleTree tree = make_triangle_tree(lattice_positions(to, lattice), to.triangles, lattice.cells());
    Stage stage(progress, "surface distances", from.triangles.size());
    std::vector<double> parts(chunk_count(from.triangles.size(), triangle_grain), 0.0);
    for_chunks(from.triangles.size(), triangle_grain,
               [&](std::uint64_t chunk, std::uint64_t begin, std::uint64_t end) {
                   FarthestPoint farthest(tree);
                   for (std::uint64_t i = begin; i < end; ++i) {
                       const Triangle& t = from.triangles[i];
                       for (const std::uint32_t v : t) farthest.include(points[v]);
                       farthest.include((1.0 / 3.0) * (points[t[0]] + points[t[1]] + points[t[2]]));
                   }
                   parts[chunk] = farthest.distance();
                   stage.advance(end - begin);
               });
    return lattice.width * *std::max_element(parts.begin(), parts.end());
}

}  // namespace its
