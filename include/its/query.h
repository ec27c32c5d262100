#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string_view>

#include "its/base.h"
#include "its/distance.h"
#include "its/shell.h"

/// Questions to a shell, one point or millions: inside or outside (exact, or from the shell alone), f, its
/// gradient, bounds of the true distance. Points and lengths are in mesh units.
namespace ITS_API its {

/// Where a point is by f alone: f < ε₁, ε₁ ≤ f ≤ ε₂, f > ε₂.
enum class ShellSide : std::int8_t { inside = -1, on_shell = 0, outside = 1 };

/// "inside", "on_shell", "outside".
std::string_view name(ShellSide side);
/// The side of that name; empty: there is none.
std::optional<ShellSide> parse_shell_side(std::string_view name);

/// The code of a point with a coordinate that is NaN or infinite, in batches of sides.
inline constexpr std::int8_t not_finite = 2;

/// A proven enclosure: lower ≤ the true value ≤ upper.
struct Interval {
    double lower = 0, upper = 0;
};

/// A winding number: the true one is at most `error` away. Error 0: it is whole, and exact.
struct WindingNumber {
    double value = 0, error = 0;
};

namespace query {
struct Access;  // the library's own way in
}

/// Answers for one shell. Cheap to copy: copies share the shell and a small index, which is made in
/// milliseconds whatever the size of the shell; under SignRule::generalized in a time that grows with the
/// length of the boundary and with what the shell stores beside it. All members may be called from any number
/// of threads; those for one point allocate nothing (but the first winding number, which may make its index,
/// and where a coordinate that is not 0 is below 1e-90 in magnitude: exact predicates then may).
class Query {
public:
    /// Makes the index.
    explicit Query(const ThinShell& shell);

    const ThinShell& shell() const;

    /// The exact side, by the shell's sign rule: decided as if by exact arithmetic, without tolerance.
    /// on_surface iff the point lies on a triangle; else, under SignRule::winding, inside iff its winding
    /// number is at least 1; under SignRule::even_odd iff a ray from it to infinity crosses M an odd number of
    /// times; under SignRule::unsigned_rule never; under SignRule::generalized iff its generalized winding
    /// number is over ½ and it lies in M's bounding box. That is no whole number; where it is so near to ½ that
    /// its proven error, see winding_number(), leaves both sides possible, uncertain. Method:
    /// docs/design/query.md.
    /// \throws InputError if a coordinate is NaN or infinite
    Side classify(const Vec3& point) const;

    /// Whether a point is inside or on the surface.
    /// \param when_uncertain  what to say where classify() says uncertain
    /// \throws InputError as classify(); OptionError where it is uncertain and nothing is said
    bool contains(const Vec3& point, std::optional<bool> when_uncertain = {}) const;

    /// The winding number of M around a point: the sum of the solid angles of the triangles over 4π. Under
    /// SignRule::winding whole and exact, whatever is nested or overlaps; under other rules so if every edge is
    /// used as often one way as the other. Else with a proven error: at most 1e-10, but within some 2⁻⁶⁴ of a
    /// boundary edge, relative to it, where it may be larger, even infinite. On the surface there is no winding
    /// number: NaN. Under other rules than generalized the first call makes another index, of a few dozen bytes
    /// a triangle.
    /// \throws InputError if a coordinate is NaN or infinite
    WindingNumber winding_number(const Vec3& point) const;

    /// The side by f and ε₁, ε₂ alone, as in the paper: every point of M is on_shell, and so is a thin layer
    /// around it.
    /// \throws InputError if a coordinate is NaN or infinite
    ShellSide classify_shell(const Vec3& point) const;

    /// The paper's way to a side for every point: by f where that decides, by the nearest point for those that
    /// are on_shell.
    Side classify_shell(const Vec3& point, const ClosestSides& closest) const;

    /// f, as ThinShell::value (which is slower away from M): the same bits in cells that meet M, elsewhere the
    /// same up to rounding. NaN for a non-finite point.
    double value(const Vec3& point) const;

    /// ∇f, as ThinShell::gradient. NaN for a non-finite point.
    Vec3 gradient(const Vec3& point) const;

    /// Encloses the signed distance to M: its magnitude by |D(g)| − |p − g| and |D(g)| + |p − g| over the grid
    /// points g around p, whose distances D(g) are exact up to a proven rounding, its sign by classify().
    /// Rounding is included. In the root cube no wider than the diagonal of the leaf cell.
    /// \throws InputError if a coordinate is NaN or infinite; OptionError if the shell was built with
    ///         Solver::lscg, whose values are not exact distances, or under SignRule::generalized, whose values
    ///         beside a filled hole are less than the distance
    Interval signed_distance_bound(const Vec3& point) const;

    // Batches: out[i] for points[i]; the spans must be equally long and must not overlap. The results are those
    // of the single calls, but a non-finite point is no error: it gets the code not_finite, or NaN. Few points
    // are answered on the calling thread. Where a call is cancelled some results may have been written.
    // \throws OptionError (spans of different length, run; bounds: as the single call), Cancelled

    /// Codes of Side, and not_finite.
    void classify(std::span<const Vec3> points, std::span<std::int8_t> out, const Run& run = {}) const;
    /// 1 or 0; 0 where a point is not finite.
    void contains(std::span<const Vec3> points, std::span<std::uint8_t> out,
                  std::optional<bool> when_uncertain = {}, const Run& run = {}) const;
    /// Or NaN with error 0 on the surface and where a point is not finite.
    void winding_number(std::span<const Vec3> points, std::span<WindingNumber> out, const Run& run = {}) const;
    /// Codes of ShellSide, and not_finite.
    void classify_shell(std::span<const Vec3> points, std::span<std::int8_t> out, const Run& run = {}) const;
    /// Codes of Side, and not_finite.
    void classify_shell(std::span<const Vec3> points, std::span<std::int8_t> out, const ClosestSides& closest,
                        const Run& run = {}) const;
    /// f in mesh units, or NaN.
    void value(std::span<const Vec3> points, std::span<double> out, const Run& run = {}) const;
    /// ∇f, without unit, or NaN.
    void gradient(std::span<const Vec3> points, std::span<Vec3> out, const Run& run = {}) const;
    /// Enclosures in mesh units, or NaN.
    void signed_distance_bound(std::span<const Vec3> points, std::span<Interval> out,
                               const Run& run = {}) const;

    /// Bytes of the index, beside those of the shell; of the one that winding_number() makes once it has.
    std::uint64_t memory_bytes() const;

private:
    friend struct query::Access;
    struct Data;

    std::shared_ptr<const Data> data_;
};

}  // namespace its
