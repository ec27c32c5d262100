#include "octree/lattice.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "its/shell.h"
#include "support/zoo.h"

namespace its {
namespace {

/// Whether a·b is exact.
bool product_is_exact(double a, double b) {
    return std::fma(a, b, -(a * b)) == 0;
}

void expect_exact_positions(const octree::Lattice& lattice) {
    for (int axis = 0; axis < 3; ++axis)
        for (const std::int64_t i : {std::int64_t{0}, std::int64_t{1}, std::int64_t{lattice.cells()} - 1,
                                     std::int64_t{lattice.cells()}}) {
            const double quarters = double(lattice.base[axis] + 4 * i);
            EXPECT_EQ(std::int64_t(quarters), lattice.base[axis] + 4 * i);
            EXPECT_TRUE(product_is_exact(quarters, 0.25 * lattice.width));
        }
}

TEST(Lattice, PositionsAreExactAndTheMeshIsWellInside) {
    for (const auto& entry : zoo::all())
        for (int depth = 0; depth <= max_depth; ++depth) {
            const Box box = octree::bounds(entry.mesh);
            const octree::Lattice lattice = octree::make_lattice(box, depth);
            expect_exact_positions(lattice);
            for (int axis = 0; axis < 3; ++axis) {
                const double side = box.max[axis] - box.min[axis];
                EXPECT_LE(side, lattice.scale()) << entry.name;
                const double margin = 0.375 * lattice.scale();  // s/2, less the rounding of the centre
                EXPECT_GE(lattice.cells(), 8u) << "room for surfaces";
                EXPECT_EQ(lattice.resolution_depth(), depth);
                EXPECT_GE(box.min[axis] - lattice.position(axis, 0), margin) << entry.name << depth;
                EXPECT_GE(lattice.position(axis, lattice.cells()) - box.max[axis], margin)
                    << entry.name << depth;
            }
        }
}

TEST(Lattice, ScaleIsTheLongestSideRoundedUp) {
    const octree::Lattice exact = octree::make_lattice({{0, 0, 0}, {1, 0.5, 0.25}}, 5);
    EXPECT_EQ(exact.scale(), 1.0);
    EXPECT_EQ(exact.width, 0x1p-5);
    const octree::Lattice rounded = octree::make_lattice({{0, 0, 0}, {1 + 0x1p-40, 0.5, 0.25}}, 5);
    EXPECT_EQ(rounded.scale(), 1 + 0x1p-23);
}

TEST(Lattice, FarMeshesGetACoarserScaleAndThenAreRefused) {
    const octree::Lattice far =
        octree::make_lattice({{1e6, 1e6, 1e6}, {1e6 + 0.15, 1e6 + 0.15, 1e6 + 0.15}}, 9);
    expect_exact_positions(far);
    EXPECT_LT(far.scale(), 0.15 * (1 + 0x1p-7));
    try {
        octree::make_lattice({{1e12, 0, 0}, {1e12 + 0.15, 0.1, 0.1}}, 9);
        FAIL() << "must be refused";
    } catch (const InputError& e) {
        EXPECT_THAT(e.what(), testing::HasSubstr("too far"));
    }
}

TEST(Lattice, ExtremeSizes) {
    for (const double size : {1e-70, 1e-9, 1e9, 1e70})
        expect_exact_positions(octree::make_lattice({{0, 0, 0}, {size, size / 3, 0}}, 12));
    EXPECT_THROW(octree::make_lattice({{0, 0, 0}, {1e-80, 0, 0}}, 4), InputError);
    EXPECT_THROW(octree::make_lattice({{0, 0, 0}, {1e80, 0, 0}}, 4), InputError);
    EXPECT_NO_THROW(octree::make_lattice({{3, 3, 3}, {3, 3, 3}}, 4)) << "a single point has a lattice too";
    EXPECT_NO_THROW(octree::make_lattice({{0, 0, 0}, {0, 0, 0}}, 4));
}

TEST(Lattice, MappingErrorBoundHolds) {
    const octree::Lattice lattice = octree::make_lattice({{0.1, 0.2, 0.3}, {1.3, 1.7, 1.9}}, 9);
    for (int i = 0; i < 10000; ++i) {
        const double t = i / 10000.0;
        const Vec3 p{0.1 + 1.2 * t, 0.2 + 1.5 * t, 0.3 + 1.6 * t};
        const Vec3 u = lattice.to_lattice(p);
        for (int axis = 0; axis < 3; ++axis) {
            const long double exact =
                ((long double)p[axis] - (long double)lattice.position(axis, 0)) / (long double)lattice.width;
            EXPECT_LE(double(std::abs(u[axis] - exact)), lattice.mapping_error());
        }
    }
}

}  // namespace
}  // namespace its
