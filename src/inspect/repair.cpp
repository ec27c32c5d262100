#include "inspect/repair.h"

#include <algorithm>

#include "inspect/inspect.h"
#include "inspect/orient.h"
#include "inspect/sides.h"

namespace its::inspector {

namespace {

/// Edges that exactly two triangles have, which run through it in the same direction.
std::uint64_t count_inconsistent(const mesh::Merged& mesh) {
    std::uint64_t count = 0;
    mesh::for_edges(
        mesh, [&](std::size_t i) { return !mesh::repeats_corner(mesh.triangles[i]); },
        [&](std::uint32_t, std::span<const mesh::EdgeUse> uses) {
            count += uses.size() == 2 && uses[0].upwards == uses[1].upwards;
        });
    return count;
}

/// What becomes of the mesh with these triangles turned around.
Directions judge(const mesh::Merged& mesh, std::vector<std::uint8_t> turn) {
    Directions out;
    const mesh::Merged after{mesh.points, turned(mesh.triangles, turn)};
    const Sides sides = sample_sides(after, out.filling.emplace(after));
    out.repaired = std::uint64_t(std::count(turn.begin(), turn.end(), 1));
    out.inconsistent = count_inconsistent(after);
    out.reversed = sides.reversed > sides.separates;
    out.separating = std::max(sides.separates, sides.reversed);
    out.turn = std::move(turn);
    return out;
}

}  // namespace

Directions choose_directions(const mesh::Merged& mesh, std::uint64_t inconsistent) {
    Directions best;
    bool found = false;
    /// \return whether more is not needed
    const auto consider = [&](std::vector<std::uint8_t> turn) {
        if (found && turn == best.turn) return false;
        Directions one = judge(mesh, std::move(turn));
        if (!found || one.separating > best.separating) best = std::move(one);
        found = true;
        return best.separating >= nearly_all;
    };
    const std::vector<std::uint8_t> as_given(mesh.triangles.size(), 0);
    const auto choose = [&] {
        if (inconsistent == 0 && consider(as_given)) return;
        const Patches patches = find_patches(mesh);
        if (consider(majority_turns(mesh, patches))) return;
        if (inconsistent > 0) consider(outward_turns(mesh, patches, false));
    };
    choose();
    if (best.reversed) {
        for (std::uint8_t& turn : best.turn) turn ^= 1;
        best.filling.reset();
    }
    if (std::count(best.turn.begin(), best.turn.end(), 1) == 0) best.turn.clear();
    return best;
}

}  // namespace its::inspector
