#pragma once

#include <atomic>
#include <cstdint>
#include <memory>
#include <vector>

#include "its/distance.h"
#include "octree/morton.h"
#include "query/index.h"
#include "winding/mesh_winding.h"
#include "winding/octants.h"

/// Sides by the generalized winding number w > ½ of a mesh with boundary. See docs/design/query.md.
namespace its::query {

/// Where w stays away from ½ + Z, its nearest whole number n changes at M alone, as the winding number of a
/// closed mesh does: such cubes are *steady*, and all that is done for closed meshes holds for n. A tree tells
/// them from the others, and knows w there, as a quadratic function with a proven error, or not at all.
class OpenSides {
public:
    /// \param index  of a shell under SignRule::generalized; its levels must be there
    explicit OpenSides(const QueryIndex& index);

    OpenSides(const OpenSides&) = delete;
    OpenSides& operator=(const OpenSides&) = delete;

    /// Whether a cell of the grid is not steady.
    /// \param place  QueryIndex::top_index(), or one past the grid
    bool unsteady(std::uint64_t place) const { return start_[place] != 0; }

    /// The node of the cube that holds a point of such a cell.
    /// \param u  its lattice coordinates, in the root cube
    std::uint32_t resolve(const QueryIndex& index, const Vec3& u) const {
        const octree::Cell at = place_of(u);
        std::uint32_t node = start_[index.top_index(finest_cell(u))];
        for (int bit = bits_ - 1 - grid_bits_; node >> kind_shift == halved; --bit)
            node = nodes_[8 * std::uint64_t{node & number_mask} + child_at(at, bit)];
        return node;
    }
    static bool is_steady(std::uint32_t node) { return node >> kind_shift == steady; }

    /// The side of a point in the cube of a node that is not steady.
    Side side(const QueryIndex& index, std::uint32_t node, const Vec3& point, const Vec3& u) const;

    /// n of a surface cell's lowest corner, displaced, and of which corners n ≥ 1, in a steady cube.
    struct Numbers {
        std::int64_t lowest;
        unsigned inside;
    };
    /// Found once for each cell.
    Numbers numbers(const QueryIndex& index, const SurfacePoint& at, std::uint64_t cell) const;

    /// Puts the sides of the grid's cells that are in one leaf and on one side into the grid.
    void settle(std::vector<std::uint32_t>& top);

    const winding::MeshWinding& winding() const { return winding_; }

    std::uint64_t memory_bytes() const;

private:
    /// Kinds of nodes, in the upper bits; the lower ones say which.
    enum Kind : std::uint32_t { steady = 0, outside, inside, unknown, quadratic, halved };
    static constexpr int kind_shift = 29;
    static constexpr std::uint32_t with_mesh = 1u << 28;  ///< in a cell that meets M
    static constexpr std::uint32_t number_mask = with_mesh - 1;

    /// w as a quadratic function of t, [−1, 1]³ in the cube: with M in the cell that of points with no triangle
    /// between them and the centre, displaced.
    struct Quadratic {
        float value, gradient[3], hessian[6];  ///< xx, yy, zz, xy, xz, yz
        float error;
        std::int32_t depth;  ///< of the cube
    };
    /// What the shell has at a cube: cells that divide it, or the leaf that holds it.
    struct Below {
        enum { divided, empty, surface } kind;
        std::uint64_t group;
        unsigned child;
        int level;
    };
    struct Cube {
        int depth;  ///< the root's is 0
        octree::Cell at;
        Below below;
    };

    octree::Cell place_of(const Vec3& u) const {
        octree::Cell at;
        for (int axis = 0; axis < 3; ++axis)
            at[std::size_t(axis)] = std::uint32_t(std::int32_t(fine_ * u[axis]));
        return at;
    }
    /// \throws MemoryError if the number has more bits than there are
    static std::uint32_t node_of(Kind kind, std::uint64_t number = 0);
    static Below below(const QueryIndex& index, std::uint64_t group, unsigned child, int level);
    static Cube half_of(const QueryIndex& index, const Cube& cube, unsigned child);
    static bool meets_mesh(const QueryIndex& index, const Below& below);
    Vec3 centre_of(const QueryIndex& index, int depth, const octree::Cell& at) const;
    std::uint32_t halve(const QueryIndex& index, const Cube& cube, const winding::Octants& from, int lane);
    std::uint32_t judge(const QueryIndex& index, const Cube& cube, const winding::Octants& octants, int lane);
    std::uint32_t add_function(const Cube& cube, const winding::Octants::Quadratic& w, const Vec3& centre,
                               bool mesh);
    std::uint32_t add_number(const Cube& cube, double number);
    void fill_start(std::uint32_t node, int depth, const octree::Cell& at);
    static double value_at(const Quadratic& function, const Vec3& t);
    Numbers find_numbers(const QueryIndex& index, const SurfacePoint& at) const;
    Side by_sum(const Vec3& point) const;

    winding::MeshWinding winding_;
    Box bounds_;            ///< of M: inside ends there
    double side_;           ///< of the root cube, mesh units
    int finest_;            ///< depth of cubes that are not halved any more, but for leaves of the shell
    int bits_, grid_bits_;  ///< of places along an axis: of the finest cubes, of the grid's cells
    double fine_;           ///< cubes of depth bits_ in a finest cell, along an axis
    double slack_;          ///< how far points may be from where they are mapped to; mesh units
    std::vector<winding::Octants> octants_;  ///< by depth of the cube that they halve; while this is made
    std::vector<std::uint32_t> nodes_;       ///< eight of each halved cube
    std::vector<Quadratic> functions_;
    std::vector<std::uint32_t> start_;  ///< of each cell of the grid, and one past it
    /// Of surface cells; 0: not known. The same whoever finds it.
    std::unique_ptr<std::atomic<std::uint32_t>[]> numbers_;
    std::uint64_t cells_;
};

}  // namespace its::query
