#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "mesh/arrays.h"
#include "mesh/merged.h"
#include "winding/solid_angle.h"

/// A surface F that closes a mesh with boundary, and its winding number.
///
/// Edges whose uses by the triangles of M do not cancel, each as often as its excess, form closed loops. F
/// fills each loop by halving it again and again, so that ∂F = −∂M and M + F is a cycle: the winding number of
/// M is that of M + F, a whole number, less that of F. Neither depends on which surface F is. See
/// docs/design/signs.md.
namespace its::winding {

/// A winding number and a bound on its error.
struct WindingEstimate {
    double value = 0, error = 0;
};

/// Estimates by expansions decide only where they are this far from a border, beyond their error; all else is
/// left to the sum over the boundary, whose error is far smaller. So all that ask about one point agree.
inline constexpr double decision_gap = 0x1p-20;

/// Bounds on errors of arguments hold where they are below a right angle, a quarter as a winding number.
inline constexpr double useless_error = 0.2;

class Filling {
public:
    explicit Filling(const mesh::Merged& mesh);
    /// \throws InputError on what inspect() refuses.
    explicit Filling(const mesh::Arrays& mesh) : Filling(mesh::merge(mesh)) {}

    bool empty() const { return nodes_.empty(); }
    std::uint64_t edges() const { return edge_count_; }  ///< of the boundary, with multiplicity
    std::uint64_t loops() const { return loop_count_; }

    double boundary_length() const;
    std::uint64_t memory_bytes() const;

    /// F. Its triangles have the direction that continues M's, and corners at M's vertices.
    const Mesh& surface() const { return surface_; }

    /// Points that are near each other, taken at once.
    static constexpr int block = 8;
    struct Points {
        double x[block], y[block], z[block];
    };
    struct Estimates {
        double value[block], error[block];
    };

    /// The winding number of F at points: patches are taken for their moments where the error of that is
    /// smaller than `tolerance`, others triangle by triangle. The error is infinite, or nearly, if a point is
    /// in F but for rounding.
    void winding(const Points& points, double tolerance, Estimates& out) const;
    WindingEstimate winding(const Vec3& point, double tolerance) const;

    /// The boundary term of the antipodal method: the winding number of M at p is the signed crossings of M by
    /// the ray from p in direction −x (geometry/predicates.h), plus this. Like those, it is that of the
    /// displaced point. Time proportional to edges(). The error is infinite where it is not known to be below
    /// useless_error.
    WindingEstimate boundary_term(const Vec3& p) const;
    /// The same with twice a double's digits: where points are so near an edge that a double's do not suffice.
    WindingEstimate precise_boundary_term(const Vec3& p) const;

    /// Signed crossings of F by the ray from p, displaced, in direction −x: exact.
    int crossings(const Vec3& p) const;

private:
    friend class Octants;
    static constexpr std::uint32_t none = ~std::uint32_t{0};

    /// A part of F with its moments about its centroid; the patch of a chain of edges (between it and its chord
    /// from the last point back to the first), of a loop, or of several loops.
    struct Node {
        Vec3 centre;
        double radius = 0;                   ///< of a sphere about the centre that holds it
        Vec3 moment;                         ///< ∫ n dA
        double area = 0;                     ///< ∫ dA
        std::array<Vec3, 3> first;           ///< ∫ n aᵀ dA made symmetric, a = x − centre
        std::array<double, 10> second = {};  ///< ∫ (n·r)(a·r)² dA, coefficients of a cubic in r
        double square = 0;                   ///< bound on ∫ |a|² dA
        double linear = 0;                   ///< bound on ∫ |a| dA
        std::array<std::uint32_t, 2> ends = {none, none};  ///< of the chain; equal for a loop
        std::uint32_t middle = none;  ///< of the chain: the triangle is (ends[0], middle, ends[1])
        std::uint32_t left = none, right = none;
    };
    std::uint32_t add_chain(std::span<const std::uint32_t> chain);
    std::uint32_t add_union(std::span<const std::uint32_t> roots);
    static Node triangle(std::span<const Vec3> corners);
    static void add_moments(const Node& part, const Vec3& offset, Node& node);
    std::uint32_t finish(Node node, std::span<const Vec3> corners);
    template <class F>
    void for_boundary(F&& fn) const;
    struct Sums;
    void collect(std::uint32_t index, Sums& sums) const;
    bool add_patch(const Node& node, Sums& sums) const;
    void add_triangle(const Node& node, Sums& sums) const;

    Mesh surface_;
    std::vector<Node> nodes_;           ///< the last one is all of F
    std::vector<std::uint32_t> chain_;  ///< the loops' points one after another, each loop's first one repeated
    std::vector<std::uint64_t> chain_begin_;
    double reach_ = 0;  ///< the largest coordinate
    std::uint64_t edge_count_ = 0, loop_count_ = 0;
};

}  // namespace its::winding
