#pragma once

#include <cstdint>

#include "field/field.h"
#include "its/base.h"
#include "octree/octree.h"

/// The paper's way to the coefficients: one sparse, singular, consistent system for all of them.
namespace its::field {

struct LscgReport {
    std::uint64_t equations = 0;   ///< grid points of all levels, each once
    std::uint64_t iterations = 0;  ///< of conjugate gradients
    double residual = 0;           ///< greatest |f(g) − D(g)| over all grid points, in units of D
};

/// Whether this library has the solver, which needs Eigen; see field/without_lscg.cpp.
bool has_lscg();

/// Solves f(g) = D(g) for the coefficients of all grid points of all levels with Eigen's
/// LeastSquaresConjugateGradient, diagonal preconditioner, from zero. Slow: meant for small depths and as an
/// oracle. Serial; the same bits on every run.
/// \param distance   D(g) in the layout of Field: values[k][27·group + point]
/// \param tolerance  accept where |f(g) − D(g)| ≤ tolerance × max |D| for every grid point; 1e-12 is attainable
/// \param report     if not null, receives how it went
/// \throws Error if the tolerance is not reached, Cancelled
Field solve_lscg(const octree::Octree& octree, const Field& distance, double tolerance,
                 const Progress& progress, LscgReport* report = nullptr);

}  // namespace its::field
