#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "geometry/solid_angle.h"
#include "its/mesh.h"

/// A surface F that closes a mesh with boundary, and its winding number.
///
/// Edges whose uses by the triangles of M do not cancel, each as often as its excess, form closed loops. F
/// fills each loop by halving it again and again, so that ∂F = −∂M and M + F is a cycle: the winding number of
/// M is that of M + F, a whole number, less that of F. Neither depends on which surface F is. See
/// docs/design/signs.md.
namespace its {

/// A winding number and a bound on its error.
struct WindingEstimate {
    double value = 0, error = 0;
};

class Filling {
public:
    /// \throws InputError on what inspect() refuses.
    explicit Filling(const Mesh& mesh);

    bool empty() const { return nodes_.empty(); }
    std::uint64_t edges() const { return edge_count_; }  ///< of the boundary, with multiplicity
    std::uint64_t loops() const { return loop_count_; }

    /// F. Its triangles have the direction that continues M's, and corners at M's vertices.
    const Mesh& surface() const { return surface_; }

    /// The winding number of F near a ball, ready for many of its points. Patches of F that are far from it
    /// are expanded about the centre to second order; the triangles of the others one by one.
    class Local {
    public:
        static constexpr int block = 28;  ///< points taken at once: a cube's 27

        struct Points {
            double x[block], y[block], z[block];
        };
        struct Estimates {
            double value[block], error[block];
        };

        /// At points of the ball. The error is infinite, or nearly, where a point is in F but for rounding.
        void at(const Points& points, Estimates& out);
        WindingEstimate at(const Vec3& point) const;

        /// |w(q) − w(centre)| for all points q of the ball, but for whole numbers where the way crosses F.
        double variation() const;
        /// Whether F stays away from the ball, so that variation() holds without exception.
        bool clear() const { return clear_; }

    private:
        friend class Filling;
        double far(const Vec3& offset) const;
        double rounding() const;
        /// What is far, expanded about the centre: value_ + gradient_·b + ½ b·hessian_ b.
        Vec3 centre_, gradient_;
        std::array<Vec3, 3> hessian_;
        double radius_ = 0, value_ = 0, error_ = 0;
        Vec3 near_gradient_;  ///< at the centre, of what is near
        double bend_ = 0;     ///< what is near differs over the ball by at most this from its tangent
        bool clear_ = true;
        struct Seen {
            double x[block], y[block], z[block], length[block];
        };
        static void see(const Vec3& vertex, const Points& points, Seen& seen);
        static void add(const Seen& a, const Seen& b, const Seen& c, AngleSums<block>& sums, double* doubtful);

        std::vector<Vec3> vertices_;       ///< of the near triangles
        std::vector<Triangle> triangles_;  ///< near ones, by number among the vertices
        std::vector<Seen> seen_;
    };

    /// What balls within a larger ball share: the loops that are far from all of it, expanded about its centre,
    /// and the others.
    class Surroundings {
        friend class Filling;
        Local far_;
        std::vector<std::uint32_t> near_;  ///< nodes of loops, or of several
    };

    /// \param surroundings  receives the result; its memory is used again
    void surround(const Vec3& centre, double radius, Surroundings& surroundings) const;

    /// The same as below for points that are in the surroundings' ball, too.
    void localise(const Vec3& centre, double radius, double tolerance, const Surroundings& surroundings,
                  Local& local) const;

    /// \param radius  of the ball, ≥ 0
    /// \param tolerance  patches are expanded where the error of that is smaller than this; > 0
    /// \param local  receives the result; its memory is used again
    void localise(const Vec3& centre, double radius, double tolerance, Local& local) const;

    /// The boundary term of the antipodal method: the winding number of M at p is the signed crossings of M by
    /// the ray from p in direction −x (geometry/predicates.h), plus this. Like those, it is that of the
    /// displaced point. Time proportional to edges().
    WindingEstimate boundary_term(const Vec3& p) const;

    /// Signed crossings of F by the ray from p, displaced, in direction −x: exact.
    int crossings(const Vec3& p) const;

private:
    static constexpr std::uint32_t none = ~std::uint32_t{0};

    /// A part of F with its moments about its centroid; the patch of a chain of edges (with a chord from the
    /// last point back to the first), of a loop, or of several loops.
    struct Node {
        Vec3 centre;
        double radius = 0;                   ///< of a sphere about the centre that holds it
        Vec3 moment;                         ///< ∫ n dA
        double area = 0;                     ///< ∫ dA
        std::array<Vec3, 3> first;           ///< ∫ n aᵀ dA made symmetric, a = x − centre
        std::array<double, 10> second = {};  ///< ∫ (n·r)(a·r)² dA, coefficients of a cubic in r
        double square = 0;                   ///< bound on ∫ |a|² dA
        double linear = 0;                   ///< bound on ∫ |a| dA
        double chord = 0;                    ///< its length; 0: none
        std::array<std::uint32_t, 2> ends = {none, none};  ///< of the chain; equal for a loop
        std::uint32_t middle = none;  ///< of the chain: the triangle is (ends[0], middle, ends[1])
        std::uint32_t left = none, right = none;
    };
    std::uint32_t add_chain(std::span<const std::uint32_t> chain);
    std::uint32_t add_union(std::span<const std::uint32_t> roots);
    static Node triangle(std::span<const Vec3> corners);
    static void add_moments(const Node& part, const Vec3& offset, Node& node);
    std::uint32_t finish(Node node, std::span<const Vec3> corners);
    void collect(std::uint32_t index, std::uint32_t first, std::uint32_t last, double tolerance,
                 Local& local) const;
    void collect_loops(std::uint32_t index, Surroundings& surroundings) const;
    static void clear(const Vec3& centre, double radius, Local& local);
    bool comes_near(const Node& node, double gap, const Local& local) const;
    double far_error(const Node& node, double length, double gap, double ball) const;
    static void add_far(const Node& node, double length, double error, Local& local);
    void add_edge(const Node& node, double distance, Local& local) const;

    Mesh surface_;
    std::vector<Node> nodes_;
    std::vector<std::uint32_t> chain_;  ///< the loops' points one after another, each loop's first one repeated
    std::vector<std::uint64_t> chain_begin_;
    double reach_ = 0;  ///< the largest coordinate
    std::uint32_t root_ = none;
    std::uint64_t edge_count_ = 0, loop_count_ = 0;
};

}  // namespace its
