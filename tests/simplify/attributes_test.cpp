// Colours, texture coordinates and normals through simplification.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <set>

#include "geometry/vec3.h"
#include "its/distance.h"
#include "its/inspect.h"
#include "its/simplify.h"
#include "mesh/normals.h"
#include "simplify/complex.h"
#include "simplify/transfer.h"
#include "support/zoo.h"

namespace its {
namespace {

constexpr double pi = std::numbers::pi;

struct Painted {
    Mesh mesh;
    MeshAttributes attributes;
};

/// A tube of n × m quads around z, unrolled into the unit square: u once around, v along. The seam is the line
/// at angle 0, where u is 0 on one side and 1 on the other. Open at both ends.
Painted tube(int n, int m) {
    Painted p;
    CornerValues<TexturePoint>& uv = p.attributes.texture;
    for (int j = 0; j <= m; ++j)
        for (int i = 0; i <= n; ++i) {
            const double angle = 2 * pi * (i % n) / n;
            if (i < n) p.mesh.vertices.push_back({std::cos(angle), std::sin(angle), 4.0 * j / m});
            uv.values.push_back({double(i) / n, double(j) / m});
        }
    const auto vertex = [&](int i, int j) { return std::uint32_t(j * n + i % n); };
    const auto value = [&](int i, int j) { return std::uint32_t(j * (n + 1) + i); };
    for (int j = 0; j < m; ++j)
        for (int i = 0; i < n; ++i) {
            p.mesh.triangles.push_back({vertex(i, j), vertex(i + 1, j), vertex(i + 1, j + 1)});
            p.mesh.triangles.push_back({vertex(i, j), vertex(i + 1, j + 1), vertex(i, j + 1)});
            uv.corners.push_back({value(i, j), value(i + 1, j), value(i + 1, j + 1)});
            uv.corners.push_back({value(i, j), value(i + 1, j + 1), value(i, j + 1)});
        }
    return p;
}

/// A cube, each face of n × n quads a chart of its own: charts are 2 apart in u.
Painted cube(int n) {
    Painted p;
    for (int axis = 0; axis < 3; ++axis)
        for (int side = 0; side < 2; ++side) {
            const int chart = 2 * axis + side;
            const auto begin = std::uint32_t(p.mesh.vertices.size());
            for (int i = 0; i <= n; ++i)
                for (int j = 0; j <= n; ++j) {
                    Vec3 v;
                    v[axis] = side;
                    v[(axis + 1) % 3] = double(i) / n;
                    v[(axis + 2) % 3] = double(j) / n;
                    p.mesh.vertices.push_back(v);
                    p.attributes.texture.values.push_back({2.0 * chart + double(i) / n, double(j) / n});
                }
            const auto at = [&](int i, int j) { return begin + std::uint32_t(i * (n + 1) + j); };
            for (int i = 0; i < n; ++i)
                for (int j = 0; j < n; ++j) {
                    Triangle a{at(i, j), at(i + 1, j), at(i + 1, j + 1)},
                        b{at(i, j), at(i + 1, j + 1), at(i, j + 1)};
                    if (side == 0) std::swap(a[1], a[2]), std::swap(b[1], b[2]);
                    p.mesh.triangles.push_back(a);
                    p.mesh.triangles.push_back(b);
                }
        }
    p.attributes.texture.corners = p.mesh.triangles;
    return p;
}

std::vector<SimplifyOptions> all_methods(std::uint64_t faces) {
    return {{.method = SimplifyMethod::qem, .faces = faces},
            {.faces = faces},
            {.method = SimplifyMethod::vertex, .faces = faces, .depth = 5},
            {.method = SimplifyMethod::priority, .faces = faces, .depth = 5}};
}

TEST(SimplifyAttributes, AStraightSeamStaysWhereItIs) {
    const int n = 48;
    const Painted p = tube(n, 40);
    for (const SimplifyOptions& options : all_methods(400)) {
        SCOPED_TRACE(int(options.method));
        const Simplified s = simplify(p.mesh, p.attributes, options);
        check_attributes(s.mesh, s.attributes);
        EXPECT_LE(s.report.faces_after, 400u);
        EXPECT_EQ(s.report.seam_edges_before, 40u);
        EXPECT_GE(s.report.seam_edges_after, 1u);
        EXPECT_LT(s.report.seam_edges_after, 40u);
        double seam_length = 0, error = 0;
        for (std::size_t t = 0; t < s.mesh.triangles.size(); ++t) {
            double low = 1, high = 0;
            for (std::size_t k = 0; k < 3; ++k) {
                const Vec3& v = s.mesh.vertices[s.mesh.triangles[t][k]];
                const auto [u, w] = s.attributes.texture.at(t, k);
                low = std::min(low, u), high = std::max(high, u);
                EXPECT_GE(std::min(u, w), 0);
                EXPECT_LE(std::max(u, w), 1);
                if (u == 0 || u == 1) {
                    EXPECT_EQ(v.y, 0);
                    EXPECT_EQ(v.x, 1);
                    EXPECT_EQ(w, v.z / 4) << "values on the seam are those of the mesh";
                }
                // The map of the tube at the vertex, on the corner's side.
                double angle = std::atan2(v.y, v.x) / (2 * pi);
                angle += std::round(u - angle);
                error = std::max(error, std::hypot(2 * pi * (u - angle), 4 * w - v.z));
                const Vec3& next = s.mesh.vertices[s.mesh.triangles[t][(k + 1) % 3]];
                const double u_next = s.attributes.texture.at(t, (k + 1) % 3)[0];
                if (u == 0 && u_next == 0) seam_length += std::abs(next.z - v.z);
            }
            EXPECT_LT(high - low, 0.5) << "a triangle with values of both sides";
        }
        EXPECT_NEAR(seam_length, 4, 1e-12) << "the seam is all there, seen from one side";
        // A vertex that is d off the mesh takes the values of a point d away; around the tube that is d/(1 − d)
        // in the angle, and the mesh's own chords are off the map by less than (π/n)².
        const MeshDistance off = mesh_distance(s.mesh, p.mesh, 1000);
        EXPECT_LE(error, off.max / (1 - off.max) + (pi / n) * (pi / n));
    }
}

TEST(SimplifyAttributes, ChartsOfACubeDoNotMix) {
    const Painted p = cube(12);
    for (const SimplifyOptions& options : all_methods(60)) {
        SCOPED_TRACE(int(options.method));
        const Simplified s = simplify(p.mesh, p.attributes, options);
        EXPECT_LE(s.report.faces_after, 200u);
        std::set<int> charts;
        for (std::size_t t = 0; t < s.mesh.triangles.size(); ++t) {
            const double middle = (s.attributes.texture.at(t, 0)[0] + s.attributes.texture.at(t, 1)[0] +
                                   s.attributes.texture.at(t, 2)[0]) /
                                  3;
            const int chart = int(std::floor(middle / 2));
            charts.insert(chart);
            for (std::size_t k = 0; k < 3; ++k) {
                const Vec3& v = s.mesh.vertices[s.mesh.triangles[t][k]];
                const int axis = chart / 2;
                EXPECT_NEAR(v[axis], chart % 2, 1e-12) << "a triangle leaves its face";
                const auto [u, w] = s.attributes.texture.at(t, k);
                EXPECT_NEAR(u, 2 * chart + v[(axis + 1) % 3], 1e-12);
                EXPECT_NEAR(w, v[(axis + 2) % 3], 1e-12);
            }
        }
        EXPECT_EQ(charts.size(), 6u);
    }
}

TEST(SimplifyAttributes, AFunctionOfPositionStaysThatFunctionOfTheNearestPoint) {
    const Mesh mesh = zoo::sphere({0, 0, 0}, 1, 4);
    MeshAttributes a;
    for (const Vec3& v : mesh.vertices)
        a.colours.values.push_back(
            {float(0.5 + v.x / 4 + v.y / 8), float(0.5 - v.z / 4), float(0.5 + v.y / 3), 1});
    a.colours.corners = mesh.triangles;
    const Simplified s = simplify(mesh, a, {.faces = 300});
    EXPECT_EQ(s.report.faces_after, 300u);
    EXPECT_EQ(s.report.seam_edges_before, 0u);
    EXPECT_TRUE(s.attributes.texture.empty());
    const ClosestPoints tree(mesh);
    for (std::size_t t = 0; t < s.mesh.triangles.size(); ++t)
        for (std::size_t k = 0; k < 3; ++k) {
            const Vec3 q = tree.find(s.mesh.vertices[s.mesh.triangles[t][k]]).point;
            const Colour& c = s.attributes.colours.at(t, k);
            EXPECT_NEAR(c[0], 0.5 + q.x / 4 + q.y / 8, 1e-6);
            EXPECT_NEAR(c[1], 0.5 - q.z / 4, 1e-6);
            EXPECT_NEAR(c[2], 0.5 + q.y / 3, 1e-6);
            EXPECT_EQ(c[3], 1);
        }
}

TEST(SimplifyAttributes, ColoursThatJumpHaveSeamsToo) {
    Painted p = cube(8);
    p.attributes.texture = {};
    for (std::size_t t = 0; t < p.mesh.triangles.size(); ++t) {
        const auto face = std::uint32_t(t / 128);
        p.attributes.colours.corners.push_back({face, face, face});
    }
    for (int face = 0; face < 6; ++face) p.attributes.colours.values.push_back({float(face) / 5, 0, 1, 1});
    const Simplified s = simplify(p.mesh, p.attributes, {.method = SimplifyMethod::qem, .faces = 60});
    for (std::size_t t = 0; t < s.mesh.triangles.size(); ++t) {
        EXPECT_EQ(s.attributes.colours.at(t, 0), s.attributes.colours.at(t, 1));
        EXPECT_EQ(s.attributes.colours.at(t, 0), s.attributes.colours.at(t, 2));
    }
    EXPECT_EQ(s.report.seam_edges_before, 96u);
}

TEST(SimplifyAttributes, NormalsAreThoseOfTheResult) {
    const Mesh ball = zoo::sphere({1, 2, 3}, 2, 3);
    MeshAttributes a;
    a.normals = mesh::vertex_normals(ball.vertices, ball.triangles);
    const Simplified s = simplify(ball, a, {.faces = 200});
    ASSERT_EQ(s.attributes.normals.corners.size(), s.mesh.triangles.size());
    for (std::size_t t = 0; t < s.mesh.triangles.size(); ++t)
        for (std::size_t k = 0; k < 3; ++k) {
            const Vec3 out = 0.5 * (s.mesh.vertices[s.mesh.triangles[t][k]] - Vec3{1, 2, 3});
            EXPECT_NEAR(norm(s.attributes.normals.at(t, k)), 1, 1e-12);
            EXPECT_GT(dot(s.attributes.normals.at(t, k), out), 0.98);
        }
    const Simplified plain = simplify(ball, {.faces = 200});
    EXPECT_EQ(s.mesh.vertices, plain.mesh.vertices) << "normals hold nothing";
}

TEST(SimplifyAttributes, AttributesWithoutSeamsChangeNoTriangle) {
    for (const zoo::Entry& entry : zoo::all()) {
        if (entry.mesh.triangles.size() > 3000 || entry.name == "degenerate" || entry.name == "soup") continue;
        SCOPED_TRACE(entry.name);
        MeshAttributes a;
        for (const Vec3& v : entry.mesh.vertices) a.texture.values.push_back({v.x + 0.25 * v.z, v.y - v.z});
        a.texture.corners = entry.mesh.triangles;
        const SimplifyOptions options{.method = SimplifyMethod::qem,
                                      .faces = entry.mesh.triangles.size() / 4 + 4};
        const Simplified with = simplify(entry.mesh, a, options), plain = simplify(entry.mesh, options);
        EXPECT_EQ(with.mesh.vertices, plain.mesh.vertices);
        EXPECT_EQ(with.mesh.triangles, plain.mesh.triangles);
        EXPECT_EQ(with.report.seam_edges_before, 0u);
        EXPECT_TRUE(plain.attributes.empty());
    }
}

TEST(SimplifyAttributes, ProofsHoldWithSeams) {
    const Painted p = tube(32, 24);
    const Simplified s = simplify(p.mesh, p.attributes, {.tolerance = 0.03});
    EXPECT_EQ(s.report.proven_bound, 0.03);
    EXPECT_LE(mesh_distance(s.mesh, p.mesh, 20'000).max, 0.03);
    EXPECT_LE(mesh_distance(p.mesh, s.mesh, 20'000).max, 0.03);
    EXPECT_LT(s.report.faces_after, s.report.faces_before / 3);
    EXPECT_EQ(inspect(s.mesh).euler, 0);
}

TEST(SimplifyAttributes, TheComplexStaysSoundWithSeams) {
    for (const Painted& p : {tube(12, 9), cube(5)}) {
        const simplifier::AttributeTransfer transfer(p.mesh, p.attributes);
        simplifier::Complex complex(p.mesh, transfer.wedges());
        complex.validate();
        std::vector<std::uint32_t> ring;
        // Whatever may be merged is, from the highest numbers down, into the end that holds.
        for (std::uint32_t u = std::uint32_t(complex.vertices()); u-- > 0;)
            for (std::uint32_t v = 0; v < complex.vertices(); ++v) {
                if (u == v || !complex.has_vertex(u) || !complex.has_vertex(v) || complex.rank(u) == 2 ||
                    complex.rank(u) > complex.rank(v))
                    continue;
                ring.clear();
                const std::uint32_t shared = complex.ring(u, v, ring);
                if (!complex.can_merge(u, v, ring, shared)) continue;
                complex.merge(
                    u, v,
                    complex.position((u + v) % 2 == 0 && complex.on_seam(u) && complex.on_seam(v) ? u : v),
                    ring, shared);
                ASSERT_NO_THROW(complex.validate()) << u << " into " << v;
                ASSERT_GT(complex.seam_edges(), 0u);
            }
    }
}

TEST(SimplifyAttributes, ThatDoNotFitAreRefused) {
    Painted p = cube(2);
    p.attributes.texture.corners[3][0] = 999;
    EXPECT_THROW(simplify(p.mesh, p.attributes, {.tolerance = 0.1}), InputError);
    p = cube(2);
    p.attributes.texture.values[0][1] = NAN;
    EXPECT_THROW(simplify(p.mesh, p.attributes, {.tolerance = 0.1}), InputError);
}

}  // namespace
}  // namespace its
