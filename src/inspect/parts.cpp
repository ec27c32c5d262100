#include "inspect/parts.h"

#include <algorithm>
#include <numeric>
#include <utility>

#include "base/disjoint_sets.h"
#include "geometry/predicates.h"

namespace its::inspector {

namespace {

/// A triangle at an edge with more than two.
struct Page {
    std::uint32_t triangle;
    bool upwards;
    Vec3 corner;   ///< opposite to the edge
    int half = 0;  ///< 0: the angle from the first page is in [0, π), 1: in [π, 2π)
};

/// Angles of pages around the edge from a to b, counter-clockwise from the first, by exact predicates.
class Angles {
public:
    Angles(const Vec3& a, const Vec3& b, const Vec3& zero) : a_(a), b_(b), zero_(zero) {
        // A coordinate plane in which the first page has area.
        for (axis_ = 0; axis_ < 2; ++axis_)
            if (in_plane(zero) != 0) break;
        sense_ = in_plane(zero);
    }

    int half_of(const Vec3& corner) const {
        const int side = geometry::orient3d(a_, b_, zero_, corner);
        if (side != 0) return side > 0 ? 0 : 1;
        return in_plane(corner) == sense_ ? 0 : 1;
    }

    /// Whether p comes before q, −1, after it, 1, or has the same angle, 0.
    int compare(const Page& p, const Page& q) const {
        if (p.half != q.half) return p.half < q.half ? -1 : 1;
        return -geometry::orient3d(a_, b_, p.corner, q.corner);
    }

private:
    int in_plane(const Vec3& c) const {
        const int u = axis_ == 0 ? 1 : 0, v = axis_ == 2 ? 1 : 2;
        return geometry::orient2d(a_[u], a_[v], b_[u], b_[v], c[u], c[v]);
    }

    Vec3 a_, b_, zero_;
    int axis_ = 0, sense_ = 0;
};

/// Pairs the pages of an edge that bound the same material between them: with growing angle material begins at
/// a page that goes downwards and ends at one that goes upwards. fn(i, j) for each pair, alone(i) for the
/// others. Of pages at the same angle those that end it come first; and among those that do the same, in such
/// an order that copies of a surface stay apart.
template <class Pair, class Alone>
void pair_pages(const Vec3& a, const Vec3& b, std::vector<Page>& pages, Pair&& pair, Alone&& alone) {
    const Angles angles(a, b, pages.front().corner);
    for (Page& page : pages) page.half = angles.half_of(page.corner);
    std::sort(pages.begin(), pages.end(), [&](const Page& p, const Page& q) {
        const int order = angles.compare(p, q);
        if (order != 0) return order < 0;
        if (p.upwards != q.upwards) return p.upwards;
        return p.upwards ? p.triangle < q.triangle : p.triangle > q.triangle;
    });
    std::vector<std::uint32_t> open, unmatched;
    for (const Page& page : pages) {
        if (!page.upwards) {
            open.push_back(page.triangle);
        } else if (open.empty()) {
            unmatched.push_back(page.triangle);  // by one before it, around the edge
        } else {
            pair(open.back(), page.triangle);
            open.pop_back();
        }
    }
    for (const std::uint32_t triangle : unmatched) {
        if (open.empty()) {
            alone(triangle);
        } else {
            pair(open.back(), triangle);
            open.pop_back();
        }
    }
    for (const std::uint32_t triangle : open) alone(triangle);
}

std::uint32_t opposite(const Triangle& t, std::uint32_t a, std::uint32_t b) {
    for (const std::uint32_t v : t)
        if (v != a && v != b) return v;
    return t[0];
}

/// Finds the parts of a mesh: sets of triangles, and which of them have an edge where a triangle has no
/// partner.
class PartFinder {
public:
    explicit PartFinder(const mesh::Merged& mesh)
        : mesh_(mesh), sets_(mesh.triangles.size()), open_(mesh.triangles.size(), 0) {}

    Parts find() {
        join_at_plain_edges();
        spread_open();
        if (has_other_edges_) {
            join_at_other_edges();
            spread_open();
        }
        return collect();
    }

private:
    template <class F>
    void for_edges(F&& fn) {
        mesh::for_edges(
            mesh_, [&](std::size_t i) { return !mesh::repeats_corner(mesh_.triangles[i]); },
            std::forward<F>(fn));
    }

    /// Edges with one triangle or two.
    void join_at_plain_edges() {
        for_edges([&](std::uint32_t, std::span<const mesh::EdgeUse> uses) {
            if (uses.size() > 2) {
                has_other_edges_ = true;
                return;
            }
            if (uses.size() == 2) sets_.join(uses[0].triangle, uses[1].triangle);
            if (uses.size() == 1 || uses[0].upwards == uses[1].upwards) open_[uses[0].triangle] = 1;
        });
    }

    /// Open at a triangle: open everywhere in its set.
    void spread_open() {
        for (std::uint32_t i = 0; i < open_.size(); ++i)
            if (open_[i] != 0) open_[sets_.find(i)] = 1;
        for (std::uint32_t i = 0; i < open_.size(); ++i) open_[i] = open_[sets_.find(i)];
    }

    void join_at_other_edges() {
        std::vector<Page> pages;
        std::vector<std::uint32_t> left;
        for_edges([&](std::uint32_t low, std::span<const mesh::EdgeUse> uses) {
            if (uses.size() <= 2) return;
            pages.clear();
            std::int64_t net = 0, flat = 0;
            for (const mesh::EdgeUse& use : uses) {
                if (open_[use.triangle] != 0) continue;  // a fin: no partner for anything
                const Triangle& t = mesh_.triangles[use.triangle];
                const Vec3 corner = mesh_.points[opposite(t, low, use.high)];
                pages.push_back({use.triangle, use.upwards, corner});
                net += use.upwards ? 1 : -1;
                flat += geometry::is_degenerate(mesh_.points[low], mesh_.points[use.high], corner) ? 1 : 0;
            }
            if (pages.empty()) return;
            if (flat > 0) {  // it has no angle
                for (const Page& page : pages) {
                    joins_.emplace_back(pages.front().triangle, page.triangle);
                    if (net != 0) left.push_back(page.triangle);
                }
                return;
            }
            pair_pages(
                mesh_.points[low], mesh_.points[uses[0].high], pages,
                [&](std::uint32_t i, std::uint32_t j) { joins_.emplace_back(i, j); },
                [&](std::uint32_t i) { left.push_back(i); });
        });
        for (const auto& [i, j] : joins_) sets_.join(i, j);
        for (const std::uint32_t i : left) open_[i] = 1;
    }

    Parts collect() {
        Parts parts;
        std::vector<std::uint32_t> number(mesh_.triangles.size());
        const auto is_face = [&](std::uint32_t i) { return !mesh::repeats_corner(mesh_.triangles[i]); };
        parts.first.push_back(0);
        for (std::uint32_t i = 0; i < number.size(); ++i) {
            if (!is_face(i)) continue;
            const std::uint32_t root = sets_.find(i);  // the lowest, and so a face
            if (root == i) {
                number[i] = std::uint32_t(parts.closed.size());
                parts.closed.push_back(open_[i] == 0 ? 1 : 0);
                parts.first.push_back(0);
            }
            number[i] = number[root];
            ++parts.first[number[i] + std::size_t{1}];
        }
        std::partial_sum(parts.first.begin(), parts.first.end(), parts.first.begin());
        parts.order.resize(parts.first.back());
        std::vector<std::uint64_t> next(parts.first.begin(), parts.first.end() - 1);
        for (std::uint32_t i = 0; i < number.size(); ++i)
            if (is_face(i)) parts.order[next[number[i]]++] = i;
        return parts;
    }

    const mesh::Merged& mesh_;
    DisjointSets sets_;
    std::vector<std::uint8_t> open_;
    bool has_other_edges_ = false;
    std::vector<std::pair<std::uint32_t, std::uint32_t>> joins_;
};

}  // namespace

Parts find_parts(const mesh::Merged& mesh) {
    return PartFinder(mesh).find();
}

}  // namespace its::inspector
