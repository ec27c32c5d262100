#pragma once

#include <cstdint>
#include <limits>
#include <span>
#include <vector>

#include "its/base.h"
#include "simplify/complex.h"
#include "simplify/quadric.h"

/// Edge collapses in the order of quadric errors.
namespace its {

/// An edge collapse that keeps the topology and flips no triangle: u merges into v, which moves to `to`.
struct Collapse {
    std::uint32_t u, v;
    Vec3 to;
    std::span<const std::uint32_t> ring;   ///< triangles around u or v; the first `shared` vanish
    std::uint32_t shared;
    std::span<const std::array<Vec3, 3>> corners;  ///< of each of the others, after the collapse

    std::span<const std::uint32_t> faces() const { return ring.subspan(shared); }
};

/// What may be collapsed, besides topology.
class CollapseRule {
public:
    struct Verdict {
        bool allowed;
        double need = 0;  ///< if not allowed: the least tolerance that might allow it; infinite: none
    };
    virtual ~CollapseRule() = default;

    /// Added to the quadric error; in units of squared length, of the unit box.
    virtual double extra_cost(const Vec3& to) const { return 0 * to.x; }

    /// `tolerance`: mesh units.
    virtual Verdict test(const Collapse& collapse, const Complex& current, double tolerance) = 0;

    /// The collapse tested last is made next.
    virtual void accept() = 0;
};

/// Collapses edges, cheapest first, and those of equal cost in the order of their vertices' numbers.
class Decimator {
public:
    Decimator(Complex& mesh, CollapseRule& rule);

    /// Collapses until `faces` or fewer are left or no collapse is allowed within the tolerance. May be called
    /// again with a larger tolerance. Returns whether `faces` was reached.
    /// \param progress  called now and then with the triangles left; \throws what it throws
    template <class Report>
    bool run(std::uint64_t faces, double tolerance, Report&& progress, double alpha = 1e300) {
        revive(tolerance);
        refusals_ = 0;
        for (;;) {
            while (!heap_.empty() && mesh_.living_triangles() > faces) {
                step(tolerance);
                if (refusals_ > alpha * mesh_.living_triangles()) return false;
                if ((++steps_ & 1023) == 0) progress(mesh_.living_triangles());
            }
            if (mesh_.living_triangles() <= faces) return true;
            if (!revive(tolerance)) return false;
        }
    }

    /// The least tolerance above `tolerance` with which a collapse that was refused may be allowed; infinite if
    /// there is none.
    double next_tolerance(double tolerance) const;

    std::uint64_t tests() const { return tests_; }

private:
    struct Candidate {
        double cost;
        std::uint32_t u, v;
        std::uint32_t stamp;  ///< sum of the vertices' stamps when the cost was computed
        bool operator<(const Candidate& o) const {  // for a heap with the cheapest on top
            return cost != o.cost ? cost > o.cost : u != o.u ? u > o.u : v > o.v;
        }
    };
    struct Refused {
        Candidate candidate;
        std::uint64_t when;  ///< number of collapses made by then
        double need;
    };

    Vec3 scaled(const Vec3& p) const { return (1 / scale_) * (p - centre_); }
    void sum_quadrics();
    void push(std::uint32_t a, std::uint32_t b);
    double place(std::uint32_t u, std::uint32_t v, Vec3& to) const;
    bool is_current(const Candidate& c) const {
        return mesh_.has_vertex(c.u) && mesh_.has_vertex(c.v) && stamp_[c.u] + stamp_[c.v] == c.stamp;
    }
    bool flips(const Collapse& collapse) const;
    void step(double tolerance);
    void make(const Collapse& collapse);
    bool revive(double tolerance);

    Complex& mesh_;
    CollapseRule& rule_;
    Vec3 centre_;
    double scale_ = 1;
    std::vector<Quadric> quadric_;
    std::vector<std::uint32_t> stamp_;       ///< changes with position and quadric
    std::vector<std::uint64_t> last_change_; ///< number of the last collapse that changed the vertex's star
    std::vector<Candidate> heap_;
    std::vector<Refused> refused_;
    std::uint64_t refusals_ = 0;
    std::uint64_t collapses_ = 0, steps_ = 0, tests_ = 0;
    std::vector<std::uint32_t> ring_, around_;
    std::vector<std::array<Vec3, 3>> corners_;
};

}  // namespace its
