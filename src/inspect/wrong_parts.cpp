#include "inspect/wrong_parts.h"

#include <algorithm>
#include <optional>

#include "inspect/nesting.h"
#include "inspect/parts.h"

namespace its::inspector {

namespace {

std::optional<PartFault> fault_of(const Placed& one, std::span<const Placed> placed) {
    if (one.facing == 0) return std::nullopt;
    if (one.containers.empty()) return one.facing < 0 ? std::optional(PartFault::inside_out) : std::nullopt;
    return placed[one.containers.back()].facing == one.facing ? std::optional(PartFault::like_its_container)
                                                              : std::nullopt;
}

}  // namespace

void examine_parts(const mesh::Merged& mesh, Inspection& out) {
    const Parts parts = find_parts(mesh);
    const std::vector<Placed> placed = place_parts(mesh, parts);
    PartsReport& said = out.report.parts;
    said.closed = placed.size();
    for (const Placed& one : placed) {
        said.nested += one.containers.empty() ? 0 : 1;
        said.overlapping += one.crosses ? 1 : 0;
        const std::optional<PartFault> fault = fault_of(one, placed);
        if (!fault) continue;
        const auto triangles = parts.triangles(one.part);
        said.wrong.push_back({.fault = *fault,
                              .triangles = triangles.size(),
                              .first_triangle = triangles.front(),
                              .bounds = one.bounds,
                              .volume = one.volume,
                              .depth = one.containers.size(),
                              .overlaps = one.crosses || one.unclear});
    }
    const std::vector<std::uint8_t> turns = nesting_turns(placed);
    said.to_turn = std::uint64_t(std::count(turns.begin(), turns.end(), 1));
    if (said.to_turn == 0) return;
    out.part_turn.assign(mesh.triangles.size(), 0);
    for (std::size_t i = 0; i < placed.size(); ++i) {
        if (turns[i] == 0) continue;
        for (const std::uint32_t t : parts.triangles(placed[i].part)) out.part_turn[t] = 1;
    }
}

}  // namespace its::inspector
