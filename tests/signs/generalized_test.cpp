// Generalized winding numbers: the filling of holes, its estimates, and signs on the lattice.
#include "signs/generalized.h"

#include <gtest/gtest.h>
#include <cmath>
#include <limits>
#include <numbers>
#include <random>

#include "distance/triangle_tree.h"
#include "geometry/predicates.h"
#include "geometry/vec3.h"
#include "its/inspect.h"
#include "support/zoo.h"

namespace its {
namespace {

constexpr double infinity = std::numeric_limits<double>::infinity();

/// Sum of signed solid angles over 4π (Van Oosterom and Strackee 1983), in extended precision.
double solid_angle_winding(const Mesh& mesh, const Vec3& p) {
    using Real = long double;
    Real sum = 0;
    for (const Triangle& t : mesh.triangles) {
        Real v[3][3], length[3];
        for (int i = 0; i < 3; ++i) {
            length[i] = 0;
            for (int axis = 0; axis < 3; ++axis) {
                v[i][axis] = Real(mesh.vertices[t[std::size_t(i)]][axis]) - p[axis];
                length[i] += v[i][axis] * v[i][axis];
            }
            length[i] = std::sqrt(length[i]);
        }
        const auto dot3 = [](const Real* a, const Real* b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; };
        const Real det = v[0][0] * (v[1][1] * v[2][2] - v[1][2] * v[2][1]) +
                         v[0][1] * (v[1][2] * v[2][0] - v[1][0] * v[2][2]) +
                         v[0][2] * (v[1][0] * v[2][1] - v[1][1] * v[2][0]);
        sum += 2 * std::atan2(det, length[0] * length[1] * length[2] + dot3(v[0], v[1]) * length[2] +
                                       dot3(v[1], v[2]) * length[0] + dot3(v[2], v[0]) * length[1]);
    }
    return double(sum / (4 * std::numbers::pi_v<Real>));
}

/// The mesh without the triangles i for which i % modulus == rest.
Mesh without(Mesh mesh, std::size_t modulus, std::size_t rest) {
    std::vector<Triangle> kept;
    for (std::size_t i = 0; i < mesh.triangles.size(); ++i)
        if (i % modulus != rest) kept.push_back(mesh.triangles[i]);
    mesh.triangles = kept;
    return mesh;
}

/// The part of a mesh below a height.
Mesh below(Mesh mesh, int axis, double height) {
    std::erase_if(mesh.triangles, [&](const Triangle& t) {
        return mesh.vertices[t[0]][axis] + mesh.vertices[t[1]][axis] + mesh.vertices[t[2]][axis] > 3 * height;
    });
    return mesh;
}

Mesh box_without_a_side(std::size_t side) {
    Mesh mesh = zoo::box({0, 0, 0}, {1, 1, 1});
    mesh.triangles.erase(mesh.triangles.begin() + std::ptrdiff_t(2 * side),
                         mesh.triangles.begin() + std::ptrdiff_t(2 * side + 2));
    return mesh;
}

struct Named {
    std::string name;
    Mesh mesh;
};

std::vector<Named> open_meshes() {
    std::vector<Named> out;
    for (const auto& entry : zoo::all())
        if (!entry.closed_oriented) out.push_back({entry.name, entry.mesh});
    out.push_back({"punctured sphere", without(zoo::sphere({0, 0, 0}, 1, 3), 50, 7)});
    out.push_back({"cap", below(zoo::sphere({0, 0, 0}, 1, 4), 2, 0.3)});
    out.push_back({"cut torus", below(zoo::torus(1, 0.4, 48, 20), 0, 0.6)});
    out.push_back({"every third triangle", without(zoo::sphere({0, 0, 0}, 1, 2), 3, 1)});
    out.push_back(
        {"one triangle twice", zoo::joined(zoo::tetrahedron(), {zoo::tetrahedron().vertices, {{0, 2, 1}}})});
    for (std::size_t side = 0; side < 6; ++side)
        out.push_back({"box without side " + std::to_string(side), box_without_a_side(side)});
    return out;
}

class Points {
public:
    explicit Points(const Mesh& mesh) : box_(octree::bounds(mesh)) {}
    /// In the bounds enlarged by half.
    Vec3 next() {
        Vec3 p;
        for (int axis = 0; axis < 3; ++axis) {
            const double middle = 0.5 * (box_.min[axis] + box_.max[axis]);
            const double half = 0.75 * (box_.max[axis] - box_.min[axis]) + 0.1;
            p[axis] = middle + half * unit_(random_);
        }
        return p;
    }
    double unit() { return unit_(random_); }
    double size() const { return norm(box_.max - box_.min); }

private:
    Box box_;
    std::mt19937_64 random_{11};
    std::uniform_real_distribution<double> unit_{-1, 1};
};

int ray_crossings(const Mesh& mesh, const Vec3& p) {
    int sum = 0;
    for (const Triangle& t : mesh.triangles)
        sum += geometry::x_line_crossing(mesh.vertices[t[0]], mesh.vertices[t[1]], mesh.vertices[t[2]],
                                         {-1e3 - std::abs(p.x), p.y, p.z}, p.x);
    return sum;
}

TEST(Filling, ClosesEveryMesh) {
    for (const auto& [name, mesh] : open_meshes()) {
        const winding::Filling filling(mesh);
        if (name == "degenerate") continue;  // its boundary has no area to fill
        ASSERT_FALSE(filling.empty()) << name;
        EXPECT_EQ(inspect(zoo::joined(mesh, filling.surface())).unbalanced_edges, 0u) << name;
    }
    EXPECT_TRUE(winding::Filling(zoo::torus(1, 0.4, 24, 12)).empty());
}

TEST(Filling, BoundaryTermCompletesTheCrossings) {
    for (const auto& [name, mesh] : open_meshes()) {
        const winding::Filling filling(mesh);
        Points points(mesh);
        for (int i = 0; i < 500; ++i) {
            const Vec3 p = points.next();
            const winding::WindingEstimate boundary = filling.boundary_term(p);
            ASSERT_NEAR(ray_crossings(mesh, p) + boundary.value, solid_angle_winding(mesh, p),
                        boundary.error + 1e-14)
                << name;
            ASSERT_LT(boundary.error, 1e-9);
        }
    }
}

TEST(Filling, BoundaryTermWhereTheRayMeetsTheBoundary) {
    // Rays through vertices, along edges and in the plane of the boundary: the displaced point decides, and
    // crossings and term must agree on it.
    for (std::size_t side = 0; side < 6; ++side) {
        const Mesh mesh = box_without_a_side(side);
        const winding::Filling filling(mesh);
        for (int i = 0; i < 9 * 9 * 9; ++i) {
            const Vec3 p{0.25 * (i % 9) - 0.5, 0.25 * (i / 9 % 9) - 0.5, 0.25 * (i / 81) - 0.5};
            const bool in_closed_box = std::min({p.x, p.y, p.z}) >= 0 && std::max({p.x, p.y, p.z}) <= 1;
            const bool on_box =
                in_closed_box && (std::min({p.x, p.y, p.z}) == 0 || std::max({p.x, p.y, p.z}) == 1);
            if (on_box) continue;
            ASSERT_NEAR(ray_crossings(mesh, p) + filling.boundary_term(p).value, solid_angle_winding(mesh, p),
                        1e-14)
                << "side " << side << " at " << p.x << ' ' << p.y << ' ' << p.z;
        }
    }
}

TEST(Filling, EstimatesAreWithinTheirErrors) {
    for (const auto& [name, mesh] : open_meshes()) {
        const winding::Filling filling(mesh);
        Points points(mesh);
        int useful = 0;
        for (int i = 0; i < 1000; ++i) {
            const Vec3 p = points.next();
            const winding::WindingEstimate estimate = filling.winding(p, std::pow(2.0, -5 - 2 * (i % 7)));
            ASSERT_LE(std::abs(estimate.value - solid_angle_winding(filling.surface(), p)),
                      estimate.error + 1e-15)
                << name;
            useful += estimate.error < 0.01;
        }
        EXPECT_GT(useful, 500) << name;
    }
}

/// A cube about `centre` and those that halve it.
struct Halved {
    Vec3 centre;
    double half;
    winding::Octants::Cubes cubes() const {
        winding::Octants::Cubes out{{}, {}, {}, half / 2};
        for (int i = 0; i < 8; ++i) {
            out.x[i] = centre.x + ((i & 1) != 0 ? half : -half) / 2;
            out.y[i] = centre.y + ((i & 2) != 0 ? half : -half) / 2;
            out.z[i] = centre.z + ((i & 4) != 0 ? half : -half) / 2;
        }
        return out;
    }
    Halved lane(int i) const {
        const winding::Octants::Cubes c = cubes();
        return {{c.x[i], c.y[i], c.z[i]}, half / 2};
    }
};

/// Down a random way from a cube around all of the mesh, each of whose cubes is looked at.
TEST(Octants, EstimatesAndVariationsAreWithinTheirErrors) {
    std::vector<Named> meshes = open_meshes();
    meshes.push_back({"many loops", without(zoo::sphere({0, 0, 0}, 1, 4), 7, 3)});
    for (const auto& [name, mesh] : meshes) {
        const winding::Filling filling(mesh);
        Points points(mesh);
        std::mt19937_64 random(5);
        int useful = 0, expanded = 0;
        for (int trial = 0; trial < 12; ++trial) {
            Halved cube{points.next(), points.size()};
            winding::Octants from(filling), to(filling);
            int lane = 0;
            for (int level = 0; level < 9; ++level) {
                const double tolerance = std::pow(2.0, -4 - int(random() % 14));
                const bool whole = level % 3 == 2;  // nothing left for later
                to.narrow(from, lane, cube.cubes(), tolerance, whole ? 0.0 : 0.5 * cube.half);
                for (int i = 0; i < winding::Octants::lanes; ++i) {
                    const Halved own = cube.lane(i);
                    const double w = solid_angle_winding(filling.surface(), own.centre);
                    const winding::WindingEstimate at_centre = to.at_centre(i);
                    if (at_centre.error < infinity) {
                        ASSERT_LE(std::abs(at_centre.value - w), at_centre.error + 1e-14)
                            << name << " level " << level;
                    }
                    winding::Octants::Points some;
                    for (int j = 0; j < winding::Octants::block; ++j) {
                        some.x[j] = own.centre.x + own.half * points.unit();
                        some.y[j] = own.centre.y + own.half * points.unit();
                        some.z[j] = own.centre.z + own.half * points.unit();
                    }
                    winding::Octants::Estimates estimates;
                    if (whole) to.at(i, some, estimates);
                    const double variation = to.variation(i);
                    for (int j = 0; j < (level < 4 ? 4 : winding::Octants::block); j += 4) {
                        const double v =
                            solid_angle_winding(filling.surface(), {some.x[j], some.y[j], some.z[j]});
                        const double change = std::abs(v - w);
                        const double off_whole = to.clear(i) ? change : std::abs(change - std::round(change));
                        ASSERT_LE(off_whole, variation + 1e-14) << name << " level " << level;
                        if (!whole) continue;
                        ASSERT_LE(std::abs(estimates.value[j] - v), estimates.error[j] + 1e-14)
                            << name << " level " << level;
                        expanded += std::abs(estimates.value[j] - v) > 1e-12;
                    }
                    useful += variation < 0.1;
                }
                lane = int(random() % 8);
                cube = cube.lane(lane);
                std::swap(from, to);
            }
        }
        EXPECT_GT(useful, 200) << name;
        if (name != "degenerate") {
            EXPECT_GT(expanded, 100) << name;
        }
    }
}

struct Setting {
    Mesh mesh;
    octree::Lattice lattice;
    std::vector<Vec3> positions;
    octree::Voxels voxels;
};

Setting setting(const Mesh& mesh, int depth) {
    Setting s{mesh, octree::make_lattice(octree::bounds(mesh), depth), {}, {}};
    for (const Vec3& v : mesh.vertices) s.positions.push_back(s.lattice.to_lattice(v));
    s.voxels = octree::voxelise(s.positions, mesh.triangles, s.lattice.depth, s.lattice.point_error(), {});
    return s;
}

bool within(const Box& box, const Vec3& p) {
    for (int axis = 0; axis < 3; ++axis)
        if (p[axis] < box.min[axis] || p[axis] > box.max[axis]) return false;
    return true;
}

TEST(GeneralizedSigns, AgreeWithSolidAngles) {
    for (const auto& [name, mesh] : open_meshes()) {
        if (name == "degenerate") continue;
        const Setting s = setting(mesh, 5);
        const signs::GeneralizedSigns signs(s.mesh, s.lattice, s.voxels, {});
        const distance::TriangleTree tree = distance::make_triangle_tree(mesh.vertices, mesh.triangles, 1);
        const auto on_mesh = [&, count = mesh.triangles.size()](const Vec3& p) {
            for (std::uint64_t t = 0; t < count; ++t)
                if (distance::squared_distance(tree.block[t / 8], t % 8, p.x, p.y, p.z) < 1e-24) return true;
            return false;
        };
        const Box box = octree::bounds(mesh);
        std::mt19937_64 random(3);
        int inside = 0, ties = 0;
        for (int i = 0; i < 3000; ++i) {
            const std::array<std::int64_t, 3> at{std::int64_t(14 + random() % 37),
                                                 std::int64_t(14 + random() % 37),
                                                 std::int64_t(14 + random() % 37)};
            const Vec3 p = s.lattice.position(at);
            const double w = solid_angle_winding(mesh, p);
            const bool expected = w > 0.5 && within(box, p);
            if (std::abs(w - 0.5) < 1e-12 || on_mesh(p)) {
                ++ties;
                continue;
            }
            ASSERT_EQ(signs.inside(at[0], at[1], at[2]), expected) << name << " w = " << w;
            inside += expected;
        }
        EXPECT_LT(ties, 1500) << name;
        if (name.find("sphere") != std::string::npos || name.find("box") != std::string::npos) {
            EXPECT_GT(inside, 100) << name;
        }
    }
}

TEST(GeneralizedSigns, PointsOfAPlaneHoleInALatticePlaneAreAllOutside) {
    for (std::size_t side = 0; side < 6; ++side) {
        const Setting s = setting(box_without_a_side(side), 4);  // w = 1/16: the box is cells 8 … 24
        const signs::GeneralizedSigns signs(s.mesh, s.lattice, s.voxels, {});
        const int axis = side < 2 ? 2 : side < 4 ? 1 : 0;
        const std::int64_t plane = side % 2 == 0 ? 8 : 24, next = side % 2 == 0 ? 9 : 23;
        for (std::int64_t i = 9; i < 24; ++i)
            for (std::int64_t j = 9; j < 24; ++j) {
                std::array<std::int64_t, 3> at{};
                at[std::size_t(axis)] = plane;
                at[std::size_t((axis + 1) % 3)] = i;
                at[std::size_t((axis + 2) % 3)] = j;
                ASSERT_FALSE(signs.inside(at[0], at[1], at[2])) << "side " << side << ' ' << i << ' ' << j;
                at[std::size_t(axis)] = next;
                ASSERT_TRUE(signs.inside(at[0], at[1], at[2])) << "side " << side << ' ' << i << ' ' << j;
            }
    }
}

TEST(GeneralizedSigns, GridPointsGetTheirOwnSign) {
    for (const auto& [name, mesh] : open_meshes())
        for (const int depth : {0, 1, 2, 4}) {
            Setting s = setting(mesh, depth);
            signs::GeneralizedSigns signs(s.mesh, s.lattice, s.voxels, {});
            signs.add_flip_cells(s.voxels, {});
            const octree::Octree octree = octree::make_octree(s.lattice.depth, s.voxels.cell);
            std::vector<std::vector<double>> values;
            for (const octree::Level& level : octree.levels)
                values.emplace_back(octree::group_points * level.groups(), 1.0);
            signs.apply(octree, values, {});
            for (int level = 0; level <= s.lattice.depth; ++level)
                for (std::uint64_t g = 0; g < octree.levels[std::size_t(level)].groups(); ++g) {
                    const octree::Cell at = octree::morton_decode(octree.levels[std::size_t(level)].parent[g]);
                    for (int p = 0; p < octree::group_points; ++p) {
                        const std::int64_t x = (2 * std::int64_t(at[0]) + p % 3) << level,
                                           y = (2 * std::int64_t(at[1]) + p / 3 % 3) << level,
                                           z = (2 * std::int64_t(at[2]) + p / 9) << level;
                        ASSERT_EQ(values[std::size_t(level)][octree::group_points * g + std::uint64_t(p)] < 0,
                                  signs.inside(x, y, z))
                            << name << " level " << level << " at " << x << ' ' << y << ' ' << z << " w "
                            << solid_angle_winding(mesh, s.lattice.position({x, y, z}));
                    }
                }
        }
}

/// Distances of 1 cell: they are shortened at the corners of cells with a side along which w passes ½ and no
/// triangle, to |w − ½| / |∇w|, and nowhere else.
TEST(GeneralizedSigns, OnlyHolesShortenDistances) {
    const Named meshes[] = {{"cap", below(zoo::sphere({0, 0, 0}, 1, 2), 2, 0.3)},
                            {"cut torus", below(zoo::torus(1, 0.4, 24, 10), 0, 0.6)}};
    for (const auto& [name, mesh] : meshes) {
        Setting s = setting(mesh, 4);
        signs::GeneralizedSigns signs(s.mesh, s.lattice, s.voxels, {});
        signs.add_flip_cells(s.voxels, {});
        const octree::Octree octree = octree::make_octree(4, s.voxels.cell);
        std::vector<std::vector<double>> values;
        for (const octree::Level& level : octree.levels)
            values.emplace_back(octree::group_points * level.groups(), 1.0);
        signs.apply(octree, values, {});

        constexpr int n = 32, points = n + 1;
        const auto index = [](int x, int y, int z) { return std::size_t(x + points * (y + points * z)); };
        const Box box = octree::bounds(mesh);
        std::vector<bool> known;  // inside ends at the bounding box
        std::vector<double> w, expected(std::size_t(points) * points * points, 1.0);
        for (int i = 0; i < points * points * points; ++i) {
            const Vec3 p = s.lattice.position({i % points, i / points % points, i / points / points});
            known.push_back(within(box, p));
            w.push_back(known.back() ? solid_angle_winding(mesh, p) : 0);
        }
        for (int z = 0; z < n; ++z)
            for (int y = 0; y < n; ++y)
                for (int x = 0; x < n; ++x) {
                    const auto corner = [&](int c) {
                        return index(x + (c & 1), y + (c >> 1 & 1), z + (c >> 2));
                    };
                    double squares[8] = {};
                    bool hole = false;
                    for (int c = 0; c < 8; ++c)
                        for (const int axis : {1, 2, 4}) {
                            const double change = w[corner(c)] - w[corner(c ^ axis)];
                            if (!known[corner(c)] || !known[corner(c ^ axis)] || std::abs(change) >= 0.5)
                                continue;
                            squares[c] += change * change;
                            hole = hole || (w[corner(c)] > 0.5) != (w[corner(c ^ axis)] > 0.5);
                        }
                    for (int c = 0; c < 8 && hole; ++c) {
                        double& d = expected[corner(c)];
                        if (squares[c] > 0)
                            d = std::min(d, std::abs(w[corner(c)] - 0.5) / std::sqrt(squares[c]));
                    }
                }
        int shortened = 0;
        for (std::uint64_t g = 0; g < octree.levels[0].groups(); ++g) {
            const octree::Cell at = octree::morton_decode(octree.levels[0].parent[g]);
            for (int p = 0; p < octree::group_points; ++p) {
                const double d = std::abs(values[0][octree::group_points * g + std::uint64_t(p)]);
                const double should =
                    expected[index(int(2 * at[0]) + p % 3, int(2 * at[1]) + p / 3 % 3, int(2 * at[2]) + p / 9)];
                ASSERT_NEAR(d, should, 0.05) << name;
                ASSERT_EQ(d == 1, should == 1) << name << ' ' << d << ' ' << should;
                shortened += should < 1;
            }
        }
        EXPECT_GT(shortened, 30) << name;
    }
}

TEST(GeneralizedSigns, EveryFinestCellWithBothSidesIsMarked) {
    for (const auto& [name, mesh] : open_meshes()) {
        Setting s = setting(mesh, 4);
        const std::vector<std::uint64_t> before = s.voxels.cell;
        signs::GeneralizedSigns signs(s.mesh, s.lattice, s.voxels, {});
        signs.add_flip_cells(s.voxels, {});
        ASSERT_EQ(s.voxels.offset.size(), s.voxels.cell.size() + 1);
        constexpr int n = 32;
        std::vector<bool> inside(33 * 33 * 33);
        for (int i = 0; i < 33 * 33 * 33; ++i)
            inside[std::size_t(i)] = signs.inside(i % 33, i / 33 % 33, i / 33 / 33);
        std::uint64_t flips = 0;
        for (std::uint32_t z = 0; z < n; ++z)
            for (std::uint32_t y = 0; y < n; ++y)
                for (std::uint32_t x = 0; x < n; ++x) {
                    int count = 0;
                    for (std::uint32_t c = 0; c < 8; ++c)
                        count += inside[(x + (c & 1)) + 33 * (y + (c >> 1 & 1)) + 33 * 33 * (z + (c >> 2))];
                    const std::uint64_t code = octree::morton_encode({x, y, z});
                    const auto at = std::lower_bound(s.voxels.cell.begin(), s.voxels.cell.end(), code);
                    const bool marked = at != s.voxels.cell.end() && *at == code;
                    const bool meets = std::binary_search(before.begin(), before.end(), code);
                    if (count != 0 && count != 8) {
                        ASSERT_TRUE(marked) << name;
                        flips += !meets;
                    } else {
                        ASSERT_EQ(marked, meets) << name;
                    }
                    if (!marked) continue;
                    const auto c = std::size_t(at - s.voxels.cell.begin());
                    ASSERT_EQ(s.voxels.offset[c + 1] > s.voxels.offset[c], meets) << name;
                }
        EXPECT_EQ(s.voxels.cell.size(), before.size() + flips) << name;
        if (name == "cap") {
            EXPECT_GT(flips, 100u);
        }
    }
}

}  // namespace
}  // namespace its
