#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <map>
#include <random>
#include <set>

#include "cgal/cgal.h"
#include "surface/polygonise.h"

/// Surfaces of arbitrary functions on a lattice: every sign pattern, ambiguous face and tie.
namespace its {
namespace {

using Values = std::vector<double>;

/// Cells of a lattice of side³ cells whose points have these values (x + (side + 1)(y + (side + 1) z)).
std::vector<surface::LevelCell> cells_of(const Values& values, std::uint32_t side) {
    std::vector<surface::LevelCell> cells;
    for (std::uint32_t z = 0; z < side; ++z)
        for (std::uint32_t y = 0; y < side; ++y)
            for (std::uint32_t x = 0; x < side; ++x) {
                surface::LevelCell cell{{x, y, z}, {}};
                for (std::uint32_t c = 0; c < 8; ++c)
                    cell.value[c] =
                        values[x + (c & 1) + (side + 1) * (y + (c >> 1 & 1) + (side + 1) * (z + (c >> 2)))];
                cells.push_back(cell);
            }
    return cells;
}

/// 1 on the boundary, else what `inside` gives.
template <class F>
Values bordered(std::uint32_t side, F&& inside) {
    Values values;
    for (std::uint32_t z = 0; z <= side; ++z)
        for (std::uint32_t y = 0; y <= side; ++y)
            for (std::uint32_t x = 0; x <= side; ++x) {
                const bool border = x == 0 || y == 0 || z == 0 || x == side || y == side || z == side;
                values.push_back(border ? 1.0 : inside());
            }
    return values;
}

surface::SurfaceFrame frame_of(std::uint32_t side, SurfaceSide which = SurfaceSide::outer) {
    return {
        {.origin = {-1, 2, 0.5}, .step = 0.25, .cells = side, .clearance = surface::least_clearance}, which, 0};
}

TEST(LatticeFunctions, RandomValuesGiveEmbeddedManifolds) {
    std::mt19937_64 random(20240);
    std::uniform_real_distribution<double> real(-1, 1);
    for (int trial = 0; trial < 30; ++trial) {
        const std::uint32_t side = 9;
        const Values values = bordered(side, [&] { return real(random); });
        for (const SurfaceSide which : {SurfaceSide::outer, SurfaceSide::inner, SurfaceSide::zero}) {
            const Mesh mesh = surface::polygonise(frame_of(side, which), cells_of(values, side), {});
            EXPECT_GT(mesh.triangles.size(), 1000);
            EXPECT_EQ(cgal::surface_defects(mesh), "") << trial;
        }
    }
}

TEST(LatticeFunctions, ValuesAtTheLevelAndHugeRatiosGiveEmbeddedManifolds) {
    std::mt19937_64 random(7);
    const double choices[] = {0, 0, -0.0, 1e-300, -1e-300, 1, -1, 1e-17, -1e-17, 0.5, -2};
    for (int trial = 0; trial < 30; ++trial) {
        const std::uint32_t side = 8;
        const Values values = bordered(side, [&] { return choices[random() % std::size(choices)]; });
        const Mesh mesh = surface::polygonise(frame_of(side), cells_of(values, side), {});
        EXPECT_EQ(cgal::surface_defects(mesh), "") << trial;
    }
}

TEST(LatticeFunctions, FarFromTheOriginVerticesStayApart) {
    // The fewest bits that are accepted: a cell has 2^13 units in the last place, the clearance is 2^-4 cells.
    std::mt19937_64 random(8);
    const double choices[] = {0, 1e-9, 1, -1e-9, -1, -1, 0.3};
    const std::uint32_t side = 8;
    surface::SurfaceFrame frame = frame_of(side);
    frame.grid.step = 1;
    frame.grid.origin = {0x1p39, -0x1p39 - 8, 0x1p39};
    frame.grid.clearance = surface::most_clearance;
    for (int trial = 0; trial < 10; ++trial) {
        const Values values = bordered(side, [&] { return choices[random() % std::size(choices)]; });
        EXPECT_EQ(cgal::surface_defects(surface::polygonise(frame, cells_of(values, side), {})), "") << trial;
    }
}

TEST(LatticeFunctions, LevelSetsReachingTheBoundaryAreRefused) {
    Values values(27, 1.0);
    values[4] = -1;
    EXPECT_THROW(surface::polygonise(frame_of(2), cells_of(values, 2), {}), OptionError);
}

TEST(Patches, FansAreOfThreeToSixEdgesWhereNoFaceIsAmbiguous) {
    std::map<int, int> sizes;
    int ambiguous = 0;
    for (unsigned below = 0; below < 256; ++below) {
        const surface::Loops& loops = surface::loops_of(below);
        ambiguous += loops.ambiguous;
        for (int i = 0; i < loops.count; ++i) ++sizes[loops.loop[std::size_t(i)].size];
        if (loops.count == 2) {  // two opposite corners
            EXPECT_EQ(loops.loop[0].size, 3);
            EXPECT_EQ(loops.loop[1].size, 3);
        }
    }
    EXPECT_THAT(sizes, testing::ElementsAre(testing::Pair(3, 8 * 2 + 4 * 2 * 2), testing::Pair(4, 24 + 6),
                                            testing::Pair(5, 24 * 2), testing::Pair(6, 8 + 24)));
    EXPECT_EQ(ambiguous, 256 - 2 - 16 - 8 - 30 - 48 - 32);
}

/// The segments that a patch leaves on its cell's boundary: directed edges used once.
std::set<std::pair<int, int>> boundary(const surface::Patch& patch) {
    std::set<std::pair<int, int>> edges;
    for (int t = 0; t < patch.size; ++t)
        for (int i = 0; i < 3; ++i) {
            const auto& corner = patch.triangle[std::size_t(t)];
            const int a = corner[std::size_t(i)], b = corner[std::size_t((i + 1) % 3)];
            if (!edges.erase({b, a})) edges.insert({a, b});
        }
    return edges;
}

TEST(Patches, BothCellsOfAFaceHaveTheSameSegments) {
    std::mt19937_64 random(3);
    std::uniform_real_distribution<double> real(-1, 1);
    int ambiguous = 0;
    for (int trial = 0; trial < 20000; ++trial) {
        surface::LevelCell cells[2] = {{{0, 0, 0}, {}}, {{1, 0, 0}, {}}};
        for (double& v : cells[0].value) v = real(random);
        for (std::size_t c = 0; c < 8; ++c) cells[1].value[c] = c & 1 ? real(random) : cells[0].value[c + 1];
        std::set<std::pair<int, int>> on_face[2];
        for (int k = 0; k < 2; ++k) {
            surface::CellSurface surface;
            surface::SurfaceFrame frame = frame_of(8);
            surface::make_cell_surface(frame, cells[k], surface);
            ambiguous += surface.crossing.star;
            for (auto [a, b] : boundary(surface.patch)) {
                ASSERT_LT(std::max(a, b), surface::first_inner);
                const auto in_face = [&](int e) {
                    return (surface::edge_start(e) & 1) == 1 - k && (surface::edge_end(e) & 1) == 1 - k;
                };
                if (!in_face(a) || !in_face(b)) continue;
                // Edges 4 to 11 lie across x; the other cell's names differ in the bit of x, and run the other
                // way.
                const auto key = [](int e) {
                    return std::pair(surface::edge_start(e) & 6, surface::edge_end(e) & 6);
                };
                const auto from = key(a), to = key(b);
                const int named_from = from.first * 8 + from.second, named_to = to.first * 8 + to.second;
                on_face[k].insert(k == 0 ? std::pair(named_from, named_to) : std::pair(named_to, named_from));
            }
        }
        EXPECT_EQ(on_face[0], on_face[1]);
    }
    EXPECT_GT(ambiguous, 1000);
}

}  // namespace
}  // namespace its
