#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include "geometry/predicates.h"
#include "geometry/vec3.h"
#include "its/mesh.h"
#include "mesh/points.h"

namespace its {

namespace {

/// The mesh with vertices at identical positions made one: numbers of positions that triangles use.
struct Merged {
    std::vector<Vec3> points;
    std::vector<Triangle> triangles;
};

/// \throws InputError on what inspect() refuses.
Merged merge(const Mesh& mesh) {
    constexpr std::uint32_t unknown = std::numeric_limits<std::uint32_t>::max();
    if (mesh.triangles.empty()) throw InputError("the mesh has no triangles");
    if (mesh.vertices.size() >= unknown) throw InputError("the mesh has more than 4294967294 vertices");
    PointIndex index(std::min(mesh.vertices.size(), 3 * mesh.triangles.size()));
    std::vector<std::uint32_t> number(mesh.vertices.size(), unknown);
    Merged merged;
    merged.triangles.reserve(mesh.triangles.size());
    for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
        Triangle t = mesh.triangles[i];
        for (std::uint32_t& v : t) {
            if (v >= mesh.vertices.size()) {
                throw InputError(fmt::format("triangle {} uses vertex {} of {}", i, v, mesh.vertices.size()));
            }
            if (number[v] == unknown) {
                if (!finite(mesh.vertices[v]))
                    throw InputError(fmt::format("vertex {} is not a finite point", v));
                number[v] = index.insert(mesh.vertices[v]);
            }
            v = number[v];
        }
        merged.triangles.push_back(t);
    }
    merged.points = index.points();
    return merged;
}

/// A triangle that is a segment or point even without a look at coordinates: it connects points, but is no
/// face.
bool repeats_corner(const Triangle& t) {
    return t[0] == t[1] || t[1] == t[2] || t[2] == t[0];
}

/// What is counted about edges; see MeshReport.
struct EdgeCounts {
    std::uint64_t edges = 0, boundary = 0, nonmanifold = 0, inconsistent = 0, unbalanced = 0;
};

/// Counts edges, from the triangles for which `use` holds, none of which repeats a corner. Sorted by
/// their lower end (counting sort), then, within each point's few, by the other.
template <class Use>
EdgeCounts count_edges(const Merged& mesh, Use&& use) {
    std::vector<std::uint64_t> begin(mesh.points.size() + 1);
    const auto for_edges = [&](auto&& fn) {
        for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
            if (!use(i)) continue;
            const Triangle& t = mesh.triangles[i];
            for (std::size_t k = 0; k < 3; ++k) {
                const std::uint32_t a = t[k], b = t[k == 2 ? 0 : k + 1];
                fn(std::min(a, b), std::max(a, b), a < b);
            }
        }
    };
    for_edges([&](std::uint32_t low, std::uint32_t, bool) { ++begin[low + 1]; });
    std::partial_sum(begin.begin(), begin.end(), begin.begin());
    std::vector<std::uint64_t> uses(begin.back());  // the higher end, and in the last bit the direction
    std::vector<std::uint64_t> at(begin.begin(), begin.end() - 1);
    for_edges([&](std::uint32_t low, std::uint32_t high, bool upwards) {
        uses[at[low]++] = std::uint64_t{high} << 1 | std::uint64_t{upwards};
    });
    EdgeCounts counts;
    for (std::size_t low = 0; low + 1 < begin.size(); ++low) {
        std::sort(uses.begin() + std::ptrdiff_t(begin[low]), uses.begin() + std::ptrdiff_t(begin[low + 1]));
        for (std::uint64_t i = begin[low]; i < begin[low + 1];) {
            std::uint64_t down = 0, up = 0;
            for (const std::uint64_t high = uses[i] >> 1; i < begin[low + 1] && uses[i] >> 1 == high; ++i) {
                ++((uses[i] & 1) != 0 ? up : down);
            }
            ++counts.edges;
            counts.boundary += up + down == 1;
            counts.nonmanifold += up + down > 2;
            counts.inconsistent += up + down == 2 && up != down;
            counts.unbalanced += up != down;
        }
    }
    return counts;
}

/// Triangles over the same three positions as an earlier one, in any order and direction.
std::uint64_t count_duplicates(const Merged& mesh) {
    // Only triangles with the same lowest corner can be the same.
    std::vector<std::uint64_t> begin(mesh.points.size() + 1);
    for (const Triangle& t : mesh.triangles) {
        if (!repeats_corner(t)) ++begin[std::min({t[0], t[1], t[2]}) + std::size_t{1}];
    }
    std::partial_sum(begin.begin(), begin.end(), begin.begin());
    std::vector<std::uint64_t> others(begin.back());  // the middle corner, the highest
    std::vector<std::uint64_t> at(begin.begin(), begin.end() - 1);
    for (Triangle t : mesh.triangles) {
        if (repeats_corner(t)) continue;
        std::sort(t.begin(), t.end());
        others[at[t[0]]++] = std::uint64_t{t[1]} << 32 | t[2];
    }
    std::uint64_t duplicates = 0;
    for (std::size_t low = 0; low + 1 < begin.size(); ++low) {
        const auto first = others.begin() + std::ptrdiff_t(begin[low]),
                   last = others.begin() + std::ptrdiff_t(begin[low + 1]);
        std::sort(first, last);
        duplicates += std::uint64_t(last - std::unique(first, last));
    }
    return duplicates;
}

/// Sets of points that triangles connect (union by index, path halving).
std::uint64_t count_components(const Merged& mesh) {
    std::vector<std::uint32_t> parent(mesh.points.size());
    std::iota(parent.begin(), parent.end(), std::uint32_t{0});
    const auto root = [&](std::uint32_t v) {
        while (parent[v] != v) v = parent[v] = parent[parent[v]];
        return v;
    };
    std::uint64_t components = mesh.points.size();
    for (const Triangle& t : mesh.triangles) {
        for (std::size_t k = 1; k < 3; ++k) {
            const std::uint32_t a = root(t[0]), b = root(t[k]);
            if (a == b) continue;
            parent[std::max(a, b)] = std::min(a, b);
            --components;
        }
    }
    return components;
}

Box bounds_of(const std::vector<Vec3>& points) {
    Box box{points.front(), points.front()};
    for (const Vec3& p : points) {
        for (int axis = 0; axis < 3; ++axis) {
            box.min[axis] = std::min(box.min[axis], p[axis]);
            box.max[axis] = std::max(box.max[axis], p[axis]);
        }
    }
    return box;
}

double volume_of(const Merged& mesh, const Box& box) {
    const Vec3 centre = 0.5 * box.min + 0.5 * box.max;
    double sum = 0;
    for (const Triangle& t : mesh.triangles) {
        const Vec3 a = mesh.points[t[0]] - centre, b = mesh.points[t[1]] - centre,
                   c = mesh.points[t[2]] - centre;
        sum += dot(a, cross(b, c));
    }
    return sum / 6;
}

void choose_sign(MeshReport& report) {
    if (report.degenerate == report.triangles) {
        report.sign = SignRule::unsigned_rule;
        report.sign_reason = "every triangle has zero area, so nothing can be inside";
    } else if (report.unbalanced_edges == 0) {
        report.sign = SignRule::winding;
        report.sign_reason =
            "every edge is used as often in one direction as in the other, so winding numbers are defined";
        if (report.signed_volume < 0) {
            report.sign_reason +=
                "; but the mesh is inside out (its signed volume is negative): flip its triangles";
        }
    } else {
        report.sign = SignRule::unsigned_rule;
        report.sign_reason = fmt::format(
            "{} edges are not used equally often in both directions ({} have one triangle only), so there is "
            "no inside "
            "without filling holes; for now such a mesh is built unsigned",
            report.unbalanced_edges, report.boundary_edges);
    }
}

}  // namespace

std::string_view name(SignRule rule) {
    switch (rule) {
        case SignRule::winding:
            return "winding";
        case SignRule::generalized:
            return "generalized";
        case SignRule::unsigned_rule:
            break;
    }
    return "unsigned";
}

MeshReport inspect(const Mesh& mesh) {
    const Merged merged = merge(mesh);
    MeshReport report;
    report.vertices = merged.points.size();
    report.triangles = merged.triangles.size();
    std::vector<bool> degenerate(merged.triangles.size());
    std::uint64_t faces = 0;
    for (std::size_t i = 0; i < merged.triangles.size(); ++i) {
        const Triangle& t = merged.triangles[i];
        const bool repeats = repeats_corner(t);
        degenerate[i] = repeats || is_degenerate(merged.points[t[0]], merged.points[t[1]], merged.points[t[2]]);
        faces += !repeats;
        report.degenerate += degenerate[i];
    }
    report.duplicate = count_duplicates(merged);
    const EdgeCounts edges =
        count_edges(merged, [&](std::size_t i) { return !repeats_corner(merged.triangles[i]); });
    report.boundary_edges = edges.boundary;
    report.nonmanifold_edges = edges.nonmanifold;
    report.inconsistent_edges = edges.inconsistent;
    report.unbalanced_edges = edges.unbalanced;
    if (edges.unbalanced > 0 && report.degenerate > 0) {
        // Zero-area triangles have no winding number of their own: they may close cracks, but never open one.
        const EdgeCounts without = count_edges(merged, [&](std::size_t i) { return !degenerate[i]; });
        report.unbalanced_edges = std::min(report.unbalanced_edges, without.unbalanced);
    }
    report.components = count_components(merged);
    report.euler = std::int64_t(report.vertices) - std::int64_t(edges.edges) + std::int64_t(faces);
    report.closed = report.boundary_edges == 0;
    report.oriented = report.inconsistent_edges == 0;
    report.bounds = bounds_of(merged.points);
    report.signed_volume = volume_of(merged, report.bounds);
    choose_sign(report);
    return report;
}

}  // namespace its
