#include "mesh/normals.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>
#include <utility>
#include <vector>

#include "geometry/vec3.h"
#include "mesh/stars.h"

namespace its::mesh {

namespace {

/// The angle of a triangle at its corner k.
double angle_at(std::span<const Vec3> vertices, const Triangle& t, std::size_t k) {
    const Vec3 a = vertices[t[(k + 1) % 3]] - vertices[t[k]], b = vertices[t[(k + 2) % 3]] - vertices[t[k]];
    return std::atan2(norm(cross(a, b)), dot(a, b));
}

/// Puts the corners of a vertex together that edges connect which are not sharp.
class Groups {
public:
    Groups(std::span<const Triangle> triangles, std::span<const Vec3> unit, double least_cosine)
        : triangles_(triangles), unit_(unit), least_cosine_(least_cosine) {}

    /// For each corner the first of its group, as places in the list.
    const std::vector<std::size_t>& operator()(std::span<const std::uint64_t> corners) {
        root_.resize(corners.size());
        std::iota(root_.begin(), root_.end(), std::size_t{0});
        end_.clear();
        for (std::size_t i = 0; i < corners.size(); ++i) {
            const Triangle& t = triangles_[corners[i] / 3];
            for (const std::size_t k : {1, 2}) end_.emplace_back(t[(corners[i] + k) % 3], i);
        }
        // Edges that meet in their other end are one edge; in a mesh that is a manifold, of two triangles.
        std::sort(end_.begin(), end_.end());
        for (std::size_t e = 1; e < end_.size(); ++e) {
            const auto& [end, i] = end_[e - 1];
            const auto& [other, j] = end_[e];
            if (end == other && dot(unit_[corners[i] / 3], unit_[corners[j] / 3]) >= least_cosine_) join(i, j);
        }
        for (std::size_t i = 0; i < root_.size(); ++i) root_[i] = root(i);
        return root_;
    }

private:
    std::size_t root(std::size_t i) {
        while (root_[i] != i) i = root_[i] = root_[root_[i]];
        return i;
    }
    void join(std::size_t i, std::size_t j) {
        const auto [first, second] = std::minmax({root(i), root(j)});
        root_[second] = first;
    }

    std::span<const Triangle> triangles_;
    std::span<const Vec3> unit_;
    double least_cosine_;
    std::vector<std::pair<std::uint32_t, std::size_t>> end_;
    std::vector<std::size_t> root_;
};

}  // namespace

ITS_API Vec3 area_vector(std::span<const Vec3> vertices, const Triangle& t) {
    const Vec3& a = vertices[t[0]];
    return cross(vertices[t[1]] - a, vertices[t[2]] - a);
}

ITS_API CornerValues<Vec3> vertex_normals(std::span<const Vec3> vertices, std::span<const Triangle> triangles,
                                          std::optional<double> crease) {
    std::vector<Vec3> unit(triangles.size());
    for (std::size_t t = 0; t < unit.size(); ++t) {
        const Vec3 n = area_vector(vertices, triangles[t]);
        const double length = norm(n);
        if (length > 0 && std::isfinite(length)) unit[t] = (1 / length) * n;
    }
    CornerValues<Vec3> normals;
    normals.corners.resize(triangles.size());
    Stars stars(triangles, vertices.size());
    Groups groups(triangles, unit, crease ? std::cos(*crease * std::numbers::pi / 180) : -2);
    std::vector<std::size_t> all;
    std::vector<Vec3> sum;
    for (std::size_t v = 0; v < vertices.size(); ++v) {
        const std::span<const std::uint64_t> corners = stars.at(v);
        if (!crease) all.assign(corners.size(), 0);
        const std::vector<std::size_t>& group = crease ? groups(corners) : all;
        sum.assign(corners.size(), {});
        for (std::size_t i = 0; i < corners.size(); ++i) {
            const std::uint64_t t = corners[i] / 3;
            sum[group[i]] = sum[group[i]] + angle_at(vertices, triangles[t], corners[i] % 3) * unit[t];
        }
        for (std::size_t i = 0; i < corners.size(); ++i) {
            std::uint32_t& number = normals.corners[corners[i] / 3][corners[i] % 3];
            if (group[i] != i) {  // after the first of its group
                const std::uint64_t first = corners[group[i]];
                number = normals.corners[first / 3][first % 3];
                continue;
            }
            const double length = norm(sum[i]);
            number = std::uint32_t(normals.values.size());
            normals.values.push_back(length > 0 ? (1 / length) * sum[i] : Vec3{0, 0, 1});
        }
    }
    return normals;
}

}  // namespace its::mesh
