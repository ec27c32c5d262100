#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "simplify/complex.h"
#include "simplify/frame.h"
#include "simplify/shadow.h"

/// The proof that a mesh under simplification and the mesh it came from stay within a distance of each other,
/// in both directions. See docs/design/simplify.md.
namespace its::simplifier {

/// Keeps, for every triangle of the original, the faces of the current mesh that prove it to be near: its
/// witnesses. A collapse replaces the faces around its edge; it is allowed if every original triangle with a
/// witness among them is proven near the new faces (and its other witnesses), and every new face is proven near
/// the original.
class Deviation {
public:
    /// The current mesh is the original.
    explicit Deviation(const Complex& original);

    struct Verdict {
        bool proven;
        double need;  ///< if not proven: a tolerance below which it cannot be, or 0
    };

    /// Whether replacing the triangles `ring` by those of `frames`, which become numbers `faces`, keeps all
    /// within `tolerance` in both directions. Nothing is changed.
    Verdict test(std::span<const std::uint32_t> ring, std::span<const std::uint32_t> faces,
                 std::span<const Frame> frames, const Complex& current, double tolerance);

    /// Makes the replacement that was tested last, and proven.
    void accept();

    /// The least tolerance that can be used: below it, rounding decides.
    double rounding() const { return rounding_; }

    /// Throws std::logic_error at the first broken invariant; for tests.
    void validate(const Complex& current, double tolerance) const;

private:
    static constexpr std::size_t near_witnesses = 4;

    /// A triangle of the original: all that the inner loops need of it in one cache line.
    struct alignas(64) Original {
        Triangle corner;
        std::array<std::uint32_t, 3> neighbour;  ///< across edge (k, k + 1); no_index at boundary and forks
        std::uint32_t mark = 0, flood_mark = 0;
        std::array<std::uint32_t, near_witnesses> witness;  ///< faces; no_index past the last
        std::uint32_t more = no_index;                      ///< where in more_ the others stand
    };
    struct alignas(32) Vertex {
        Vec3 at;
        std::uint32_t mark = 0, local = 0;  ///< local: number in the region
    };
    /// A face's original triangles: list_[begin … begin + count).
    struct List {
        std::uint64_t begin = 0;
        std::uint32_t count = 0;
    };
    struct Piece {
        std::array<Vec3, 3> corner;
        std::array<std::uint64_t, 3> near;  ///< bit j: target j is within the tolerance
    };

    void gather(std::span<const std::uint32_t> ring);
    bool add_other_witnesses(const Complex& current);
    double measure_points();
    bool cover_originals();
    bool cover(std::array<Vec3, 3> corner, std::array<std::uint64_t, 3> near, std::span<const Frame> targets,
               std::span<const EdgeTerms> terms, std::uint64_t& used);
    bool cover_face(const Frame& face, std::size_t number);
    bool cover_by_projection(const Frame& face, std::size_t number, double inset);
    /// What comes of growing S: it has a triangle too high over the core or an edge over it without neighbour;
    /// it covers the core; or rounding may decide how often it covers the point.
    enum class Flood : std::uint8_t { leaves, covers, unsure };
    Flood flood_from(std::uint32_t seed, const Frame& face, const Core& core, double height, double px,
                     double py);
    std::uint32_t triangle_over(const Frame& face, const Core& core, double height, std::size_t number,
                                double px, double py) const;
    Shadow shadow(const Frame& face, std::uint32_t triangle) const;
    bool cover_by_pieces(const Frame& face);
    std::uint64_t near_targets(const Vec3& p, std::span<const Frame> targets, std::span<const EdgeTerms> terms,
                               std::uint64_t among) const;
    template <class F>
    void for_witnesses(const Original& t, F&& fn) const;
    template <class Keep>
    void filter_witnesses(Original& t, Keep&& keep);
    bool add_witness(Original& t, std::uint32_t face);
    void compact_lists();

    std::vector<Vertex> vertex_;
    std::vector<Original> original_;
    double size_ = 0, rounding_ = 0;

    std::vector<List> list_of_face_;
    std::vector<std::uint32_t> list_;
    std::uint64_t listed_ = 0;                      ///< entries of list_ that are in use
    std::vector<std::vector<std::uint32_t>> more_;  ///< further witnesses of triangles with many

    // Scratch of one test.
    double limit_ = 0, limit2_ = 0, needed2_ = 0;
    std::uint32_t epoch_ = 0;
    std::uint32_t flood_epoch_ = 0;
    std::vector<std::uint32_t> face_mark_, region_;
    std::vector<double> x_, y_, z_, distance2_;
    std::vector<std::uint64_t> near_;
    std::vector<std::uint32_t> old_faces_, target_face_;
    std::vector<Frame> target_;
    std::vector<EdgeTerms> terms_;
    struct Witness {
        std::uint32_t triangle, target;
    };
    std::vector<Witness> witness_;
    std::vector<Piece> pieces_;
    std::vector<std::uint32_t> flood_;
    std::vector<Frame> candidates_;
    std::vector<EdgeTerms> candidate_terms_;
};

}  // namespace its::simplifier
