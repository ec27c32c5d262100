#pragma once

#include <cstdint>
#include <span>

#include "mesh/arrays.h"
#include "octree/lattice.h"

/// How much memory a build takes, before it takes it.
namespace its::shell {

/// The numbers that a build's memory depends on.
struct BuildSize {
    std::uint64_t triangles = 0;
    std::uint64_t groups = 0;  ///< sibling groups of all levels
    std::uint64_t surface_cells = 0;
    std::uint64_t pairs = 0;  ///< of a surface cell and a triangle that meets it
    std::uint64_t flips = 0;  ///< of the surface cells: those without triangles, along holes
};

/// What a build uses first of the program: code, and stacks of threads.
inline constexpr std::uint64_t program_pages = 2'000'000;

/// Bytes at the peak of a build of this size.
std::uint64_t build_bytes(const BuildSize& size);

/// What the expected size depends on: sums over triangles, in units of the lattice's scale.
struct MeshMeasure {
    std::uint64_t triangles = 0;
    double area = 0;          ///< of the triangle's shadows along the three axes
    double extent = 0;        ///< along the three axes
    double needles = 0;       ///< the same of triangles that are much longer than wide
    double needle_cells = 0;  ///< that these meet at depth needle_depth, those that lie side by side together
};
inline constexpr int needle_depth = 6;
MeshMeasure measure(const mesh::Arrays& mesh);

/// The expected size at a depth. A convex piece of a plane meets 1 + E + A cells of a lattice whose position is
/// random, E the sum of its extents along the axes and A that of the areas of its shadows along them, lengths
/// in cell widths: the volume of its Minkowski sum with a cell. This gives the pairs. Triangles smaller than a
/// cell share it: a surface without boundary meets A cells, up to its curvature, threads of needles E, or,
/// where they lie side by side, as many as they are found to meet at one depth, in proportion; both up to 8
/// more, and nothing more than the pairs. Each group has a cell as its parent that is met.
BuildSize estimate_size(const MeshMeasure& mesh, int depth);
BuildSize estimate_size(const mesh::Arrays& mesh, int depth);

/// The expected size of a build on this lattice. Cells that M meets are counted, level by level, as long as
/// that takes little, and at most to level 1; from there on they grow as estimate_size() says, and no faster
/// than they did last.
/// \param positions  vertices in lattice coordinates
/// \param triangles  of M, and of what cells without triangles are expected along
BuildSize count_size(const MeshMeasure& mesh, const octree::Lattice& lattice, std::span<const Vec3> positions,
                     std::span<const Triangle> triangles);

/// Refuses builds that would take more than `limit` bytes.
class MemoryBudget {
public:
    /// \param options_limit  bytes, or 0 for three quarters of what is free
    MemoryBudget(const mesh::Arrays& mesh, int depth, std::uint64_t options_limit);

    /// \throws MemoryError if a build of this size exceeds the limit
    void check(const BuildSize& size) const { check(size, size); }

    /// The numbers found at level `level` + 1, before those of `level` are taken.
    /// \throws MemoryError if the finest level, by the least growth that the mesh lets expect, would exceed the
    ///         limit.
    void check_level(int level, std::uint64_t cells, std::uint64_t pairs) const;

private:
    /// \param expected  what the message is about
    void check(const BuildSize& least, const BuildSize& expected) const;

    MeshMeasure mesh_;
    int depth_;
    std::uint64_t limit_;
};

}  // namespace its::shell
