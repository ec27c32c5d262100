#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <vector>

#include "mesh/arrays.h"
#include "octree/lattice.h"
#include "octree/octree.h"
#include "octree/voxelise.h"
#include "signs/hole_points.h"
#include "signs/winding_lines.h"
#include "winding/octants.h"

/// Signs by generalized winding numbers: meshes with boundary.
namespace its::signs {

/// Whether lattice points are inside: their winding number is over ½, and they lie in M's bounding box. The
/// winding number is the sum of the crossings of M and of a surface F that fills its boundary, less the winding
/// number of F; see docs/design/signs.md for bounds and cost.
class GeneralizedSigns {
public:
    /// \param voxels   of the same mesh and lattice
    /// \param filling  of this mesh, where it is there already
    GeneralizedSigns(const mesh::Arrays& mesh, const octree::Lattice& lattice, const octree::Voxels& voxels,
                     const Progress& progress, std::optional<winding::Filling> filling = {});

    GeneralizedSigns(const GeneralizedSigns&) = delete;
    GeneralizedSigns& operator=(const GeneralizedSigns&) = delete;

    /// Adds to `voxels`, with no triangles, every finest cell whose corners are not all on one side.
    void add_flip_cells(octree::Voxels& voxels, const Progress& progress);

    /// Gives distances their sign: negative inside. At the corners of finest cells in which inside and outside
    /// meet in a hole, a distance is at most that to where they meet, so that f = 0 runs there and not in
    /// steps.
    void apply(const octree::Octree& octree, std::vector<std::vector<double>>& distance,
               const Progress& progress) const;

    /// Of one lattice point.
    bool inside(std::int64_t x, std::int64_t y, std::int64_t z) const;

    const winding::Filling& filling() const { return filling_; }
    const HolePoints& holes() const { return holes_; }

private:
    struct Cube;
    struct Scratch;
    /// What is known of all of a cube.
    struct Judgement {
        bool decided = false;   ///< inside is where the crossings of M + F are above `threshold`
        bool may_flip = false;  ///< two points of it with no triangle between them may be on different sides
        std::int32_t threshold = 0;
    };
    using Judgements = std::array<Judgement, 8>;
    /// Cubes of one level in which sides may change, in Morton order.
    struct FlipCubes {
        std::vector<std::uint64_t> cube;
        std::vector<Judgements> judged;  ///< the cubes that halve each
    };
    struct Found;

    Vec3 centre(const Cube& cube) const;
    Vec3 position(const Cube& cube, int i) const;
    winding::Octants& octants(const Cube& cube, Scratch& scratch) const;
    Judgement judge(const winding::Octants& octants, int lane, const Cube& cube) const;
    Judgements judge_halves(const Cube& cube, Scratch& scratch) const;
    std::uint32_t inside_points(const Cube& cube, Scratch& scratch) const;
    std::uint32_t points_above(const Cube& cube, std::int32_t threshold) const;
    static std::size_t find(const std::vector<std::uint64_t>& list, std::uint64_t code);
    Judgements halves_of(const Cube& cube, const Judgement& judged, Scratch& scratch) const;
    std::uint32_t finest_points(const Cube& cube, const Judgement& judged, Scratch& scratch) const;
    static std::uint32_t coarse_points(const octree::Octree& octree, int level, std::uint64_t group,
                                       const std::vector<std::uint32_t>& below);
    std::vector<std::uint32_t> find_finest(const octree::Octree& octree, const Progress& progress) const;
    template <class F>
    std::uint32_t select_points(const Cube& cube, F&& inside) const;
    void refine(double accuracy, std::uint32_t& open, std::uint32_t& bits, Scratch& scratch) const;
    bool decide_exactly(const Vec3& p, std::int32_t of_mesh) const;
    void find_flips(std::vector<std::uint64_t>& cells, std::vector<HolePoints::Point>& near,
                    const Progress& progress);
    void descend(const Cube& cube, int lowest, Scratch& scratch, Found& found) const;
    void visit_flip(const Cube& cube, Scratch& scratch, Found& found) const;
    double precise_winding(int i, const Scratch& scratch) const;
    void find_near(const Cube& cube, std::uint32_t inside, Scratch& scratch,
                   std::vector<HolePoints::Point>& near) const;

    const octree::Lattice& lattice_;
    winding::Filling filling_;
    winding::Octants space_;  ///< all of it
    WindingLines mesh_lines_, filling_lines_;
    std::array<std::int64_t, 3> first_, last_;  ///< lattice points in M's bounding box

    std::vector<FlipCubes> flips_;  ///< by level, from 2 on, of add_flip_cells()
    /// Cubes of level 1 whose points were found by add_flip_cells(), in Morton order.
    std::vector<std::uint64_t> known_cube_;
    std::vector<std::uint32_t> known_inside_;

    HolePoints holes_;
};

}  // namespace its::signs
