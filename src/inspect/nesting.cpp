#include "inspect/nesting.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numeric>
#include <optional>

#include "base/parallel.h"
#include "base/rounding.h"
#include "geometry/box_tree.h"
#include "geometry/predicates.h"
#include "geometry/vec3.h"

namespace its::inspector {

namespace {

using geometry::overlap;

constexpr std::uint64_t votes = 31;  // on where a part faces whose volume is within its rounding error; odd

bool holds(const Box& box, const Vec3& p) {
    return overlap(box, {p, p});
}

double largest_coordinate(const Box& box) {
    double most = 0;
    for (int axis = 0; axis < 3; ++axis)
        most = std::max({most, std::abs(box.min[axis]), std::abs(box.max[axis])});
    return most;
}

/// The triangles of one part.
class Surface {
public:
    Surface(const mesh::Merged& mesh, std::span<const std::uint32_t> triangles, const Box& bounds)
        : mesh_(mesh), triangles_(triangles), bounds_(bounds) {}

    std::size_t size() const { return triangles_.size(); }
    const Box& bounds() const { return bounds_; }
    std::array<Vec3, 3> corners(std::size_t i) const {
        const Triangle& t = mesh_.triangles[triangles_[i]];
        return {mesh_.points[t[0]], mesh_.points[t[1]], mesh_.points[t[2]]};
    }
    Box box(std::size_t i) const {
        const auto [a, b, c] = corners(i);
        Box box{a, a};
        geometry::extend(box, b);
        geometry::extend(box, c);
        return box;
    }

    /// To be called before the searches below; not by two threads at once.
    void prepare() {
        if (tree_) return;
        std::vector<Box> boxes(size());
        for (std::size_t i = 0; i < boxes.size(); ++i) boxes[i] = box(i);
        tree_.emplace(std::move(boxes));
    }
    const geometry::BoxTree& tree() const { return *tree_; }

    /// The exact winding number about p, which counts as displaced as in geometry/predicates.h.
    int winding(const Vec3& p) const {
        if (!holds(bounds_, p)) return 0;
        constexpr double lowest = std::numeric_limits<double>::lowest();
        const Vec3 from{std::nextafter(bounds_.min.x, lowest), p.y, p.z};
        int sum = 0;
        tree_->for_each(
            [&](const Box& b) {
                return b.min.y <= p.y && p.y <= b.max.y && b.min.z <= p.z && p.z <= b.max.z && b.min.x <= p.x;
            },
            [&](std::uint32_t i) {
                const auto [a, b, c] = corners(i);
                sum += geometry::x_line_crossing(a, b, c, from, p.x);
            });
        return sum;
    }

private:
    const mesh::Merged& mesh_;
    std::span<const std::uint32_t> triangles_;
    Box bounds_;
    std::optional<geometry::BoxTree> tree_;
};

/// Volume and the bound on its rounding error: each monomial of a determinant goes through at most eight
/// roundings (see orient3d), the sum through one for each triangle; the largest magnitudes are added up.
struct Volume {
    double value = 0, error = 0;
};

Volume volume_of(const Surface& surface) {
    const Box& box = surface.bounds();
    const Vec3 centre = 0.5 * box.min + 0.5 * box.max;
    double sum = 0, magnitude = 0;
    for (std::size_t i = 0; i < surface.size(); ++i) {
        const auto corners = surface.corners(i);
        const Vec3 a = corners[0] - centre, b = corners[1] - centre, c = corners[2] - centre;
        sum += dot(a, cross(b, c));
        magnitude += std::abs(a.x) * (std::abs(b.y * c.z) + std::abs(b.z * c.y)) +
                     std::abs(a.y) * (std::abs(b.z * c.x) + std::abs(b.x * c.z)) +
                     std::abs(a.z) * (std::abs(b.x * c.y) + std::abs(b.y * c.x));
    }
    // 2 covers the roundings of the magnitudes' own sum, which are fewer than 2⁵² triangles' worth.
    return {sum / 6, 2 * unit_roundoff * (double(surface.size()) + 10) * magnitude / 6};
}

/// Where a part faces, by votes of triangles spread evenly over the order: on which side the winding number is
/// greater in magnitude; 0 if fewer than three of four agree.
int facing_by_votes(Surface& surface) {
    surface.prepare();
    int balance = 0;
    const std::uint64_t count = std::min<std::uint64_t>(votes, surface.size());
    for (std::uint64_t i = 0; i < count; ++i) {
        const auto [a, b, c] = surface.corners(i * surface.size() / count);
        const Vec3 p = (1.0 / 3) * a + (1.0 / 3) * b + (1.0 / 3) * c;
        const int side = geometry::perturbed_orient3d(a, b, c, p);
        if (side == 0) continue;  // no area
        const int behind = surface.winding(p) + (side > 0 ? 1 : 0);
        balance += 2 * behind - 1 > 0 ? 1 : -1;
    }
    if (2 * std::uint64_t(std::abs(balance)) < count) return 0;
    return balance > 0 ? 1 : -1;
}

/// On which sides of a part's surface points of another's were found.
struct Found {
    bool inside = false, outside = false;
};

/// How two parts lie to each other.
enum class Relation : std::uint8_t { apart, first_in_second, second_in_first, crossing };

/// Tells how two parts lie to each other. Parts that touch do not cross.
///
/// They cross if an edge of one pierces a triangle of the other, by exact predicates, or if points of one are
/// found on both sides of the other. Where they touch, those points are the corners of triangles, the middles
/// of their edges and their centroids, except those that may be on the other's surface.
class Comparison {
public:
    Comparison(const Surface& a, const Surface& b) : a_(a), b_(b) {}

    Relation relation() {
        if (a_.size() > b_.size() ? pierce(b_, a_, b_contacts_, a_contacts_)
                                  : pierce(a_, b_, a_contacts_, b_contacts_))
            return Relation::crossing;
        const Found a = look(a_, b_, a_contacts_), b = look(b_, a_, b_contacts_);
        if (a.inside && a.outside) return Relation::crossing;
        if (b.inside && b.outside) return Relation::crossing;
        if (a.inside) return b.inside ? Relation::crossing : Relation::first_in_second;
        if (b.inside) return Relation::second_in_first;
        return a.outside || b.outside ? Relation::apart : Relation::crossing;  // the same surface twice
    }

private:
    using Contacts = std::vector<std::uint32_t>;

    /// Whether an edge of one part pierces a triangle of the other. Else the triangles of each are found whose
    /// box meets that of one of the other.
    static bool pierce(const Surface& few, const Surface& many, Contacts& of_few, Contacts& of_many) {
        const bool pierced =
            few.tree().any([&](const Box& box) { return overlap(box, many.bounds()); },
                           [&](std::uint32_t i) {
                               const Box box = few.box(i);
                               const std::array<Vec3, 3> t = few.corners(i);
                               const std::size_t before = of_many.size();
                               if (many.tree().any([&](const Box& other) { return overlap(box, other); },
                                                   [&](std::uint32_t j) {
                                                       of_many.push_back(j);
                                                       const std::array<Vec3, 3> other = many.corners(j);
                                                       return pierces(t, other) || pierces(other, t);
                                                   }))
                                   return true;
                               if (of_many.size() > before) of_few.push_back(i);
                               return false;
                           });
        if (pierced) return true;
        std::sort(of_many.begin(), of_many.end());
        of_many.erase(std::unique(of_many.begin(), of_many.end()), of_many.end());
        return false;
    }

    static bool pierces(const std::array<Vec3, 3>& edges, const std::array<Vec3, 3>& t) {
        bool degenerate = false;
        for (std::size_t k = 0; k < 3; ++k)
            if (geometry::segment_crossing(t[0], t[1], t[2], edges[k], edges[(k + 1) % 3], degenerate) != 0)
                return true;
        return false;
    }

    /// The sides of `of` on which points of the contacts of a part are; without any decided one, of its others.
    static Found look(const Surface& part, const Surface& of, const Contacts& contacts) {
        Found found;
        for (const std::uint32_t i : contacts) {
            look_at(part.corners(i), of, found);
            if (found.inside && found.outside) return found;
        }
        for (std::size_t i = 0; i < part.size() && !found.inside && !found.outside; ++i)
            look_at(part.corners(i), of, found);
        return found;
    }

    static void look_at(const std::array<Vec3, 3>& t, const Surface& of, Found& found) {
        const auto& [a, b, c] = t;
        // A coordinate of the others goes through at most five roundings, of numbers up to the largest one.
        const double rounding = 8 * unit_roundoff * largest_coordinate(of.bounds());
        look_at(a, 0, of, found);
        look_at(b, 0, of, found);
        look_at(c, 0, of, found);
        look_at(0.5 * a + 0.5 * b, rounding, of, found);
        look_at(0.5 * b + 0.5 * c, rounding, of, found);
        look_at(0.5 * c + 0.5 * a, rounding, of, found);
        look_at((1.0 / 3) * a + (1.0 / 3) * b + (1.0 / 3) * c, rounding, of, found);
    }

    static void look_at(const Vec3& p, double rounding, const Surface& of, Found& found) {
        if (!holds(of.bounds(), p)) {
            found.outside = true;
        } else if (!may_be_on(p, rounding, of)) {
            (of.winding(p) != 0 ? found.inside : found.outside) = true;
        }
    }

    /// Whether a point that is within `rounding` of p in each coordinate may be on the surface. True for some
    /// that are not, in a triangle's plane and box.
    static bool may_be_on(const Vec3& p, double rounding, const Surface& of) {
        const Vec3 r{rounding, rounding, rounding};
        const Box around{p - r, p + r};
        return of.tree().any([&](const Box& box) { return overlap(box, around); },
                             [&](std::uint32_t i) {
                                 const auto [a, b, c] = of.corners(i);
                                 return plane_is_near(a, b, c, p, rounding);
                             });
    }

    /// Whether the plane of abc comes within `rounding` of p in each coordinate. Along the axis to which the
    /// normal is nearest it is then within three times that, doubled for the roundings of the normal and of p ±
    /// step.
    static bool plane_is_near(const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& p, double rounding) {
        if (rounding == 0) return geometry::orient3d(a, b, c, p) == 0;
        const Vec3 n = cross(b - a, c - a);
        int axis = std::abs(n.x) >= std::abs(n.y) ? 0 : 1;
        if (std::abs(n.z) > std::abs(n[axis])) axis = 2;
        Vec3 low = p, high = p;
        low[axis] -= 6 * rounding;
        high[axis] += 6 * rounding;
        return geometry::orient3d(a, b, c, low) * geometry::orient3d(a, b, c, high) <= 0;
    }

    const Surface &a_, &b_;
    Contacts a_contacts_, b_contacts_;
};

/// Finds how parts lie to each other, from the largest bounds to the smallest: a part that lies in another,
/// lies in all that this lies in, and in none that is apart from it. So a stack of parts in each other takes a
/// comparison for each, not for each pair.
class Nesting {
public:
    Nesting(std::vector<Placed>& placed, std::vector<Surface>& surfaces)
        : placed_(placed),
          surfaces_(surfaces),
          place_(placed.size()),
          containers_(placed.size()),
          contents_(placed.size()),
          crossed_(placed.size()),
          meaning_(placed.size(), Known::apart) {}

    void find() {
        std::vector<Box> boxes;
        for (const Placed& one : placed_) boxes.push_back(one.bounds);
        const geometry::BoxTree tree(boxes);
        const std::vector<std::uint32_t> order = by_size();
        std::vector<std::uint32_t> larger;
        for (const std::uint32_t i : order) {
            larger.clear();
            tree.for_each([&](const Box& box) { return overlap(box, boxes[i]); },
                          [&](std::uint32_t j) {
                              if (place_[j] < place_[i]) larger.push_back(j);
                          });
            std::sort(larger.begin(), larger.end(),
                      [&](std::uint32_t a, std::uint32_t b) { return place_[a] > place_[b]; });
            place_among(i, larger);
        }
        for (std::size_t i = 0; i < placed_.size(); ++i) {
            placed_[i].containers = std::move(containers_[i]);
            placed_[i].crosses = !crossed_[i].empty();
        }
    }

private:
    /// What is known of a part from how the innermost part around the present one lies to it.
    enum class Known : std::uint8_t { apart, container, nothing };

    /// Parts by descending size of their bounds, which no part exceeds that lies in them.
    std::vector<std::uint32_t> by_size() {
        std::vector<double> size;
        for (const Placed& one : placed_)
            size.push_back((one.bounds.max.x - one.bounds.min.x) + (one.bounds.max.y - one.bounds.min.y) +
                           (one.bounds.max.z - one.bounds.min.z));
        std::vector<std::uint32_t> order(placed_.size());
        std::iota(order.begin(), order.end(), std::uint32_t{0});
        std::stable_sort(order.begin(), order.end(), [&](std::uint32_t a, std::uint32_t b) {
            if (size[a] != size[b]) return size[a] > size[b];
            return std::abs(placed_[a].volume) > std::abs(placed_[b].volume);
        });
        for (std::uint32_t k = 0; k < order.size(); ++k) place_[order[k]] = k;
        return order;
    }

    /// \param larger  those before i in the order whose bounds overlap its own, the smallest first
    void place_among(std::uint32_t i, const std::vector<std::uint32_t>& larger) {
        std::optional<std::uint32_t> around;
        for (const std::uint32_t j : larger) {
            if (around && meaning_[j] == Known::apart) continue;
            if (around && meaning_[j] == Known::container) {
                add(j, i);
                continue;
            }
            surfaces_[i].prepare();
            surfaces_[j].prepare();
            const Relation relation = Comparison(surfaces_[i], surfaces_[j]).relation();
            if (relation == Relation::crossing) crossed_[i].push_back(j), crossed_[j].push_back(i);
            if (relation == Relation::second_in_first) add(i, j);
            if (relation != Relation::first_in_second) continue;
            add(j, i);
            if (around) continue;
            around = j;
            learn(j, true);
        }
        if (around) learn(*around, false);
    }

    void add(std::uint32_t container, std::uint32_t content) {
        containers_[content].push_back(container);
        contents_[container].push_back(content);
    }

    /// Sets, or resets, what the part around the present one means for others.
    void learn(std::uint32_t around, bool set) {
        for (const std::uint32_t k : containers_[around]) meaning_[k] = set ? Known::container : Known::apart;
        for (const std::uint32_t k : crossed_[around]) meaning_[k] = set ? Known::nothing : Known::apart;
        for (const std::uint32_t k : contents_[around]) meaning_[k] = set ? Known::nothing : Known::apart;
    }

    std::vector<Placed>& placed_;
    std::vector<Surface>& surfaces_;
    std::vector<std::uint32_t> place_;  ///< in the order
    std::vector<std::vector<std::uint32_t>> containers_, contents_, crossed_;
    std::vector<Known> meaning_;
};

/// Containers that lie in each other are a chain: the k-th from outside lies in exactly k others.
void order_containers(std::vector<Placed>& placed) {
    std::vector<std::size_t> depth;
    depth.reserve(placed.size());
    for (const Placed& one : placed) depth.push_back(one.containers.size());
    for (Placed& one : placed) {
        std::sort(one.containers.begin(), one.containers.end(), [&](std::uint32_t a, std::uint32_t b) {
            return std::pair(depth[a], a) < std::pair(depth[b], b);
        });
        for (std::size_t k = 0; k < one.containers.size(); ++k) one.unclear |= depth[one.containers[k]] != k;
    }
}

}  // namespace

std::vector<Placed> place_parts(const mesh::Merged& mesh, const Parts& parts) {
    std::vector<Placed> placed;
    std::vector<Surface> surfaces;
    for (std::uint32_t p = 0; p < parts.count(); ++p) {
        if (parts.closed[p] == 0) continue;
        const std::span<const std::uint32_t> triangles = parts.triangles(p);
        const Vec3& start = mesh.points[mesh.triangles[triangles.front()][0]];
        Box bounds{start, start};
        for (const std::uint32_t t : triangles)
            for (const std::uint32_t v : mesh.triangles[t]) geometry::extend(bounds, mesh.points[v]);
        placed.push_back({.part = p, .bounds = bounds});
        surfaces.emplace_back(mesh, triangles, bounds);
    }
    parallel_for(placed.size(), 1, [&](std::uint64_t i) {
        const Volume volume = volume_of(surfaces[i]);
        placed[i].volume = volume.value;
        placed[i].facing = volume.value > volume.error    ? 1
                           : volume.value < -volume.error ? -1
                                                          : facing_by_votes(surfaces[i]);
    });
    Nesting(placed, surfaces).find();
    order_containers(placed);
    return placed;
}

std::vector<std::uint8_t> nesting_turns(std::span<const Placed> placed) {
    std::vector<std::uint32_t> order(placed.size());
    for (std::uint32_t i = 0; i < order.size(); ++i) order[i] = i;
    std::stable_sort(order.begin(), order.end(), [&](std::uint32_t a, std::uint32_t b) {
        return placed[a].containers.size() < placed[b].containers.size();
    });
    std::vector<std::uint8_t> turn(placed.size(), 0);
    std::vector<int> facing(placed.size(), 0);  // after turning
    for (const std::uint32_t i : order) {
        const Placed& one = placed[i];
        facing[i] = one.facing;
        if (one.crosses || one.unclear || one.facing == 0) continue;
        const int wanted = one.containers.empty() ? 1 : -facing[one.containers.back()];
        if (wanted == 0 || wanted == one.facing) continue;
        turn[i] = 1;
        facing[i] = wanted;
    }
    return turn;
}

}  // namespace its::inspector
