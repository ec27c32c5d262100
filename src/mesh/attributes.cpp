#include "mesh/attributes.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <numeric>
#include <string_view>
#include <tuple>

#include "geometry/vec3.h"

namespace its {

namespace {

/// The cosine of the angle from which an edge looks sharp: 45°.
constexpr double crease_cosine = std::numbers::sqrt2 / 2;

template <class Array>
bool is_finite(const Array& numbers) {
    return std::all_of(numbers.begin(), numbers.end(), [](auto x) { return std::isfinite(x); });
}
bool is_finite(const Vec3& v) {
    return finite(v);
}

template <class Value>
void check_values(const CornerValues<Value>& of, std::size_t triangles, std::string_view what) {
    if (!of.empty() && of.corners.size() != triangles)
        throw InputError(
            fmt::format("{} for {} triangles, but the mesh has {}", what, of.corners.size(), triangles));
    for (std::size_t i = 0; i < of.values.size(); ++i)
        if (!is_finite(of.values[i])) throw InputError(fmt::format("{}: value {} is not finite", what, i));
    for (std::size_t t = 0; t < of.corners.size(); ++t)
        for (const std::uint32_t value : of.corners[t])
            if (value >= of.values.size())
                throw InputError(
                    fmt::format("{}: triangle {} uses value {} of {}", what, t, value, of.values.size()));
}

/// The corners 3t + k at each vertex: corner[first[v] … first[v + 1]), ascending.
struct Stars {
    std::vector<std::uint64_t> first, corner;

    Stars(std::span<const Triangle> triangles, std::size_t vertices)
        : first(vertices + 1), corner(3 * triangles.size()) {
        for (const Triangle& t : triangles)
            for (const std::uint32_t v : t) ++first[v + std::size_t{1}];
        std::partial_sum(first.begin(), first.end(), first.begin());
        std::vector<std::uint64_t> next(first.begin(), first.end() - 1);
        for (std::size_t c = 0; c < corner.size(); ++c) corner[next[triangles[c / 3][c % 3]]++] = c;
    }
    std::span<std::uint64_t> at(std::size_t v) {
        return {corner.data() + first[v], std::size_t(first[v + 1] - first[v])};
    }
};

template <class Value>
int compare(const CornerValues<Value>& of, std::uint64_t a, std::uint64_t b) {
    if (of.empty()) return 0;
    const Value &p = of.at(a / 3, a % 3), &q = of.at(b / 3, b % 3);
    const auto key = [](const auto& v) {
        if constexpr (requires { v.x; })
            return std::array{v.x, v.y, v.z};
        else
            return v;
    };
    return key(p) < key(q) ? -1 : key(q) < key(p) ? 1 : 0;
}

}  // namespace

void check_attributes(const Mesh& mesh, const MeshAttributes& attributes) {
    check_values(attributes.colours, mesh.triangles.size(), "colours");
    check_values(attributes.texture, mesh.triangles.size(), "texture coordinates");
    check_values(attributes.normals, mesh.triangles.size(), "normals");
}

Wedges wedges_of(std::span<const Triangle> triangles, std::size_t vertices, const MeshAttributes& attributes) {
    const auto order = [&](std::uint64_t a, std::uint64_t b) {
        const int colour = compare(attributes.colours, a, b);
        if (colour != 0) return colour;
        const int texture = compare(attributes.texture, a, b);
        return texture != 0 ? texture : compare(attributes.normals, a, b);
    };
    Wedges wedges;
    wedges.triangles.resize(triangles.size());
    Stars stars(triangles, vertices);
    std::vector<std::uint64_t> first_of_group;
    for (std::size_t v = 0; v < vertices; ++v) {
        const std::span<std::uint64_t> corners = stars.at(v);
        // Equal ones side by side, ascending; then the groups by their first.
        std::sort(corners.begin(), corners.end(), [&](std::uint64_t a, std::uint64_t b) {
            const int o = order(a, b);
            return o != 0 ? o < 0 : a < b;
        });
        first_of_group.clear();
        for (std::size_t i = 0; i < corners.size(); ++i)
            if (i == 0 || order(corners[i - 1], corners[i]) != 0) first_of_group.push_back(corners[i]);
        std::sort(first_of_group.begin(), first_of_group.end());
        std::uint32_t number = 0;
        for (std::size_t i = 0; i < corners.size(); ++i) {
            if (i == 0 || order(corners[i - 1], corners[i]) != 0) {
                const auto place = std::lower_bound(first_of_group.begin(), first_of_group.end(), corners[i]);
                number = std::uint32_t(wedges.first.size() + std::size_t(place - first_of_group.begin()));
            }
            wedges.triangles[corners[i] / 3][corners[i] % 3] = number;
        }
        wedges.first.insert(wedges.first.end(), first_of_group.begin(), first_of_group.end());
    }
    return wedges;
}

CornerValues<Vec3> vertex_normals(const Mesh& mesh, bool creases) {
    std::vector<Vec3> unit(mesh.triangles.size());
    for (std::size_t t = 0; t < unit.size(); ++t) {
        const auto& [a, b, c] = mesh.triangles[t];
        const Vec3 n = cross(mesh.vertices[b] - mesh.vertices[a], mesh.vertices[c] - mesh.vertices[a]);
        const double length = norm(n);
        if (length > 0 && std::isfinite(length)) unit[t] = (1 / length) * n;
    }
    const auto angle = [&](std::uint64_t corner) {
        const Triangle& t = mesh.triangles[corner / 3];
        const Vec3& p = mesh.vertices[t[corner % 3]];
        const Vec3 a = mesh.vertices[t[(corner % 3 + 1) % 3]] - p,
                   b = mesh.vertices[t[(corner % 3 + 2) % 3]] - p;
        return std::atan2(norm(cross(a, b)), dot(a, b));
    };
    CornerValues<Vec3> normals;
    normals.corners.resize(mesh.triangles.size());
    Stars stars(mesh.triangles, mesh.vertices.size());
    for (std::size_t v = 0; v < mesh.vertices.size(); ++v) {
        const std::span<const std::uint64_t> corners = stars.at(v);
        const std::size_t begin = normals.values.size();
        for (const std::uint64_t own : corners) {
            if (creases || own == corners.front()) {
                Vec3 sum;
                for (const std::uint64_t c : corners)
                    if (!creases || dot(unit[own / 3], unit[c / 3]) >= crease_cosine || c == own)
                        sum = sum + angle(c) * unit[c / 3];
                const double length = norm(sum);
                const Vec3 normal = length > 0 ? (1 / length) * sum : Vec3{0, 0, 1};
                const auto same =
                    std::find(normals.values.begin() + std::ptrdiff_t(begin), normals.values.end(), normal);
                normals.corners[own / 3][own % 3] = std::uint32_t(same - normals.values.begin());
                if (same == normals.values.end()) normals.values.push_back(normal);
            } else {
                normals.corners[own / 3][own % 3] = std::uint32_t(begin);
            }
        }
    }
    return normals;
}

}  // namespace its
