#pragma once

#include <array>
#include <cstdint>
#include <limits>
#include <span>
#include <vector>

#include "its/base.h"
#include "simplify/complex.h"
#include "simplify/quadric.h"

/// Edge collapses in the order of quadric errors.
namespace its::simplifier {

/// An edge collapse that keeps the topology and flips no triangle: u merges into v, which moves to `to`.
struct Collapse {
    std::uint32_t u, v;
    Vec3 to;
    std::span<const std::uint32_t> ring;  ///< triangles around u or v; the first `shared` vanish
    std::uint32_t shared;
    std::span<const std::array<Vec3, 3>> corners;  ///< of each of the others, after the collapse

    std::span<const std::uint32_t> faces() const { return ring.subspan(shared); }
};

/// What may be collapsed, besides topology.
class CollapseRule {
public:
    static constexpr double infinite = std::numeric_limits<double>::infinity();
    struct Verdict {
        bool allowed;
        double need = infinite;  ///< if not allowed: the least tolerance that might allow it, as things are
    };
    virtual ~CollapseRule() = default;

    /// Added to the quadric error; in units of squared length, of the unit box.
    virtual double extra_cost(const Vec3&) const { return 0; }

    /// `tolerance`: mesh units.
    virtual Verdict test(const Collapse& collapse, const Complex& current, double tolerance) = 0;

    /// The collapse tested last is made next; `current` is as it was then.
    virtual void accept(const Collapse& collapse, const Complex& current) = 0;

    /// It has been made.
    virtual void made(const Collapse&, const Complex&) {}
};

/// Collapses edges, cheapest first, and those of equal cost in the order of their vertices' numbers.
class Decimator {
public:
    /// \param numbers  new vertices are rounded to such
    Decimator(Complex& mesh, CollapseRule& rule, const Numbers& numbers = {});

    /// Collapses until `faces` or fewer are left or no collapse is allowed within the tolerance. May be called
    /// again with a larger tolerance. Returns whether `faces` was reached.
    /// \param report  called every 1024 steps with the number of triangles that went since the last time;
    /// \throws what report throws
    template <class Report>
    bool run(std::uint64_t faces, double tolerance, Report&& report) {
        std::uint64_t reported = mesh_.living_triangles();
        while (mesh_.living_triangles() > faces && revive(tolerance)) {
            while (!heap_.empty() && mesh_.living_triangles() > faces) {
                step(tolerance);
                if ((++steps_ & 1023) != 0) continue;
                report(reported - mesh_.living_triangles());
                reported = mesh_.living_triangles();
            }
        }
        report(reported - mesh_.living_triangles());
        return mesh_.living_triangles() <= faces;
    }

    /// The least tolerance above `tolerance` with which a collapse that was refused may be allowed; infinite if
    /// there is none.
    double next_tolerance(double tolerance) const;

    std::uint64_t collapses() const { return collapses_; }
    std::uint64_t refused() const { return tests_ - collapses_; }

private:
    struct Candidate {
        double cost;
        std::uint32_t u, v;
        std::uint32_t stamp;                        ///< sum of the vertices' stamps when the cost was computed
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
    Numbers numbers_;
    Vec3 centre_;
    double scale_ = 1;
    std::vector<Quadric> quadric_;
    std::vector<std::uint32_t> stamp_;        ///< changes with position and quadric
    std::vector<std::uint64_t> last_change_;  ///< number of the last collapse that changed the vertex's star
    std::vector<Candidate> heap_;
    std::vector<Refused> refused_;
    std::uint64_t collapses_ = 0, steps_ = 0, tests_ = 0;
    std::vector<std::uint32_t> ring_, around_;
    std::vector<std::array<Vec3, 3>> corners_;
};

}  // namespace its::simplifier
