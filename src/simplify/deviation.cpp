#include "simplify/deviation.h"

#include <bit>
#include <stdexcept>

namespace its::simplifier {

namespace {

constexpr std::size_t max_targets = 64;  // bits of a mask
constexpr std::size_t max_pieces = 96;   // of one triangle; a proof that needs more is given up
constexpr int max_halvings = 12;         // in search of a point near to two targets
constexpr std::size_t block = 64;        // points measured between two looks at the result

/// Squared distances of points to one target: the least so far, and the mask of the targets within the limit.
ITS_CLONES void measure(const Frame& f, const EdgeTerms& e, const double* x, const double* y, const double* z,
                        std::size_t count, double limit2, std::uint64_t bit, double* least,
                        std::uint64_t* near) {
    for (std::size_t i = 0; i < count; ++i) {
        const double dx = x[i] - f.a.x, dy = y[i] - f.a.y, dz = z[i] - f.a.z;
        const double lx = dx * f.ex.x + dy * f.ex.y + dz * f.ex.z;
        const double ly = dx * f.ey.x + dy * f.ey.y + dz * f.ey.z;
        const double lz = dx * f.n.x + dy * f.n.y + dz * f.n.z;
        const double d2 = squared_distance(f, e, lx, ly, lz);
        least[i] = d2 < least[i] ? d2 : least[i];
        near[i] |= d2 <= limit2 ? bit : 0;
    }
}

double least_squared_distance(const Vec3& p, std::span<const Frame> targets, std::span<const EdgeTerms> terms) {
    double least = 1e300;
    for (std::size_t j = 0; j < targets.size(); ++j)
        least = std::min(least, squared_distance(targets[j], terms[j], p));
    return least;
}

}  // namespace

Deviation::Deviation(const Complex& original) {
    vertex_.resize(original.vertices());
    for (std::uint32_t v = 0; v < vertex_.size(); ++v) {
        vertex_[v].at = original.position(v);
        for (int axis = 0; axis < 3; ++axis) size_ = std::max(size_, std::abs(vertex_[v].at[axis]));
    }
    // New vertices lie within the tolerance of the original, and the tolerance within its size.
    size_ *= 2;
    rounding_ = distance_roundings * unit_roundoff * size_;
    const std::uint64_t triangles = original.triangles();
    original_.resize(triangles);
    list_of_face_.resize(triangles);
    list_.resize(triangles);
    face_mark_.assign(triangles, 0);
    for (std::uint32_t t = 0; t < triangles; ++t) {
        Original& o = original_[t];
        o.corner = original.triangle(t);
        o.witness = {t, no_index, no_index, no_index};
        list_of_face_[t] = {t, 1};
        list_[t] = t;
        for (int k = 0; k < 3; ++k) {
            const std::uint32_t a = o.corner[k], b = o.corner[(k + 1) % 3];
            std::uint32_t others = 0, other = no_index;
            original.for_star(a, [&](std::uint32_t s, std::uint32_t) {
                const Triangle& c = original.triangle(s);
                if (s == t || (c[0] != b && c[1] != b && c[2] != b)) return;
                ++others;
                other = s;
            });
            o.neighbour[k] = others == 1 ? other : no_index;
        }
    }
    listed_ = triangles;
}

/// fn(face) for each witness.
template <class F>
void Deviation::for_witnesses(const Original& t, F&& fn) const {
    for (const std::uint32_t f : t.witness)
        if (f != no_index) fn(f);
    if (t.more != no_index)
        for (const std::uint32_t f : more_[t.more]) fn(f);
}

template <class Keep>
void Deviation::filter_witnesses(Original& t, Keep&& keep) {
    for (std::uint32_t& f : t.witness)
        if (f != no_index && !keep(f)) f = no_index;
    if (t.more != no_index) std::erase_if(more_[t.more], [&](std::uint32_t f) { return !keep(f); });
}

/// Returns whether the face was no witness before.
bool Deviation::add_witness(Original& t, std::uint32_t face) {
    bool known = false;
    for_witnesses(t, [&](std::uint32_t f) { known |= f == face; });
    if (known) return false;
    for (std::uint32_t& f : t.witness)
        if (f == no_index) {
            f = face;
            return true;
        }
    if (t.more == no_index) {
        t.more = std::uint32_t(more_.size());
        more_.emplace_back();
    }
    more_[t.more].push_back(face);
    return true;
}

/// The original triangles with a witness in the ring, and their vertices.
void Deviation::gather(std::span<const std::uint32_t> ring) {
    ++epoch_;
    region_.clear();
    for (auto* v : {&x_, &y_, &z_}) v->clear();
    for (const std::uint32_t f : ring) face_mark_[f] = epoch_;
    for (const std::uint32_t f : ring) {
        const List list = list_of_face_[f];
        for (std::uint32_t i = 0; i < list.count; ++i) {
            const std::uint32_t t = list_[list.begin + i];
            Original& o = original_[t];
            if (o.mark == epoch_) continue;
            o.mark = epoch_;
            region_.push_back(t);
        }
    }
    for (const std::uint32_t t : region_) {
        for (const std::uint32_t v : original_[t].corner) {
            Vertex& p = vertex_[v];
            if (p.mark == epoch_) continue;
            p.mark = epoch_;
            p.local = std::uint32_t(x_.size());
            x_.push_back(p.at.x);
            y_.push_back(p.at.y);
            z_.push_back(p.at.z);
        }
    }
}

/// Targets that stay as they are: the region's witnesses outside the ring. False if there are too many.
bool Deviation::add_other_witnesses(const Complex& current) {
    for (const std::uint32_t t : region_) {
        for_witnesses(original_[t], [&](std::uint32_t f) {
            if (face_mark_[f] == epoch_) return;
            face_mark_[f] = epoch_;
            const Triangle& c = current.triangle(f);
            target_face_.push_back(f);
            target_.push_back(
                make_frame(current.position(c[0]), current.position(c[1]), current.position(c[2])));
        });
    }
    return target_.size() <= max_targets;
}

/// Measures the region's points against all targets, and stops at a block with a point that is near none: the
/// square of what it needs. 0: all points are near some target.
double Deviation::measure_points() {
    terms_.clear();
    for (const Frame& f : target_) terms_.emplace_back(f);
    distance2_.assign(x_.size(), 1e300);
    near_.assign(x_.size(), 0);
    for (std::size_t begin = 0; begin < x_.size(); begin += block) {
        const std::size_t count = std::min(block, x_.size() - begin);
        for (std::size_t j = 0; j < target_.size(); ++j)
            measure(target_[j], terms_[j], &x_[begin], &y_[begin], &z_[begin], count, limit2_,
                    std::uint64_t{1} << j, &distance2_[begin], &near_[begin]);
        const double worst = *std::max_element(distance2_.begin() + std::ptrdiff_t(begin),
                                               distance2_.begin() + std::ptrdiff_t(begin + count));
        if (worst > limit2_) return worst;
    }
    return 0;
}

std::uint64_t Deviation::near_targets(const Vec3& p, std::span<const Frame> targets,
                                      std::span<const EdgeTerms> terms, std::uint64_t among) const {
    if (targets.size() < max_targets) among &= (std::uint64_t{1} << targets.size()) - 1;
    std::uint64_t near = 0;
    for (; among != 0; among &= among - 1) {
        const auto j = std::size_t(std::countr_zero(among));
        if (squared_distance(targets[j], terms[j], p) <= limit2_) near |= among & -among;
    }
    return near;
}

/// Proves that every point of a triangle is near some target. The distance to a triangle is convex: what has
/// all corners near one target is near it. Else it is cut at a point of an edge that is near to targets of both
/// ends. `used` gets the targets that the proof rests on.
bool Deviation::cover(std::array<Vec3, 3> corner, std::array<std::uint64_t, 3> near,
                      std::span<const Frame> targets, std::span<const EdgeTerms> terms, std::uint64_t& used) {
    pieces_.clear();
    pieces_.push_back({corner, near});
    for (std::size_t done = 0; done < pieces_.size(); ++done) {
        Piece p = pieces_[done];
        const std::uint64_t all = p.near[0] & p.near[1] & p.near[2];
        if (all != 0) {
            // Prefer what the proof uses already.
            const std::uint64_t known = all & used;
            used |= std::uint64_t{1} << std::countr_zero(known != 0 ? known : all);
            continue;
        }
        if (pieces_.size() + 2 > max_pieces) return false;
        // The longest edge, first among those whose ends have no target in common.
        int edge = 0;
        double longest = -1;
        for (int k = 0; k < 3; ++k) {
            const Vec3 d = p.corner[(k + 1) % 3] - p.corner[k];
            const bool apart = (p.near[k] & p.near[(k + 1) % 3]) == 0;
            const double length = dot(d, d) * (apart ? 1e6 : 1.0);
            if (length > longest) longest = length, edge = k;
        }
        const int i = edge, j = (edge + 1) % 3, k = (edge + 2) % 3;
        Vec3 low = p.corner[i], high = p.corner[j], at = 0.5 * (low + high);
        // First among those near the ends; others only if there is none.
        const auto look = [&] {
            const std::uint64_t near_ends = near_targets(at, targets, terms, p.near[i] | p.near[j]);
            return near_ends != 0 ? near_ends : near_targets(at, targets, terms, ~(p.near[i] | p.near[j]));
        };
        std::uint64_t near_at = look();
        for (int step = 0; step < max_halvings && near_at != 0; ++step) {
            const bool left = (near_at & p.near[i]) != 0, right = (near_at & p.near[j]) != 0;
            if (left == right) break;  // both: found; neither: other targets lie between
            (left ? low : high) = at;
            at = 0.5 * (low + high);
            near_at = look();
        }
        if (near_at == 0) {
            needed2_ = least_squared_distance(at, targets, terms);
            return false;
        }
        pieces_.push_back({{p.corner[i], at, p.corner[k]}, {p.near[i], near_at, p.near[k]}});
        pieces_.push_back({{at, p.corner[j], p.corner[k]}, {near_at, p.near[j], p.near[k]}});
    }
    return true;
}

/// Original to current: every triangle of the region.
bool Deviation::cover_originals() {
    witness_.clear();
    for (std::size_t i = 0; i < region_.size(); ++i) {
        const Triangle& t = original_[region_[i]].corner;
        const std::array<std::uint64_t, 3> near = {near_[vertex_[t[0]].local], near_[vertex_[t[1]].local],
                                                   near_[vertex_[t[2]].local]};
        const std::uint64_t all = near[0] & near[1] & near[2];
        std::uint64_t used = 0;
        if (all != 0) {
            used = std::uint64_t{1} << std::countr_zero(all);
        } else if (!cover({vertex_[t[0]].at, vertex_[t[1]].at, vertex_[t[2]].at}, near, target_, terms_,
                          used)) {
            return false;
        }
        for (; used != 0; used &= used - 1)
            witness_.push_back({region_[i], std::uint32_t(std::countr_zero(used))});
    }
    return true;
}

/// Current to original: the face's core is covered by the projection, along the face's normal, of original
/// triangles that are nowhere over it by more than the height.
///
/// S grows from a triangle over the core across every edge that may meet it. When it stops, the boundary of S
/// does not meet the core, so that all of the core's points are covered equally often modulo 2; and one is
/// covered an odd number of times, hence all are. A point of the face is within `inset` of a point of the core,
/// in the plane; that one is below or above a point of S by at most the height; and these are perpendicular.
bool Deviation::cover_by_projection(const Frame& face, std::size_t number, double inset) {
    const double height = std::sqrt(std::max(limit2_ - inset * inset, 0.0));
    const Core core(face, inset);
    constexpr double weights[3][3] = {{0.34, 0.33, 0.33}, {0.5, 0.27, 0.23}, {0.21, 0.26, 0.53}};
    for (const auto& w : weights) {
        const double px = w[0] * core.x[0] + w[1] * core.x[1] + w[2] * core.x[2];
        const double py = w[0] * core.y[0] + w[1] * core.y[1] + w[2] * core.y[2];
        const std::uint32_t seed = triangle_over(face, core, height, number, px, py);
        if (seed == no_index) continue;
        const Flood flood = flood_from(seed, face, core, height, px, py);
        if (flood == Flood::leaves) return false;
        if (flood == Flood::covers) return true;
    }
    return false;
}

Shadow Deviation::shadow(const Frame& face, std::uint32_t triangle) const {
    Shadow s;
    for (std::size_t k = 0; k < 3; ++k) s.corner[k] = face.local(vertex_[original_[triangle].corner[k]].at);
    return s;
}

/// A triangle of the region, low over the core, that certainly covers the point; no_index if there is none.
/// First among those that are near the face as a whole.
std::uint32_t Deviation::triangle_over(const Frame& face, const Core& core, double height, std::size_t number,
                                       double px, double py) const {
    const std::uint64_t bit = std::uint64_t{1} << number;
    for (const bool near_face : {true, false})
        for (const std::uint32_t t : region_) {
            const Triangle& c = original_[t].corner;
            const std::uint64_t all =
                near_[vertex_[c[0]].local] & near_[vertex_[c[1]].local] & near_[vertex_[c[2]].local] & bit;
            if ((all != 0) != near_face) continue;
            const Shadow s = shadow(face, t);
            if (s.covers(px, py, rounding_) == 1 && s.low_over(core, height, rounding_)) return t;
        }
    return no_index;
}

/// Grows S from the seed, across every edge that may meet the core.
Deviation::Flood Deviation::flood_from(std::uint32_t seed, const Frame& face, const Core& core, double height,
                                       double px, double py) {
    const double margin = rounding_;
    ++flood_epoch_;
    flood_.assign(1, seed);
    original_[seed].flood_mark = flood_epoch_;
    int parity = 0;
    bool sure = true;
    for (std::size_t done = 0; done < flood_.size(); ++done) {
        const Shadow s = shadow(face, flood_[done]);
        if (!s.low_over(core, height, margin)) return Flood::leaves;
        const int covered = s.covers(px, py, margin);
        sure &= covered >= 0;
        parity ^= covered & 1;
        unsigned code[3];
        for (std::size_t k = 0; k < 3; ++k) code[k] = core.outside(s.corner[k].x, s.corner[k].y, margin);
        for (std::size_t k = 0; k < 3; ++k) {
            const std::size_t m = (k + 1) % 3;
            const Vec3 &from = s.corner[k], &to = s.corner[m];
            if ((code[k] & code[m]) != 0 || core.beside(from.x, from.y, to.x, to.y, margin)) continue;
            const std::uint32_t neighbour = original_[flood_[done]].neighbour[k];
            if (neighbour == no_index) return Flood::leaves;
            if (original_[neighbour].flood_mark == flood_epoch_) continue;
            original_[neighbour].flood_mark = flood_epoch_;
            flood_.push_back(neighbour);
        }
    }
    return sure && parity == 1 ? Flood::covers : Flood::unsure;
}

/// Current to original, where the projection does not do: at boundaries, over sharp edges.
bool Deviation::cover_by_pieces(const Frame& face) {
    const Vec3 centre = (1.0 / 3.0) * (face.a + face.b() + face.c());
    double radius = 0;
    for (const Vec3& p : {face.a, face.b(), face.c()}) radius = std::max(radius, norm(p - centre));
    const double reach = radius + limit_;
    candidates_.clear();
    candidate_terms_.clear();
    for (const std::uint32_t t : region_) {
        const Triangle& c = original_[t].corner;
        const Frame f = make_frame(vertex_[c[0]].at, vertex_[c[1]].at, vertex_[c[2]].at);
        const EdgeTerms e(f);
        if (squared_distance(f, e, centre) > reach * reach) continue;
        if (candidates_.size() == max_targets) return false;
        candidates_.push_back(f);
        candidate_terms_.push_back(e);
    }
    const std::array<Vec3, 3> corner = {face.a, face.b(), face.c()};
    std::array<std::uint64_t, 3> near;
    for (std::size_t k = 0; k < 3; ++k) {
        near[k] = near_targets(corner[k], candidates_, candidate_terms_, ~std::uint64_t{0});
        if (near[k] == 0) return false;  // perhaps near others, outside the region
    }
    std::uint64_t used = 0;
    return cover(corner, near, candidates_, candidate_terms_, used);
}

bool Deviation::cover_face(const Frame& face, std::size_t number) {
    return cover_by_projection(face, number, 0.25 * limit_) ||
           cover_by_projection(face, number, 0.8 * limit_) || cover_by_pieces(face);
}

Deviation::Verdict Deviation::test(std::span<const std::uint32_t> ring, std::span<const std::uint32_t> faces,
                                   std::span<const Frame> frames, const Complex& current, double tolerance) {
    limit_ = tolerance - rounding_;
    if (!(limit_ > 0)) return {false, 0};
    limit2_ = limit_ * limit_;
    gather(ring);
    old_faces_.assign(ring.begin(), ring.end());
    target_.assign(frames.begin(), frames.end());
    target_face_.assign(faces.begin(), faces.end());
    if (!add_other_witnesses(current)) return {false, 0};
    if (const double worst = measure_points(); worst > 0) return {false, std::sqrt(worst)};
    needed2_ = 0;
    if (!cover_originals()) return {false, std::sqrt(needed2_)};
    for (std::size_t j = 0; j < frames.size(); ++j)
        if (!cover_face(frames[j], j)) return {false, 0};
    return {true, 0};
}

void Deviation::accept() {
    ++epoch_;
    for (const std::uint32_t f : old_faces_) {
        face_mark_[f] = epoch_;
        listed_ -= list_of_face_[f].count;
        list_of_face_[f].count = 0;
    }
    for (const std::uint32_t t : region_)
        filter_witnesses(original_[t], [&](std::uint32_t f) { return face_mark_[f] != epoch_; });
    std::erase_if(witness_, [&](const Witness& w) {
        return !add_witness(original_[w.triangle], target_face_[w.target]);
    });
    // The lists of the targets that get more are written anew, at the end.
    std::array<std::uint32_t, max_targets> more{};
    for (const Witness& w : witness_) ++more[w.target];
    for (std::size_t j = 0; j < target_.size(); ++j) {
        if (more[j] == 0) continue;
        List& list = list_of_face_[target_face_[j]];
        const std::uint64_t from = list.begin;
        list.begin = list_.size();
        for (std::uint32_t i = 0; i < list.count; ++i) list_.push_back(list_[from + i]);
        list_.resize(list_.size() + more[j]);
        listed_ += more[j];
    }
    for (const Witness& w : witness_) {
        List& list = list_of_face_[target_face_[w.target]];
        list_[list.begin + list.count++] = w.triangle;
    }
    if (list_.size() > 4 * listed_ + 65536) compact_lists();
}

void Deviation::compact_lists() {
    std::vector<std::uint32_t> lists;
    lists.reserve(2 * listed_);
    for (List& list : list_of_face_) {
        const auto from = list_.begin() + std::ptrdiff_t(list.begin);
        list.begin = lists.size();
        lists.insert(lists.end(), from, from + std::ptrdiff_t(list.count));
    }
    list_.swap(lists);
}

void Deviation::validate(const Complex& current, double tolerance) const {
    const auto require = [](bool holds, const char* what) {
        if (!holds) throw std::logic_error(what);
    };
    std::uint64_t links = 0;
    for (std::uint32_t t = 0; t < original_.size(); ++t) {
        std::uint32_t witnesses = 0;
        Piece piece{{}, {0, 0, 0}};
        for (std::size_t k = 0; k < 3; ++k) piece.corner[k] = vertex_[original_[t].corner[k]].at;
        for_witnesses(original_[t], [&](std::uint32_t f) {
            require(current.has_triangle(f), "a witness is gone");
            const List list = list_of_face_[f];
            const auto begin = list_.begin() + std::ptrdiff_t(list.begin),
                       end = begin + std::ptrdiff_t(list.count);
            require(std::count(begin, end, t) == 1, "a triangle is not in its witness's list");
            const Triangle& c = current.triangle(f);
            const Frame frame =
                make_frame(current.position(c[0]), current.position(c[1]), current.position(c[2]));
            for (std::size_t k = 0; k < 3; ++k)
                if (squared_distance(frame, EdgeTerms(frame), piece.corner[k]) <= tolerance * tolerance)
                    piece.near[k] |= 1;
            ++witnesses;
        });
        require(witnesses > 0, "a triangle has no witness");
        require((piece.near[0] & piece.near[1] & piece.near[2]) != 0, "a corner is near no witness");
        links += witnesses;
    }
    std::uint64_t listed = 0;
    for (const List& list : list_of_face_) listed += list.count;
    require(links == listed && listed == listed_, "lists and witnesses do not agree");
}

}  // namespace its::simplifier
