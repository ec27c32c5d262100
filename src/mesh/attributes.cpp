#include "mesh/attributes.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <string_view>
#include <tuple>

#include "geometry/vec3.h"
#include "mesh/arrays.h"
#include "mesh/stars.h"

namespace its {
using namespace mesh;

namespace {

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

void check_attributes(const MeshView& mesh, const MeshAttributes& attributes) {
    const std::uint64_t triangles = mesh.triangles ? mesh.triangles->count : mesh.vertices.count / 3;
    check_values(attributes.colours, triangles, "colours");
    check_values(attributes.texture, triangles, "texture coordinates");
    check_values(attributes.normals, triangles, "normals");
}

Wedges mesh::wedges_of(std::span<const Triangle> triangles, std::size_t vertices,
                       const MeshAttributes& attributes) {
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

}  // namespace its
