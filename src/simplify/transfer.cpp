#include "simplify/transfer.h"

#include <algorithm>
#include <limits>
#include <numeric>
#include <optional>

#include "geometry/vec3.h"
#include "mesh/arrays.h"
#include "mesh/normals.h"
#include "mesh/point_index.h"

namespace its::simplifier {

namespace {

/// Degrees from which an edge looks sharp.
constexpr double crease = 45;

/// Barycentric coordinates of the point of a triangle that is nearest to p, by the region of its plane that p
/// is over (Ericson, Real-Time Collision Detection, 5.1.5).
std::array<double, 3> nearest_in(const Vec3& p, const Vec3& a, const Vec3& b, const Vec3& c) {
    const Vec3 ab = b - a, ac = c - a, ap = p - a, bp = p - b, cp = p - c;
    const double d1 = dot(ab, ap), d2 = dot(ac, ap), d3 = dot(ab, bp), d4 = dot(ac, bp), d5 = dot(ab, cp),
                 d6 = dot(ac, cp);
    if (d1 <= 0 && d2 <= 0) return {1, 0, 0};
    if (d3 >= 0 && d4 <= d3) return {0, 1, 0};
    if (d6 >= 0 && d5 <= d6) return {0, 0, 1};
    const double vc = d1 * d4 - d3 * d2, vb = d5 * d2 - d1 * d6, va = d3 * d6 - d5 * d4;
    if (vc <= 0 && d1 >= 0 && d3 <= 0) return {1 - d1 / (d1 - d3), d1 / (d1 - d3), 0};
    if (vb <= 0 && d2 >= 0 && d6 <= 0) return {1 - d2 / (d2 - d6), 0, d2 / (d2 - d6)};
    if (va <= 0 && d4 - d3 >= 0 && d5 - d6 >= 0) {
        const double w = (d4 - d3) / ((d4 - d3) + (d5 - d6));
        return {0, 1 - w, w};
    }
    const double sum = va + vb + vc;
    if (!(sum > 0)) return {1, 0, 0};  // no area
    return {1 - vb / sum - vc / sum, vb / sum, vc / sum};
}

/// Σ weights · values of the triangle's corners; equal values stay what they are.
template <class Value>
Value interpolated(const CornerValues<Value>& of, std::uint32_t t, const std::array<double, 3>& weights) {
    Value sum{};
    for (std::size_t i = 0; i < sum.size(); ++i) {
        const double a = of.at(t, 0)[i];
        const double x = a + weights[1] * (of.at(t, 1)[i] - a) + weights[2] * (of.at(t, 2)[i] - a);
        sum[i] = typename Value::value_type(x);
    }
    return sum;
}

/// Numbers of positions instead of vertices.
std::vector<Triangle> by_position(const mesh::Arrays& mesh) {
    mesh::PointIndex index(mesh.vertices.size());
    std::vector<Triangle> triangles(mesh.triangles.begin(), mesh.triangles.end());
    for (Triangle& t : triangles)
        for (std::uint32_t& v : t) v = index.insert(mesh.vertices[v]);
    return triangles;
}

}  // namespace

AttributeTransfer::AttributeTransfer(const mesh::Arrays& mesh, const MeshAttributes& attributes)
    : mesh_(mesh), attributes_(attributes) {
    if (attributes.empty()) return;
    const std::vector<Triangle> triangles = by_position(mesh);
    if (!attributes.normals.empty()) {
        std::uint32_t positions = 0;
        for (const Triangle& t : triangles) positions = std::max({positions, t[0] + 1, t[1] + 1, t[2] + 1});
        const MeshAttributes normals{{}, {}, attributes.normals, false};
        split_normals_ = mesh::wedges_of(triangles, positions, normals).first.size() > positions;
    }
    if (attributes.colours.empty() && attributes.texture.empty()) return;
    wedges_ =
        mesh::wedges_of(triangles, mesh.vertices.size(), {attributes.colours, attributes.texture, {}, false});
    begin_.assign(wedges_.first.size() + 1, 0);
    for (const Triangle& t : wedges_.triangles)
        for (const std::uint32_t w : t) ++begin_[w + std::size_t{1}];
    std::partial_sum(begin_.begin(), begin_.end(), begin_.begin());
    around_.resize(begin_.back());
    std::vector<std::uint64_t> next(begin_.begin(), begin_.end() - 1);
    for (std::size_t t = 0; t < wedges_.triangles.size(); ++t)
        for (const std::uint32_t w : wedges_.triangles[t]) around_[next[w]++] = std::uint32_t(t);
}

void AttributeTransfer::try_triangle(std::uint32_t t, const Vec3& p, Place& best) const {
    const auto& [i, j, k] = mesh_.triangles[t];
    const Vec3 &a = mesh_.vertices[i], &b = mesh_.vertices[j], &c = mesh_.vertices[k];
    const std::array<double, 3> weights = nearest_in(p, a, b, c);
    const Vec3 d = p - (a + weights[1] * (b - a) + weights[2] * (c - a));
    if (dot(d, d) < best.squared) best = {dot(d, d), t, weights};
}

void AttributeTransfer::look_around(std::uint32_t wedge, const Vec3& p, Place& best) const {
    for (std::uint64_t i = begin_[wedge]; i < begin_[wedge + std::size_t{1}]; ++i)
        try_triangle(around_[i], p, best);
}

/// The wedges that each wedge is made of now.
std::vector<std::vector<std::uint32_t>> AttributeTransfer::members_of(const Complex& current) const {
    std::vector<std::vector<std::uint32_t>> members(wedges_.first.size());
    std::vector<std::uint32_t> root(wedges_.first.size());
    std::iota(root.begin(), root.end(), 0u);
    for (std::uint32_t w = 0; w < root.size(); ++w) {
        std::uint32_t r = w;
        while (current.merged_into(r) != r) r = current.merged_into(r);
        members[r].push_back(w);
    }
    return members;
}

/// Where on the mesh the corner of the current mesh takes its values: at the wedge itself if it has not moved;
/// else at the nearest point of the triangles around the wedges that became this one, and from there downhill
/// from neighbour to neighbour. Neighbours share a wedge, so that no step crosses a seam.
AttributeTransfer::Place AttributeTransfer::place_of(std::uint32_t wedge, std::uint32_t t, std::uint32_t k,
                                                     const Complex& current,
                                                     std::span<const std::uint32_t> members) const {
    const std::uint32_t v = current.triangle(t)[k];
    const std::uint64_t first = wedges_.first[wedge];
    const auto triangle = std::uint32_t(first / 3);
    const Vec3& p = current.position(v);
    if (current.rank(v) == 2 || current.on_seam(v) ||
        p == mesh_.vertices[mesh_.triangles[triangle][first % 3]]) {
        Place own{0, triangle, {0, 0, 0}};
        own.weights[first % 3] = 1;
        return own;
    }
    Place best{std::numeric_limits<double>::infinity(), triangle, {1, 0, 0}};
    for (const std::uint32_t member : members) look_around(member, p, best);
    for (double before = std::numeric_limits<double>::infinity(); best.squared < before;) {
        before = best.squared;
        for (const std::uint32_t w : Triangle(wedges_.triangles[best.triangle])) look_around(w, p, best);
    }
    return best;
}

MeshAttributes AttributeTransfer::attributes_of(const Complex& current, const mesh::Arrays& result) const {
    MeshAttributes attributes;
    attributes.byte_colours = attributes_.byte_colours;
    if (!attributes_.normals.empty())
        attributes.normals = mesh::vertex_normals(result.vertices, result.triangles,
                                                  split_normals_ ? std::optional(crease) : std::nullopt);
    if (wedges_.first.empty()) return attributes;
    const auto members = members_of(current);
    std::vector<std::uint32_t> number(wedges_.first.size(), no_index);
    std::vector<Triangle> corners;
    std::uint32_t count = 0;
    for (std::uint32_t t = 0; t < current.triangles(); ++t) {
        if (!current.has_triangle(t)) continue;
        Triangle& values = corners.emplace_back();
        for (std::uint32_t k = 0; k < 3; ++k) {
            const std::uint32_t w = current.wedge(t, k);
            if (number[w] == no_index) {
                number[w] = count++;
                const Place place = place_of(w, t, k, current, members[w]);
                if (!attributes_.colours.empty())
                    attributes.colours.values.push_back(
                        interpolated(attributes_.colours, place.triangle, place.weights));
                if (!attributes_.texture.empty())
                    attributes.texture.values.push_back(
                        interpolated(attributes_.texture, place.triangle, place.weights));
            }
            values[k] = number[w];
        }
    }
    if (!attributes_.colours.empty()) attributes.colours.corners = corners;
    if (!attributes_.texture.empty()) attributes.texture.corners = corners;
    return attributes;
}

}  // namespace its::simplifier
