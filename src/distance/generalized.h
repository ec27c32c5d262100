#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "distance/winding.h"
#include "mesh/filling.h"
#include "octree/lattice.h"
#include "octree/octree.h"
#include "octree/voxelise.h"

/// Signs by generalized winding numbers: meshes with boundary.
namespace its {

/// Whether lattice points are inside: their winding number is over ½, and they lie in M's bounding box. The
/// winding number is the sum of the crossings of M and of a surface F that fills its boundary, less the winding
/// number of F; see docs/design/signs.md for bounds and cost.
class GeneralizedSigns {
public:
    /// \param voxels  of the same mesh and lattice
    GeneralizedSigns(const Mesh& mesh, const Lattice& lattice, const Voxels& voxels, const Progress& progress);

    /// Adds to `voxels`, with no triangles, every finest cell whose corners are not all on one side.
    void add_flip_cells(Voxels& voxels, const Progress& progress);

    /// Gives distances their sign: negative inside. At the corners of finest cells in which inside and outside
    /// meet in a hole, a distance is at most that to where they meet, so that f = 0 runs there and not in
    /// steps.
    void apply(const Octree& octree, std::vector<std::vector<double>>& distance,
               const Progress& progress) const;

    /// Of one lattice point.
    bool inside(std::int64_t x, std::int64_t y, std::int64_t z) const;

    const Filling& filling() const { return filling_; }

private:
    struct Cube;
    struct Scratch;
    struct Judgement;
    struct Near;

    Vec3 centre(const Cube& cube) const;
    double ball_radius(const Cube& cube) const;  ///< of a ball about the centre that holds the cube
    const Filling::Surroundings& surroundings(const Cube& cube, Scratch& scratch) const;
    WindingEstimate finer_estimate(const Cube& cube, int i, Scratch& scratch) const;
    WindingEstimate finest_estimate(const Vec3& p, Filling::Local& local) const;
    static bool settles(const WindingEstimate& estimate, std::int32_t crossings, double& above);
    bool decide_exactly(const Vec3& p, std::int32_t of_mesh) const;
    double precise_winding(const Cube& cube, int i, std::int32_t of_mesh, std::int32_t of_filling,
                           Scratch& scratch) const;
    void find_near(const Cube& cube, std::uint32_t inside, Scratch& scratch, std::vector<Near>& near) const;
    void remember(std::vector<Near>& near);
    double hole_distance(std::uint64_t point) const;
    void shorten(const Cube& cube, double* distance) const;
    static std::size_t filter_place(std::uint64_t point);

    Judgement judge(const Cube& cube, Scratch& scratch) const;
    std::uint32_t inside_points(const Cube& cube, Scratch& scratch) const;
    bool recall(const Cube& cube, std::uint32_t& bits) const;
    template <class F>
    std::uint32_t select_points(const Cube& cube, F&& inside) const;
    std::uint32_t points_above(const Cube& cube, std::int32_t threshold) const;

    const Lattice& lattice_;
    Filling filling_;
    WindingLines mesh_lines_, filling_lines_;
    std::array<std::int64_t, 3> first_, last_;  ///< lattice points in M's bounding box

    /// Cubes of level 1 whose points were found by add_flip_cells(), in Morton order.
    std::vector<std::uint64_t> known_cube_;
    std::vector<std::uint32_t> known_inside_;

    /// Corners of finest cells in which inside and outside meet away from M, as Morton codes in ascending
    /// order, and how far from each that is.
    std::vector<std::uint64_t> hole_point_;
    std::vector<double> hole_distance_;
    static constexpr int filter_bits = 20;
    std::vector<bool> hole_filter_ =
        std::vector<bool>(std::size_t{1} << filter_bits);  ///< by hash: may be one of them
};

}  // namespace its
