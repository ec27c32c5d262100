#include "field/lscg.h"

#include <fmt/format.h>
#include <Eigen/IterativeLinearSolvers>
#include <Eigen/SparseCore>
#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "base/parallel.h"
#include "base/progress.h"

namespace its::field {
namespace {

using Index = std::int64_t;
using Matrix = Eigen::SparseMatrix<double, Eigen::RowMajor, Index>;
using Position = std::array<std::uint32_t, 3>;  // in cell widths of the grid point's own level

std::uint64_t key(const Position& p) {
    return octree::morton_encode(p);
}

/// Calls visit(position, index into values[level]) for the 27 points of each group of the level.
template <class Visit>
void for_points(const octree::Level& level, Visit&& visit) {
    for (std::uint64_t group = 0; group < level.groups(); ++group) {
        const octree::Cell parent = octree::morton_decode(level.parent[group]);
        for (std::uint32_t point = 0; point < octree::group_points; ++point)
            visit(Position{2 * parent[0] + point % 3, 2 * parent[1] + point / 3 % 3, 2 * parent[2] + point / 9},
                  group * octree::group_points + point);
    }
}

/// The grid points of all levels, each position once a level. Unknown and equation of a grid point have the
/// same number; levels follow each other, positions are in Morton order.
class GridPoints {
public:
    explicit GridPoints(const octree::Octree& octree)
        : points_(octree.levels.size()), first_(octree.levels.size() + 1) {
        for (std::size_t k = 0; k < octree.levels.size(); ++k) {
            auto& points = points_[k];
            points.reserve(octree.levels[k].groups() * octree::group_points);
            for_points(octree.levels[k], [&](const Position& p, std::uint64_t) { points.push_back(key(p)); });
            std::ranges::sort(points);
            points.erase(std::unique(points.begin(), points.end()), points.end());
            points.shrink_to_fit();
            first_[k + 1] = first_[k] + Index(points.size());
        }
    }
    int levels() const { return int(points_.size()); }
    Index count() const { return first_.back(); }
    Index first(int level) const { return first_[level]; }
    Position position(int level, Index i) const {
        return octree::morton_decode(points_[level][i - first_[level]]);
    }

    /// Number of the grid point, or −1 if the level has none there.
    Index find(int level, const Position& p) const {
        const auto& points = points_[level];
        const auto at = std::ranges::lower_bound(points, key(p));
        return at != points.end() && *at == key(p) ? first_[level] + (at - points.begin()) : -1;
    }

    /// Calls visit(number, B((g − h)/w_j)) for the grid points h of level j whose hats do not vanish at the
    /// grid point g of level k at p.
    template <class Visit>
    void for_hats(int j, int k, const Position& p, Visit&& visit) const {
        if (j <= k) {  // g is a lattice point of level j: only a hat centred on it
            const int up = k - j;
            const Index h = find(j, {p[0] << up, p[1] << up, p[2] << up});
            if (h >= 0) visit(h, 1.0);
            return;
        }
        const int down = j - k;
        const double width = std::ldexp(1.0, down);
        for (std::uint32_t corner = 0; corner < 8; ++corner) {
            Position h;
            double weight = 1;
            for (int axis = 0; axis < 3; ++axis) {
                const std::uint32_t cell = p[axis] >> down, bit = corner >> axis & 1;
                const double t = double(p[axis] - (cell << down)) / width;  // exact
                h[axis] = cell + bit;
                weight *= bit ? t : 1 - t;
            }
            if (weight == 0) continue;
            const Index number = find(j, h);
            if (number >= 0) visit(number, weight);
        }
    }

private:
    std::vector<std::vector<std::uint64_t>> points_;
    std::vector<Index> first_;
};

/// Row g: the values at g of all hats of all levels, finer ones too.
Matrix make_matrix(const GridPoints& grid, Stage& stage) {
    Matrix matrix(grid.count(), grid.count());
    std::vector<std::pair<Index, double>> row;
    for (int k = 0; k < grid.levels(); ++k) {
        for (Index i = grid.first(k); i < grid.first(k + 1); ++i) {
            row.clear();
            const Position p = grid.position(k, i);
            for (int j = 0; j < grid.levels(); ++j)
                grid.for_hats(j, k, p, [&](Index h, double weight) { row.emplace_back(h, weight); });
            std::ranges::sort(row);
            matrix.startVec(i);
            for (const auto& [h, weight] : row) matrix.insertBackByOuterInner(i, h) = weight;
            stage.advance(1);
        }
    }
    matrix.finalize();
    return matrix;
}

/// Eigen's preconditioner for least squares, which also lets the caller stop: Eigen asks it once an iteration.
class StoppablePreconditioner : public Eigen::LeastSquareDiagonalPreconditioner<double> {
    using Base = Eigen::LeastSquareDiagonalPreconditioner<double>;

public:
    Stage* stage = nullptr;

    template <class Vector>
    auto solve(const Eigen::MatrixBase<Vector>& b) const {
        stage->advance(1);
        return Base::solve(b);
    }
};

/// Far more than needed: spheres took 22, 26, 37, 41 for K = 3..6, random distances on random octrees up to 30.
constexpr std::uint64_t most_iterations = 1000;

/// Greatest magnitude; NaN if there is one.
double greatest(const Eigen::VectorXd& v) {
    return v.size() == 0 ? 0 : v.cwiseAbs().maxCoeff<Eigen::PropagateNaN>();
}

/// F_k(g) = Σ_{j ≥ k} Σ_h λ_h B((g − h)/w_j), once for each grid point, then written to all of its groups.
Field cumulative(const octree::Octree& octree, const GridPoints& grid, const Eigen::VectorXd& coefficients) {
    Eigen::VectorXd value(grid.count());
    Field field;
    for (int k = 0; k < grid.levels(); ++k) {
        for (Index i = grid.first(k); i < grid.first(k + 1); ++i) {
            const Position p = grid.position(k, i);
            double sum = 0;
            for (int j = grid.levels() - 1; j >= k; --j)
                grid.for_hats(j, k, p, [&](Index h, double weight) { sum += weight * coefficients[h]; });
            value[i] = sum;
        }
        std::vector<double> values(octree.levels[k].groups() * octree::group_points);
        for_points(octree.levels[k],
                   [&](const Position& p, std::uint64_t at) { values[at] = value[grid.find(k, p)]; });
        field.values.emplace_back(std::move(values));
    }
    return field;
}

}  // namespace

bool has_lscg() {
    return true;
}

Field solve_lscg(const octree::Octree& octree, const Field& distance, double tolerance,
                 const Progress& progress, LscgReport* report) {
    const GridPoints grid(octree);
    Parts parts(progress);
    Stage assembly(parts.until(0.2), "equations", std::uint64_t(grid.count()));
    const Matrix matrix = make_matrix(grid, assembly);
    Eigen::VectorXd target(grid.count());
    for (int k = 0; k < grid.levels(); ++k)
        for_points(octree.levels[k], [&](const Position& p, std::uint64_t at) {
            target[grid.find(k, p)] = distance.values[k][at];
        });

    Stage solving(parts.until(1), "coefficients", most_iterations);
    Eigen::LeastSquaresConjugateGradient<Matrix, StoppablePreconditioner> solver;
    solver.preconditioner().stage = &solving;
    solver.compute(matrix);
    Eigen::VectorXd coefficients = Eigen::VectorXd::Zero(grid.count());
    LscgReport result{.equations = std::uint64_t(grid.count())};
    const double accepted = tolerance * greatest(target);
    // Eigen stops by the norm of Aᵀr relative to Aᵀb, we accept by the greatest |r|. The two differ by a factor
    // of up to the condition number: ask for more until it is enough, or until doubles hold no more.
    for (double asked = std::max(tolerance, 1e-15); asked > 1e-17; asked /= 10) {
        solver.setTolerance(asked);
        solver.setMaxIterations(Index(most_iterations - result.iterations));
        coefficients = solver.solveWithGuess(target, coefficients).eval();
        result.iterations += std::uint64_t(solver.iterations());
        result.residual = greatest(matrix * coefficients - target);
        if (result.residual <= accepted || result.iterations >= most_iterations) break;
    }
    if (report != nullptr) *report = result;
    if (!(result.residual <= accepted))
        throw Error(
            fmt::format("least-squares conjugate gradients stopped after {} iterations with a residual of "
                        "{:.2g} instead of {:.2g}; use the direct solver",
                        result.iterations, result.residual, accepted));
    return cumulative(octree, grid, coefficients);
}

}  // namespace its::field
