#include "simplify/hausdorff_bound.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <vector>

#include "base/parallel.h"
#include "base/rounding.h"
#include "distance/closest_point.h"
#include "simplify/frame.h"

namespace its::simplifier {

namespace {

/// How far the bound may be above what is so.
constexpr double slack = 1.0 / 20;
/// A piece is halved no more often. A midpoint is off the edge by √3/2·uS₀, S₀ as below; 40 of them in a row by
/// less than the 42uS₀ that distance_roundings has for cuts.
constexpr int most_halvings = 40;
/// Pieces for each triangle of M, on average, and in all besides: where the meshes nearly coincide a piece is
/// decided only when it is as small as their distance, and the search is given up.
constexpr std::uint64_t pieces_per_triangle = 8, pieces_besides = 20'000;

/// A corner of a piece of M, and the triangle of N nearest to it.
struct Corner {
    Vec3 at;
    std::uint32_t nearest = 0;
};

struct Piece {
    std::array<Corner, 3> corners;
    int halvings = 0;
};

/// The distance to one triangle is convex, so that over a piece it is largest at a corner.
class BranchAndBound {
public:
    BranchAndBound(const Mesh& m, const Mesh& n) : n_(n), tree_(n.vertices, n.triangles) {
        double size = 0;  // S₀ = twice the largest coordinate
        for (const Mesh* mesh : {&m, &n})
            for (const Vec3& v : mesh->vertices)
                size = std::max({size, 2 * std::abs(v.x), 2 * std::abs(v.y), 2 * std::abs(v.z)});
        rounding_ = distance_roundings * unit_roundoff * size;
        pieces_left_ = pieces_per_triangle * m.triangles.size() + pieces_besides;
        corners_.reserve(m.vertices.size());
        for (const Vec3& v : m.vertices) corners_.push_back(locate(v));
    }

    double lower() const { return lower_; }
    bool given_up() const { return pieces_left_ == 0; }
    double upper() const { return allowed() + rounding_; }

    /// Makes upper() hold on a triangle of M.
    void add(const Triangle& t) {
        stack_.push_back({{corners_[t[0]], corners_[t[1]], corners_[t[2]]}});
        while (!stack_.empty() && pieces_left_ > 0) {
            --pieces_left_;
            const Piece piece = stack_.back();
            stack_.pop_back();
            const double bound = bound_of(piece);
            if (bound <= allowed()) continue;
            if (piece.halvings == most_halvings)
                undecided_ = std::max(undecided_, bound);
            else
                halve(piece);
        }
    }

private:
    double allowed() const { return std::max({(1 + slack) * lower_, undecided_, rounding_}); }

    Corner locate(const Vec3& p) {
        const distance::Nearest nearest = tree_.find(p);
        lower_ = std::max(lower_, std::sqrt(nearest.squared));
        return {p, nearest.triangle};
    }

    double bound_of(const Piece& piece) const {
        double least = std::numeric_limits<double>::infinity();
        for (const Corner& corner : piece.corners) {
            const Triangle& t = n_.triangles[corner.nearest];
            const Frame frame = make_frame(n_.vertices[t[0]], n_.vertices[t[1]], n_.vertices[t[2]]);
            const EdgeTerms terms(frame);
            double most = 0;
            for (const Corner& c : piece.corners) most = std::max(most, squared_distance(frame, terms, c.at));
            least = std::min(least, most);
        }
        return std::sqrt(least);
    }

    void halve(const Piece& piece) {
        const auto& c = piece.corners;
        int longest = 0;
        double length = -1;
        for (int i = 0; i < 3; ++i) {
            const Vec3 edge = c[(i + 1) % 3].at - c[i].at;
            if (dot(edge, edge) > length) longest = i, length = dot(edge, edge);
        }
        const Corner &a = c[longest], &b = c[(longest + 1) % 3], &opposite = c[(longest + 2) % 3];
        const Corner middle = locate(0.5 * (a.at + b.at));
        stack_.push_back({{a, middle, opposite}, piece.halvings + 1});
        stack_.push_back({{middle, b, opposite}, piece.halvings + 1});
    }

    const Mesh& n_;
    distance::ClosestPointTree tree_;
    std::vector<Corner> corners_;  ///< of M's vertices
    std::vector<Piece> stack_;
    double lower_ = 0;      ///< distance of a point of M
    double undecided_ = 0;  ///< bound of pieces that were halved too often
    double rounding_ = 0;
    std::uint64_t pieces_left_ = 0;
};

}  // namespace

double hausdorff_bound(const Mesh& m, const Mesh& n, double limit, const Progress& progress) {
    BranchAndBound search(m, n);
    constexpr std::uint64_t step = 1024;
    Stage stage(progress, "compare", m.triangles.size());
    for (std::uint64_t begin = 0; begin < m.triangles.size(); begin += step) {
        const std::uint64_t end = std::min<std::uint64_t>(begin + step, m.triangles.size());
        for (std::uint64_t t = begin; t < end; ++t) {
            search.add(m.triangles[t]);
            if (search.lower() > limit || search.given_up()) return std::numeric_limits<double>::infinity();
        }
        stage.advance(end - begin);
    }
    return search.upper();
}

}  // namespace its::simplifier
