#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string_view>

#include "its/base.h"
#include "its/mesh.h"

/// Exact closest points of a mesh, sides by them, and measured distances between meshes; without any shell.
namespace ITS_API its {

/// The point of M nearest to a query point.
struct ClosestPoint {
    static constexpr std::uint64_t no_triangle = ~std::uint64_t{0};

    Vec3 point;                            ///< on the triangle, up to rounding
    double distance = 0;                   ///< mesh units, ≥ 0
    std::uint64_t triangle = no_triangle;  ///< index in the mesh; the lowest of those equally near
    std::array<double, 3> barycentric{};   ///< of its three corners, in order; each in [0, 1], sum 1
};

/// A search tree over a mesh's triangles; some 600 bytes a triangle, about a second per million triangles to
/// build. Copies share the same data. All members may be called from any number of threads.
/// A hierarchy of boxes, split by the surface area heuristic: docs/design/distance.md.
///
/// Exact: the distance is that of the nearest of all triangles. Its error is at most 144u·R, u = 2⁻⁵³ and R
/// the largest of the coordinates and of |query − M|; in all tests it is below 8u·R. At every size: what is
/// below the least double is rounded to it, and a distance beyond all doubles is infinite.
class ClosestPoints {
public:
    /// Copies the mesh. Reports no progress.
    /// \throws InputError (no triangles, non-finite coordinates, or so small beside the largest, by 10²⁹⁰ and
    ///         more, that no computation has both, indices out of range), OptionError (run)
    explicit ClosestPoints(const MeshView& mesh, const Run& run = {});

    /// The closest point to one point. Allocates nothing.
    /// \throws InputError if it is not finite.
    ClosestPoint find(const Vec3& point) const;

    /// The same for many: results[i] for points[i], the same bits as those of single calls, in whatever order
    /// they come. Points near to each other are searched together: four to eight times as fast, from a tenth as
    /// many points as triangles on. Takes 40 bytes a point, of 2¹⁸ points at most. A non-finite point gets
    /// no_triangle and NaN.
    /// \throws OptionError if the two spans differ in size, or by run; Cancelled.
    void find(std::span<const Vec3> points, std::span<ClosestPoint> results, const Run& run = {}) const;

    std::uint64_t memory_bytes() const;  ///< of the tree, without its copy of the mesh

private:
    struct Data;
    std::shared_ptr<const Data> data_;
};

/// Where a point is. The values are the codes of batches.
enum class Side : std::int8_t { inside = -1, on_surface = 0, outside = 1, uncertain = 3 };

/// "inside", "on_surface", "outside", "uncertain".
std::string_view name(Side side);
/// The side of that name; empty: there is none.
std::optional<Side> parse_side(std::string_view name);

/// Sides by the nearest point of a mesh: the side of the pseudonormal there (the triangle's normal, or the sum
/// of those of the triangles at its edge, or of those at its vertex weighted by their angles: Bærentzen and
/// Aanæs 2005). Right, up to rounding, for closed meshes without self-intersections or triangles of zero area;
/// Query::classify() is exact for all, and many times as fast. Copies share the same data. Members may be
/// called from any number of threads.
class ClosestSides {
public:
    /// Copies the mesh: that of a shell (ThinShell::mesh_view()), or any whose triangles face outward. Reports
    /// no progress.
    /// \throws InputError (as ClosestPoints, or an edge that is not used as often in one direction as in the
    ///         other), OptionError (run), MemoryError
    explicit ClosestSides(const MeshView& mesh, const Run& run = {});

    /// \throws InputError if a coordinate is NaN or infinite
    Side side(const Vec3& point) const;

private:
    struct Data;
    std::shared_ptr<const Data> data_;
};

/// One-sided distances d(x, other mesh) of the points x of a mesh, measured at some of them. Mesh units, ≥ 0.
struct MeshDistance {
    double max = 0;  ///< a lower bound of the one-sided Hausdorff distance, exact at the points measured
    double mean = 0, root_mean_square = 0;  ///< by area; 0 without area or samples
};

/// Measures how far `from` is from `to`, with exact closest points: at all vertices that triangles use (for max
/// alone), and at `samples` points, one for each of as many equal parts of the area. No seed is needed: the
/// points are quasi-random, and the result is the same bits for any number of threads.
/// At every size, as ClosestPoints; what is 10³⁰⁰ times smaller than the larger mesh counts as 0.
/// \param samples  0: vertices alone
/// \throws InputError (as ClosestPoints, for either mesh), OptionError (run), Cancelled.
MeshDistance mesh_distance(const MeshView& from, const MeshView& to, std::uint64_t samples = 200'000,
                           const Run& run = {});

}  // namespace its
