#pragma once

#include <array>
#include <cstdint>

#include "its/shell.h"
#include "mesh/arrays.h"
#include "octree/lattice.h"

/// What a build is to reach, where options leave that open.
namespace its::shell {

struct Target {
    double thickness = 0;         ///< mesh units; 0: a depth is asked for
    std::uint64_t max_cells = 0;  ///< of a shell that is built to a thickness; 0: any number

    bool adaptive() const { return thickness > 0; }
};

/// \throws InputError on what is no mesh, or too far from the origin for its size, unless a depth is asked for
Target target_of(const mesh::Arrays& mesh, const BuildOptions& options);

/// The depth K of cells that suffice for a thickness.
/// \throws InputError if the mesh is too far from the origin for any
int depth_for(double thickness, const Box& bounds, const BuildOptions& options);

/// γ in cells of a lattice on which surface cells are of least_adaptive_depth at least, as it is where f is as
/// steep as a distance can be along an edge beside a hanging corner, by far.
double expected_rounding(const octree::Lattice& lattice);

/// The hash of what was aimed at: input_hash().
std::array<std::uint64_t, 2> hash_of(const mesh::Arrays& mesh, const BuildOptions& options,
                                     const Target& target);

}  // namespace its::shell
