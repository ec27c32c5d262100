#include "distance/mesh_distance.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "base/parallel.h"
#include "distance/closest_point.h"
#include "distance/searchable.h"
#include "geometry/vec3.h"
#include "mesh/arrays.h"
#include "mesh/scaled.h"

namespace its {
using namespace distance;

namespace {

constexpr std::uint64_t grain = 4096;  // points: below it, a measurement is serial

/// The points that are measured, by number: the vertices, then the samples.
class MeasuredPoints {
public:
    MeasuredPoints(const mesh::Arrays& mesh, std::uint64_t samples)
        : mesh_(mesh), area_before_(mesh.triangles.size() + 1, 0.0), used_(mesh.vertices.size(), false) {
        for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
            const auto& [a, b, c] = mesh.triangles[i];
            const Vec3& p = mesh.vertices[a];
            area_before_[i + 1] = area_before_[i] + norm(cross(mesh.vertices[b] - p, mesh.vertices[c] - p));
            used_[a] = used_[b] = used_[c] = true;
        }
        samples_ = area_before_.back() > 0 ? samples : 0;
    }

    std::uint64_t samples() const { return samples_; }
    std::uint64_t size() const { return used_.size() + samples_; }
    bool is_vertex(std::uint64_t i) const { return i < used_.size(); }
    bool is_used(std::uint64_t vertex) const { return used_[vertex]; }

    /// Sample j of n stands for the j-th of n equal parts of the area. Its place in its triangle is that of
    /// point i in the additive recurrence of the plastic number ρ, (i/ρ, i/ρ²) mod 1, folded into the triangle.
    Vec3 sample(std::uint64_t i) const {
        const double at = area_before_.back() * (double(i - used_.size()) + 0.5) / double(samples_);
        const auto next = std::upper_bound(area_before_.begin() + 1, area_before_.end() - 1, at);
        const auto& [a, b, c] = mesh_.triangles[std::size_t(next - area_before_.begin()) - 1];
        double s = std::fmod(0.7548776662466927 * double(i), 1.0);
        double r = std::fmod(0.5698402909980532 * double(i), 1.0);
        if (s + r > 1) s = 1 - s, r = 1 - r;
        const Vec3& p = mesh_.vertices[a];
        return p + (s * (mesh_.vertices[b] - p) + r * (mesh_.vertices[c] - p));
    }

private:
    mesh::Arrays mesh_;
    std::vector<double> area_before_;  ///< twice the area of the triangles before each
    std::vector<bool> used_;           ///< vertices that some triangle uses
    std::uint64_t samples_ = 0;
};

/// Of points [begin, end): the largest distance, and sums of distances and of squares.
MeshDistance measure(const MeasuredPoints& points, const mesh::Arrays& from, const ClosestPointTree& tree,
                     std::uint64_t begin, std::uint64_t end) {
    MeshDistance part;
    for (std::uint64_t i = begin; i < end; ++i) {
        if (points.is_vertex(i)) {
            if (points.is_used(i))
                part.max = std::max(part.max, std::sqrt(tree.find(from.vertices[i]).squared));
            continue;
        }
        const double squared = tree.find(points.sample(i)).squared, distance = std::sqrt(squared);
        part.max = std::max(part.max, distance);
        part.mean += distance;
        part.root_mean_square += squared;
    }
    return part;
}

/// Sums become means.
void finish(MeshDistance& sums, std::uint64_t samples) {
    if (samples == 0) return;
    sums.mean /= double(samples);
    sums.root_mean_square = std::sqrt(sums.root_mean_square / double(samples));
}

}  // namespace

MeshDistance distance::mesh_distance(const mesh::Arrays& from, const mesh::Arrays& to, std::uint64_t samples,
                                     const Progress& progress) {
    const ClosestPointTree tree(to.vertices, to.triangles);
    const MeasuredPoints points(from, samples);
    Stage stage(progress, "distances", points.size());
    MeshDistance all;
    const auto chunk = [&](std::uint64_t begin, std::uint64_t end) {
        const MeshDistance part = measure(points, from, tree, begin, end);
        stage.advance(end - begin);
        return part;
    };
    fold_chunks(points.size(), grain, chunk, [&](const MeshDistance& part) {
        all.max = std::max(all.max, part.max);
        all.mean += part.mean;
        all.root_mean_square += part.root_mean_square;
    });
    finish(all, points.samples());
    return all;
}

MeshDistance mesh_distance(const MeshView& from, const MeshView& to, std::uint64_t samples, const Run& run) {
    const mesh::Native a(from), b(to);
    require_searchable(a);
    require_searchable(b);
    const geometry::Scaling scaling = geometry::scaling_for(
        std::max(mesh::largest_coordinate(a.arrays()), mesh::largest_coordinate(b.arrays())));
    const mesh::Scaled from_scaled(a, scaling), to_scaled(b, scaling);
    const MeshDistance d = with_threads(run.threads, [&] {
        return mesh_distance(from_scaled.arrays(), to_scaled.arrays(), samples, run.progress);
    });
    return {scaling.out(d.max), scaling.out(d.mean), scaling.out(d.root_mean_square)};
}

}  // namespace its
