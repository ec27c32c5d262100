#include "simplify/complex.h"

#include <algorithm>
#include <array>
#include <numeric>
#include <stdexcept>

#include "base/disjoint_sets.h"
#include "geometry/vec3.h"
#include "mesh/arrays.h"
#include "mesh/merged.h"
#include "mesh/point_index.h"
#include "octree/morton.h"

namespace its::simplifier {

namespace {

/// The two other corners of triangle t, seen from v.
std::array<std::uint32_t, 2> others(const Triangle& t, std::uint32_t v) {
    if (t[0] == v) return {t[1], t[2]};
    if (t[1] == v) return {t[2], t[0]};
    return {t[0], t[1]};
}

/// Morton codes of points on a grid of 2²¹ cells a side over their bounds.
class MortonNumbers {
public:
    explicit MortonNumbers(const std::vector<Vec3>& points) {
        if (points.empty()) return;
        Vec3 high = low_ = points[0];
        for (const Vec3& p : points)
            for (int axis = 0; axis < 3; ++axis) {
                low_[axis] = std::min(low_[axis], p[axis]);
                high[axis] = std::max(high[axis], p[axis]);
            }
        const double side = std::max({high.x - low_.x, high.y - low_.y, high.z - low_.z});
        if (side > 0) cells_ = 0x1p21 / side;
    }

    /// The numbers 0 … count − 1 by the codes of their points, equal ones ascending.
    template <class Point>
    std::vector<std::uint32_t> order(std::size_t count, Point&& point) const {
        std::vector<std::pair<std::uint64_t, std::uint32_t>> keys(count);
        for (std::size_t i = 0; i < count; ++i) {
            const Vec3 p = point(i);
            octree::Cell cell;
            for (int axis = 0; axis < 3; ++axis)
                cell[axis] = std::uint32_t(std::clamp((p[axis] - low_[axis]) * cells_, 0.0, 0x1p21 - 1));
            keys[i] = {octree::morton_encode(cell), std::uint32_t(i)};
        }
        std::sort(keys.begin(), keys.end());
        std::vector<std::uint32_t> numbers(count);
        for (std::size_t i = 0; i < count; ++i) numbers[i] = keys[i].second;
        return numbers;
    }

private:
    Vec3 low_;
    double cells_ = 0;
};

bool has(const Triangle& t, std::uint32_t v) {
    return t[0] == v || t[1] == v || t[2] == v;
}

/// Whether three edges or more meet in one vertex of a link.
bool has_fork(const std::vector<std::array<std::uint32_t, 2>>& links) {
    for (const auto& link : links)
        for (const std::uint32_t w : link)
            if (std::count_if(links.begin(), links.end(),
                              [w](const auto& l) { return l[0] == w || l[1] == w; }) > 2)
                return true;
    return false;
}

}  // namespace

Complex::Complex(const mesh::Arrays& mesh, std::span<const Triangle> wedges) {
    // Distinct positions and triangles, both in Morton order: what is near in space is near in memory.
    mesh::PointIndex index(std::min(mesh.vertices.size(), 3 * mesh.triangles.size()));
    std::vector<std::uint32_t> number(mesh.vertices.size(), no_index), source;
    triangle_.reserve(mesh.triangles.size());
    for (const Triangle& corners : mesh.triangles) {
        Triangle t = corners;
        for (std::uint32_t& v : t) {
            if (number[v] == no_index) {
                number[v] = index.insert(mesh.vertices[v]);
                if (index.size() > source.size()) source.push_back(v);
            }
            v = number[v];
        }
        triangle_.push_back(t);
    }
    const MortonNumbers codes(index.points());
    std::vector<std::uint32_t> rank_of(index.size());
    for (const std::uint32_t v : codes.order(index.size(), [&](std::size_t i) { return index.points()[i]; })) {
        rank_of[v] = std::uint32_t(position_.size());
        position_.push_back(index.points()[v]);
        source_.push_back(source[v]);
    }
    std::vector<Triangle> unsorted;
    unsorted.swap(triangle_);
    triangle_.resize(unsorted.size());
    const auto centroid = [&](std::size_t t) {
        const auto& p = index.points();
        return (1.0 / 3.0) * (p[unsorted[t][0]] + p[unsorted[t][1]] + p[unsorted[t][2]]);
    };
    for (std::size_t t = 0; const std::uint32_t i : codes.order(unsorted.size(), centroid)) {
        triangle_[t++] = {rank_of[unsorted[i][0]], rank_of[unsorted[i][1]], rank_of[unsorted[i][2]]};
        if (!wedges.empty()) wedge_.insert(wedge_.end(), wedges[i].begin(), wedges[i].end());
    }
    if (!wedges.empty()) {
        merged_into_.resize(*std::max_element(wedge_.begin(), wedge_.end()) + std::size_t{1});
        std::iota(merged_into_.begin(), merged_into_.end(), 0u);
    }
    living_ = triangle_.size();
    head_.assign(position_.size(), no_index);
    next_.assign(3 * triangle_.size(), no_index);
    for (std::uint32_t c = std::uint32_t(next_.size()); c-- > 0;) {  // downwards: lists ascend
        const std::uint32_t v = triangle_[c / 3][c % 3];
        next_[c] = head_[v];
        head_[v] = c;
    }
    mark_.assign(position_.size(), 0);
    kind_.resize(position_.size());
    std::vector<std::array<std::uint32_t, 2>> links;
    for (std::uint32_t v = 0; v < position_.size(); ++v) kind_[v] = kind_with_seams(v, kind_of(v, links));
}

/// A vertex is inner if its link is one cycle of three edges or more, boundary if it is one path.
Complex::Kind Complex::kind_of(std::uint32_t v, std::vector<std::array<std::uint32_t, 2>>& links) const {
    links.clear();
    bool fixed = false;
    for_star(v, [&](std::uint32_t t, std::uint32_t) {
        fixed |= mesh::repeats_corner(triangle_[t]);
        links.push_back(others(triangle_[t], v));
    });
    if (fixed) return Kind::fixed;
    // Grow a path from the first edge at its end, then at its start; each step takes the edge out.
    std::uint32_t start = links[0][0], end = links[0][1];
    std::size_t taken = 1;
    const auto extend = [&](std::uint32_t& tip, std::uint32_t stop) {
        for (bool found = true; found && tip != stop;) {
            found = false;
            for (std::size_t i = taken; i < links.size() && !found; ++i) {
                if (links[i][0] != tip && links[i][1] != tip) continue;
                tip = links[i][0] == tip ? links[i][1] : links[i][0];
                std::swap(links[i], links[taken++]);
                found = true;
            }
        }
    };
    extend(end, start);
    if (end != start) extend(start, end);
    if (taken != links.size()) return Kind::fixed;  // more than one fan, or a fork
    if (start == end) {
        if (taken < 3) return Kind::fixed;
        return has_fork(links) ? Kind::fixed : Kind::inner;
    }
    return has_fork(links) ? Kind::fixed : Kind::boundary;
}

/// What a vertex is that the shape alone makes `kind`: on a seam if two edges around it are seams, and every
/// triangle has one of two wedges. (With one wedge only, the seam is pinched there.)
Complex::Kind Complex::kind_with_seams(std::uint32_t v, Kind kind) const {
    if (wedge_.empty() || kind == Kind::fixed) return kind;
    std::uint32_t seams = 0, first = no_index, second = no_index;
    bool more = false;
    for_star(v, [&](std::uint32_t t, std::uint32_t k) {
        seams +=
            is_seam(t, k) ? 1 : 0;  // each edge of an inner vertex goes out from it in one of its triangles
        seams += kind == Kind::boundary && is_seam(t, (k + 2) % 3) ? 1 : 0;
        const std::uint32_t w = wedge_[3 * t + k];
        if (first == no_index) first = w;
        if (w == first) return;
        if (second == no_index) second = w;
        more |= w != second;
    });
    if (seams == 0) return kind;
    return kind == Kind::inner && !more && second != no_index && seams == 2 ? Kind::seam : Kind::fixed;
}

std::uint32_t Complex::wedge_at(std::uint32_t t, std::uint32_t v) const {
    const Triangle& c = triangle_[t];
    return wedge_[3 * t + (c[0] == v ? 0u : c[1] == v ? 1u : 2u)];
}

/// Whether the edge uv that s and t have in common is a seam.
bool Complex::differ(std::uint32_t s, std::uint32_t t, std::uint32_t u, std::uint32_t v) const {
    return wedge_at(s, u) != wedge_at(t, u) || wedge_at(s, v) != wedge_at(t, v);
}

bool Complex::is_seam(std::uint32_t t, std::uint32_t k) const {
    if (wedge_.empty()) return false;
    const std::uint32_t u = triangle_[t][k], v = triangle_[t][(k + 1) % 3];
    bool seam = false;
    for_star(u, [&](std::uint32_t s, std::uint32_t) {
        seam |= s != t && has(triangle_[s], v) && differ(s, t, u, v);
    });
    return seam;
}

std::uint64_t Complex::seam_edges() const {
    std::uint64_t sides = 0;
    if (wedge_.empty()) return sides;
    for (std::uint32_t t = 0; t < triangles(); ++t)
        for (std::uint32_t k = 0; k < 3 && has_triangle(t); ++k) sides += is_seam(t, k) ? 1 : 0;
    return sides / 2;
}

/// Whether merging u into v keeps all seams, as can_merge() keeps boundaries.
bool Complex::seam_can_merge(std::uint32_t u, std::uint32_t v, std::span<const std::uint32_t> shared) const {
    const bool seam = shared.size() == 2 && differ(shared[0], shared[1], u, v);
    if (on_seam(u) != seam) return false;  // along the seam only, and nothing else along it
    // At a seam's end both sides agree: the last edge stays, or a short seam would close.
    if (seam && wedge_at(shared[0], v) == wedge_at(shared[1], v)) return false;
    // A triangle whose other edges both bound its chart would take it along.
    for (const std::uint32_t t : shared) {
        std::uint32_t bounding = 0;
        for (std::uint32_t k = 0; k < 3; ++k) {
            const std::uint32_t a = triangle_[t][k], b = triangle_[t][(k + 1) % 3];
            if ((a == u && b == v) || (a == v && b == u)) continue;
            bounding += triangles_at_edge(a, b) == 1 || is_seam(t, k) ? 1 : 0;
        }
        if (bounding == 2) return false;
    }
    return true;
}

/// On each side of uv, the triangles around the vertex that goes take the wedge of the one that stays.
void Complex::merge_wedges(std::uint32_t u, std::uint32_t v, bool v_goes,
                           std::span<const std::uint32_t> shared) {
    const std::uint32_t goes = v_goes ? v : u, stays = v_goes ? u : v;
    for (const std::uint32_t t : shared) {
        const std::uint32_t from = wedge_at(t, goes), into = wedge_at(t, stays);
        if (from == into) continue;  // done with the other triangle
        merged_into_[from] = into;
        for_star(goes, [&](std::uint32_t s, std::uint32_t k) {
            if (wedge_[3 * s + k] == from) wedge_[3 * s + k] = into;
        });
    }
}

std::uint32_t Complex::ring(std::uint32_t u, std::uint32_t v, std::vector<std::uint32_t>& triangles) const {
    const std::size_t begin = triangles.size();
    std::uint32_t shared = 0;
    for_star(u, [&](std::uint32_t t, std::uint32_t) {
        triangles.push_back(t);
        if (has(triangle_[t], v)) std::swap(triangles[begin + shared++], triangles.back());
    });
    for_star(v, [&](std::uint32_t t, std::uint32_t) {
        if (!has(triangle_[t], u)) triangles.push_back(t);
    });
    return shared;
}

bool Complex::can_merge(std::uint32_t u, std::uint32_t v, std::span<const std::uint32_t> triangles,
                        std::uint32_t shared) {
    if (shared == 0 || shared > 2) return false;
    // Not across the inside from boundary to boundary; a fixed vertex may be on one.
    if (shared == 2 && kind_[u] != Kind::inner && kind_[u] != Kind::seam && kind_[v] != Kind::inner)
        return false;
    if (!wedge_.empty() && !seam_can_merge(u, v, triangles.first(shared))) return false;
    // Marks 4·epoch + bits: 1 a neighbour of u, 2 of v.
    epoch_ += 4;
    const auto bits = [&](std::uint32_t w) { return mark_[w] >= epoch_ ? mark_[w] - epoch_ : 0; };
    std::uint32_t common = 0;
    for (const std::uint32_t t : triangles) {
        if (mesh::repeats_corner(triangle_[t])) return false;
        for (const std::uint32_t w : triangle_[t]) {
            if (w == u || w == v) continue;
            const std::uint64_t before = bits(w);
            const std::uint64_t after =
                before | (has(triangle_[t], u) ? 1u : 0u) | (has(triangle_[t], v) ? 2u : 0u);
            if (before != 3 && after == 3) ++common;
            mark_[w] = epoch_ + after;
        }
    }
    if (common != shared) return false;
    // An edge in both links: a triangle around u and one around v over the same two neighbours.
    for (std::size_t i = shared; i < triangles.size(); ++i) {
        const Triangle& t = triangle_[triangles[i]];
        if (!has(t, u)) continue;
        const auto [a, b] = others(t, u);
        if (bits(a) == 3 && bits(b) == 3) {
            for (std::size_t j = shared; j < triangles.size(); ++j)
                if (has(triangle_[triangles[j]], v) && has(triangle_[triangles[j]], a) &&
                    has(triangle_[triangles[j]], b))
                    return false;
        }
    }
    // A triangle that hangs on by nothing but its edge uv, and is to vanish.
    for (std::uint32_t i = 0; i < shared; ++i) {
        const Triangle& t = triangle_[triangles[i]];
        for (const std::uint32_t w : t)
            if (w != u && w != v && triangles_at_edge(u, w) == 1 && triangles_at_edge(v, w) == 1) return false;
    }
    return true;
}

void Complex::merge(std::uint32_t u, std::uint32_t v, const Vec3& to, std::span<const std::uint32_t> triangles,
                    std::uint32_t shared) {
    if (!wedge_.empty())
        merge_wedges(u, v, kind_[u] == kind_[v] && to == position_[u], triangles.first(shared));
    for (std::uint32_t i = 0; i < shared; ++i) {
        const std::uint32_t gone = triangles[i];
        for (const std::uint32_t w : triangle_[gone]) {
            if (w == u) continue;
            std::uint32_t* link = &head_[w];
            while (*link / 3 != gone) link = &next_[*link];
            *link = next_[*link];
        }
        triangle_[gone][0] = no_index;
    }
    living_ -= shared;
    for (std::uint32_t c = head_[u]; c != no_index;) {
        const std::uint32_t after = next_[c];
        if (has_triangle(c / 3)) {
            triangle_[c / 3][c % 3] = v;
            next_[c] = head_[v];
            head_[v] = c;
        }
        c = after;
    }
    head_[u] = no_index;
    position_[v] = to;
    if (on_boundary(u) && kind_[v] == Kind::inner) kind_[v] = Kind::boundary;
}

std::uint32_t Complex::triangles_at_edge(std::uint32_t u, std::uint32_t v) const {
    std::uint32_t count = 0;
    for_star(u, [&](std::uint32_t t, std::uint32_t) { count += has(triangle_[t], v) ? 1 : 0; });
    return count;
}

double Complex::round_to(const Numbers& numbers) {
    double moved = 0;
    if (numbers.rounding.kind == Rounding::Kind::none) return moved;
    for (Vec3& p : position_) {
        const Vec3 rounded = numbers.nearest(p);
        moved = std::max(moved, norm(rounded - p));
        p = rounded;
    }
    return moved;
}

std::uint64_t Complex::fewest_triangles() const {
    DisjointSets components(position_.size());  // of vertices
    for (std::uint32_t t = 0; t < triangles(); ++t) {
        if (!has_triangle(t)) continue;
        for (int k = 1; k < 3; ++k) components.join(triangle_[t][0], triangle_[t][k]);
    }
    struct Component {
        std::int64_t vertices = 0, triangles = 0;
        bool closed = true;
    };
    std::vector<Component> component(position_.size());
    for (std::uint32_t v = 0; v < position_.size(); ++v) {
        if (!has_vertex(v)) continue;
        Component& c = component[components.find(v)];
        ++c.vertices;
        c.closed &= kind_[v] == Kind::inner;
    }
    for (std::uint32_t t = 0; t < triangles(); ++t)
        if (has_triangle(t)) ++component[components.find(triangle_[t][0])].triangles;
    std::uint64_t fewest = 0;
    for (const Component& c : component) {
        if (c.triangles == 0) continue;
        if (!c.closed) {
            ++fewest;
            continue;
        }
        // E = 3F/2, so χ = V − F/2, and E ≤ V(V − 1)/2 is V² − 7V + 6χ ≥ 0.
        const std::int64_t euler = c.vertices - c.triangles / 2;
        std::int64_t v = 4;
        while (v * v - 7 * v + 6 * euler < 0) ++v;
        fewest += std::uint64_t(2 * (v - euler));
    }
    return fewest;
}

void Complex::validate() const {
    const auto require = [](bool holds, const char* what) {
        if (!holds) throw std::logic_error(what);
    };
    std::vector<std::uint8_t> seen(next_.size(), 0);
    for (std::uint32_t v = 0; v < head_.size(); ++v)
        for (std::uint32_t c = head_[v]; c != no_index; c = next_[c]) {
            require(c < next_.size() && seen[c] == 0, "a corner stands in two lists");
            require(has_triangle(c / 3), "a corner of a triangle that is gone stands in a list");
            require(triangle_[c / 3][c % 3] == v, "a corner stands in another vertex's list");
            seen[c] = 1;
        }
    std::uint64_t living = 0;
    for (std::uint32_t t = 0; t < triangle_.size(); ++t) {
        if (!has_triangle(t)) continue;
        ++living;
        for (std::uint32_t k = 0; k < 3; ++k) require(seen[3 * t + k] != 0, "a corner stands in no list");
    }
    require(living == living_, "the count of triangles is wrong");
    std::vector<std::array<std::uint32_t, 2>> links;
    for (std::uint32_t v = 0; v < head_.size(); ++v)
        if (has_vertex(v) && kind_[v] != Kind::fixed)
            require(kind_with_seams(v, kind_of(v, links)) == kind_[v], "a vertex is no longer what it was");
}

}  // namespace its::simplifier
