// Directions repaired by majority: a few bad edges do not take the inside away.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "geometry/vec3.h"
#include "inspect/orient.h"
#include "its/inspect.h"
#include "its/shell.h"
#include "mesh/merged.h"
#include "support/zoo.h"

namespace its {
namespace {

using testing::HasSubstr;

/// A closed mesh with damage, and where that is.
struct Damaged {
    Mesh mesh;
    std::vector<Vec3> places;
};

enum Damage { flipped = 1, duplicated = 2, duplicated_reversed = 4, fins = 8 };

Damaged damage(const Mesh& whole, int kinds, int count, std::uint32_t seed) {
    std::mt19937 random(seed);
    Damaged out{whole, {}};
    const auto pick = [&] {
        const std::size_t t = random() % whole.triangles.size();
        const Triangle& c = whole.triangles[t];
        out.places.push_back((1.0 / 3) * (whole.vertices[c[0]] + whole.vertices[c[1]] + whole.vertices[c[2]]));
        return t;
    };
    for (int i = 0; i < count; ++i) {
        if ((kinds & flipped) != 0) {
            Triangle& t = out.mesh.triangles[pick()];
            std::swap(t[1], t[2]);
        }
        if ((kinds & duplicated) != 0) out.mesh.triangles.push_back(whole.triangles[pick()]);
        if ((kinds & duplicated_reversed) != 0) {
            const Triangle& t = whole.triangles[pick()];
            out.mesh.triangles.push_back({t[0], t[2], t[1]});
        }
        if ((kinds & fins) != 0) {
            const Triangle& t = whole.triangles[pick()];
            const auto tip = std::uint32_t(out.mesh.vertices.size());
            out.mesh.vertices.push_back(1.1 * out.places.back());
            out.mesh.triangles.push_back(random() % 2 == 0 ? Triangle{t[0], t[1], tip}
                                                           : Triangle{t[1], t[0], tip});
        }
    }
    return out;
}

double longest_edge(const Mesh& mesh) {
    double longest = 0;
    for (const Triangle& t : mesh.triangles)
        for (std::size_t k = 0; k < 3; ++k)
            longest = std::max(longest, norm(mesh.vertices[t[(k + 1) % 3]] - mesh.vertices[t[k]]));
    return longest;
}

/// Sides of lattice points that are clear of the damage agree with those of the whole mesh.
void expect_same_sides(const Mesh& whole, const Damaged& damaged, std::uint32_t seed) {
    BuildOptions options;
    options.depth = 5;
    const ThinShell right = build(whole, options), shell = build(damaged.mesh, options);
    EXPECT_TRUE(shell.info().sign == SignRule::winding || shell.info().sign == SignRule::generalized)
        << shell.info().sign_reason;
    const double clear = 2 * longest_edge(whole), near = right.info().cell_width;
    std::mt19937 random(seed);
    const Box& box = inspect(whole).bounds;
    int looked = 0;
    for (int i = 0; i < 20'000; ++i) {
        const auto at = [&](double low, double high) { return low + (high - low) * double(random()) / 0x1p32; };
        const Vec3 p{at(box.min.x, box.max.x), at(box.min.y, box.max.y), at(box.min.z, box.max.z)};
        if (std::abs(right.value(p)) < near) continue;
        if (std::any_of(damaged.places.begin(), damaged.places.end(),
                        [&](const Vec3& place) { return norm(p - place) < clear; }))
            continue;
        ++looked;
        ASSERT_EQ(shell.value(p) < 0, right.value(p) < 0) << p.x << ' ' << p.y << ' ' << p.z;
    }
    EXPECT_GT(looked, 1000);
}

TEST(Repair, DamageLeavesTheInside) {
    for (const auto& [name, whole] :
         {std::pair{"ball", zoo::sphere({0, 0, 0}, 1, 3)}, std::pair{"torus", zoo::torus(1, 0.4, 48, 24)}}) {
        for (const int kinds : {int(flipped), int(duplicated), int(duplicated_reversed), int(fins), 15}) {
            for (const int count : {1, 6}) {
                SCOPED_TRACE(std::string(name) + ", kinds " + std::to_string(kinds) + ", " +
                             std::to_string(count));
                const auto seed = std::uint32_t(100 * kinds + count);
                const Damaged damaged = damage(whole, kinds, count, seed);
                const MeshReport report = inspect(damaged.mesh);
                EXPECT_TRUE(report.sign == SignRule::winding || report.sign == SignRule::generalized)
                    << report.sign_reason;
                EXPECT_GE(report.separating, 0.9);
                expect_same_sides(whole, damaged, seed);
            }
        }
    }
}

TEST(Repair, CountsWhatIsDone) {
    Mesh mesh = zoo::sphere({0, 0, 0}, 1, 3);
    mesh.triangles.pop_back();  // a hole
    for (const std::size_t i : {10u, 200u, 500u}) std::swap(mesh.triangles[i][1], mesh.triangles[i][2]);
    const MeshReport report = inspect(mesh);
    EXPECT_EQ(report.inconsistent_edges, 9u);
    EXPECT_EQ(report.sign, SignRule::generalized);
    EXPECT_EQ(report.repaired, 3u);
    EXPECT_EQ(report.turned, 3u);
    EXPECT_THAT(report.sign_reason, HasSubstr("3 triangles that disagreed"));
    EXPECT_GT(report.separating, 0.99);
    EXPECT_EQ(inspect(oriented(mesh)).inconsistent_edges, 0u);
    // Inside out besides.
    const MeshReport reversed = inspect(zoo::reversed(mesh));
    EXPECT_EQ(reversed.repaired, 3u);
    EXPECT_EQ(reversed.turned, mesh.triangles.size() - 3);
    EXPECT_EQ(inspect(oriented(zoo::reversed(mesh))).turned, 0u);
}

TEST(Repair, DoesNotInventAnInside) {
    EXPECT_EQ(inspect(zoo::moebius_strip(40)).sign, SignRule::unsigned_rule);
    Mesh sheet = zoo::sheet(8);
    std::swap(sheet.triangles[5][1], sheet.triangles[5][2]);
    EXPECT_EQ(inspect(sheet).sign, SignRule::unsigned_rule);
    EXPECT_EQ(inspect(sheet).turned, 0u) << "nothing is turned where nothing is decided by it";
}

TEST(Repair, EdgesWithManyTrianglesAreBalanced) {
    // Pages of a book, all of which run the same way along its back: the two smallest are turned.
    Mesh book;
    book.vertices = {{0, 0, 0}, {0, 0, 1}, {4, 0, 0}, {0, 1, 0}, {-3, 0, 0}, {0, -2, 0}};
    book.triangles = {{0, 1, 2}, {0, 1, 3}, {0, 1, 4}, {0, 1, 5}};
    const mesh::Merged merged = mesh::merge(book);
    EXPECT_THAT(inspector::majority_turns(merged, inspector::find_patches(merged)),
                testing::ElementsAre(0, 1, 0, 1));
    // One page less: one is enough.
    book.triangles.pop_back();
    const mesh::Merged less = mesh::merge(book);
    EXPECT_THAT(inspector::majority_turns(less, inspector::find_patches(less)), testing::ElementsAre(0, 1, 0));
}

TEST(Repair, FlippedTrianglesChangeNothing) {
    // Flipping triangles at random never changes what a mesh with holes is taken for.
    std::mt19937 random(3);
    for (int i = 0; i < 6; ++i) {
        Mesh mesh = zoo::twisted_knot(120, 12);
        mesh.triangles.resize(mesh.triangles.size() - 7);
        const MeshReport before = inspect(mesh);
        std::uint64_t flips = 0;
        for (Triangle& t : mesh.triangles)
            if (random() % 20 == 0) std::swap(t[1], t[2]), ++flips;
        const MeshReport after = inspect(mesh);
        EXPECT_EQ(after.sign, before.sign);
        EXPECT_EQ(after.repaired, flips);
        EXPECT_EQ(after.separating, before.separating);
    }
}

}  // namespace
}  // namespace its
