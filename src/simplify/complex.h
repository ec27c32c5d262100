#pragma once

#include <array>
#include <cstdint>
#include <limits>
#include <span>
#include <vector>

#include "mesh/arrays.h"
#include "simplify/numbers.h"

/// The mesh that edge collapses work on: triangles, and at each vertex the list of its corners, in flat arrays.
namespace its::simplifier {

inline constexpr std::uint32_t no_index = std::numeric_limits<std::uint32_t>::max();

/// A simplicial complex of triangles, manifold or not. Corner 3t + k is corner k of triangle t.
class Complex {
public:
    /// Vertices with identical coordinates become one. Vertices of edges with more than two triangles, of stars
    /// that are more than one fan, and of triangles that have a corner twice are fixed: they never move and
    /// never go.
    ///
    /// \param wedges  for each triangle numbers of its corners' wedges, each of one position only; empty: none.
    ///        An edge whose two triangles have different wedges at an end is a *seam*. A vertex that two seam
    ///        edges divide into two wedges moves along the seam only, by merging with its ends; other vertices
    ///        of seams are fixed.
    explicit Complex(const mesh::Arrays& mesh, std::span<const Triangle> wedges = {});

    std::uint64_t vertices() const { return position_.size(); }   ///< gone ones included
    std::uint64_t triangles() const { return triangle_.size(); }  ///< gone ones included
    std::uint64_t living_triangles() const { return living_; }
    const Vec3& position(std::uint32_t v) const { return position_[v]; }
    const Triangle& triangle(std::uint32_t t) const { return triangle_[t]; }
    bool has_triangle(std::uint32_t t) const { return triangle_[t][0] != no_index; }
    bool has_vertex(std::uint32_t v) const { return head_[v] != no_index; }
    bool is_fixed(std::uint32_t v) const { return kind_[v] == Kind::fixed; }
    bool on_boundary(std::uint32_t v) const { return kind_[v] == Kind::boundary; }
    bool on_seam(std::uint32_t v) const { return kind_[v] == Kind::seam; }
    /// Where two vertices merge, the one of higher rank holds its line or place: 0 inner, 1 boundary or seam, 2
    /// fixed.
    int rank(std::uint32_t v) const { return kind_[v] == Kind::inner ? 0 : kind_[v] == Kind::fixed ? 2 : 1; }
    std::uint32_t number_in_mesh(std::uint32_t v) const { return source_[v]; }

    bool has_wedges() const { return !wedge_.empty(); }
    std::uint32_t wedge(std::uint32_t t, std::uint32_t corner) const { return wedge_[3 * t + corner]; }
    /// The wedge that this one has become part of, or itself.
    std::uint32_t merged_into(std::uint32_t wedge) const { return merged_into_[wedge]; }
    /// Whether the edge of triangle t from corner k to the next is a seam.
    bool is_seam(std::uint32_t t, std::uint32_t k) const;
    std::uint64_t seam_edges() const;

    /// fn(triangle, corner 0 to 2) for each triangle around v; those of no area by a double corner twice.
    template <class F>
    void for_star(std::uint32_t v, F&& fn) const {
        for (std::uint32_t c = head_[v]; c != no_index; c = next_[c]) fn(c / 3, c % 3);
    }

    /// Appends the triangles around u or v: first those around both.
    /// \return how many are around both
    std::uint32_t ring(std::uint32_t u, std::uint32_t v, std::vector<std::uint32_t>& triangles) const;

    /// The link condition (Dey et al. 1999), with a vertex at infinity joined to the boundary: merging u and v
    /// changes no topology. `triangles`, `shared`: their ring. u is not fixed.
    bool can_merge(std::uint32_t u, std::uint32_t v, std::span<const std::uint32_t> triangles,
                   std::uint32_t shared);

    /// Merges u into v, which moves to `to`; the `shared` first triangles of their ring go.
    void merge(std::uint32_t u, std::uint32_t v, const Vec3& to, std::span<const std::uint32_t> triangles,
               std::uint32_t shared);

    /// Rounds all coordinates to such numbers. Returns by how much a point was moved at most.
    double round_to(const Numbers& numbers);

    /// The fewest triangles that any mesh with these components and their topology has, by Euler's formula and
    /// the number of edges between that many vertices (Heawood); fixed and open parts count 1 each.
    std::uint64_t fewest_triangles() const;

    /// Throws std::logic_error at the first broken invariant; for tests.
    void validate() const;

private:
    enum class Kind : std::uint8_t { inner, boundary, seam, fixed };

    Kind kind_of(std::uint32_t v, std::vector<std::array<std::uint32_t, 2>>& links) const;
    Kind kind_with_seams(std::uint32_t v, Kind kind) const;
    std::uint32_t wedge_at(std::uint32_t t, std::uint32_t v) const;
    bool differ(std::uint32_t s, std::uint32_t t, std::uint32_t u, std::uint32_t v) const;
    bool seam_can_merge(std::uint32_t u, std::uint32_t v, std::span<const std::uint32_t> shared) const;
    void merge_wedges(std::uint32_t u, std::uint32_t v, bool v_goes, std::span<const std::uint32_t> shared);
    std::uint32_t triangles_at_edge(std::uint32_t u, std::uint32_t v) const;

    std::vector<Vec3> position_;
    std::vector<std::uint32_t> source_;  ///< a vertex of the mesh with this position
    std::vector<Triangle> triangle_;     ///< corner 0 is no_index when it is gone
    std::vector<std::uint32_t> head_;    ///< first corner at each vertex; no_index when it is gone
    std::vector<std::uint32_t> next_;    ///< next corner at the same vertex
    std::vector<Kind> kind_;
    std::vector<std::uint32_t> wedge_, merged_into_;  ///< of each corner; of each wedge. Empty: there are none
    std::uint64_t living_ = 0;
    std::vector<std::uint64_t> mark_;  ///< of a vertex: scratch of can_merge
    std::uint64_t epoch_ = 0;
};

}  // namespace its::simplifier
