#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "simplify/complex.h"
#include "simplify/frame.h"

/// The proof that a mesh under simplification and the mesh it came from stay within a distance of each other,
/// in both directions. See docs/design/simplify.md.
namespace its {

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
    struct Link {
        std::uint32_t triangle, face;
        std::uint32_t next_of_face, next_of_triangle;
    };
    struct Edges {
        std::array<std::uint32_t, 3> neighbour;  ///< across edge (k, k + 1); no_index at boundary and forks
    };
    struct Piece {
        std::array<Vec3, 3> corner;
        std::array<std::uint64_t, 3> near;  ///< bit j: target j is within the tolerance
    };

    void gather(std::span<const std::uint32_t> ring);
    bool add_other_witnesses(const Complex& current);
    double measure_points(std::size_t faces);
    bool cover_originals(std::size_t& failed);
    bool cover(std::array<Vec3, 3> corner, std::array<std::uint64_t, 3> near, std::span<const Frame> targets,
               std::span<const EdgeTerms> terms, std::uint64_t& used);
    bool cover_face(const Frame& face, std::size_t number);
    bool cover_by_projection(const Frame& face, std::size_t number, double inset);
    bool cover_by_pieces(const Frame& face);
    std::uint64_t near_targets(const Vec3& p, std::span<const Frame> targets,
                               std::span<const EdgeTerms> terms) const;
    void register_witness(std::uint32_t triangle, std::uint32_t face);

    std::vector<Vec3> position_;
    std::vector<Triangle> triangle_;
    std::vector<Edges> edges_;
    double size_ = 0, rounding_ = 0;

    std::vector<Link> links_;
    std::uint32_t free_link_ = no_index;
    std::vector<std::uint32_t> first_of_face_, first_of_triangle_;

    // Scratch of one test.
    double limit_ = 0, limit2_ = 0;
    std::uint32_t epoch_ = 0;
    std::vector<std::uint32_t> triangle_mark_, vertex_mark_, face_mark_, flood_mark_;
    std::uint32_t flood_epoch_ = 0;
    std::vector<std::uint32_t> local_;                 ///< of a vertex: its number in the region
    std::vector<std::uint32_t> region_, region_point_triangle_;
    std::vector<double> x_, y_, z_, distance2_;
    std::vector<std::uint64_t> near_;
    std::vector<std::uint32_t> old_faces_, target_face_;
    std::vector<Frame> target_;
    std::vector<EdgeTerms> terms_;
    std::vector<std::array<std::uint32_t, 2>> witness_;  ///< (original triangle, face)
    std::vector<Piece> pieces_;
    std::vector<std::uint32_t> flood_;
    std::vector<Frame> candidates_;
    std::vector<EdgeTerms> candidate_terms_;
};

}  // namespace its
