#include "inspect/orient.h"

#include <algorithm>
#include <cstdlib>
#include <numeric>
#include <utility>

#include "geometry/predicates.h"
#include "geometry/vec3.h"
#include "winding/x_rays.h"

namespace its::inspector {

namespace {

constexpr std::uint64_t votes = 15;  // of a patch; odd
constexpr int most_rounds = 64;      // each lessens what does not cancel, in sum; a few are enough

/// Sets of triangles with the relative direction of each within its set (union by index, path halving).
class Sets {
public:
    explicit Sets(std::size_t count) : parent_(count), against_(count, 0) {
        std::iota(parent_.begin(), parent_.end(), std::uint32_t{0});
    }

    /// The lowest member, and whether i runs against it.
    std::pair<std::uint32_t, std::uint8_t> find(std::uint32_t i) {
        std::uint8_t against = 0;
        while (parent_[i] != i) {
            const std::uint32_t p = parent_[i];
            against_[i] ^= p == parent_[p] ? 0 : against_[p];
            parent_[i] = parent_[p];
            against ^= against_[i];
            i = parent_[i];
        }
        return {i, against};
    }

    /// \return false if the two are known to run the other way.
    bool join(std::uint32_t i, std::uint32_t j, std::uint8_t against) {
        const auto [a, from_a] = find(i);
        const auto [b, from_b] = find(j);
        const auto turn = std::uint8_t(from_a ^ from_b ^ against);
        if (a == b) return turn == 0;
        parent_[std::max(a, b)] = std::min(a, b);
        against_[std::max(a, b)] = turn;
        return true;
    }

private:
    std::vector<std::uint32_t> parent_;
    std::vector<std::uint8_t> against_;  ///< its parent
};

double area_of(const mesh::Merged& mesh, std::uint32_t triangle) {
    const Triangle& t = mesh.triangles[triangle];
    const Vec3 a = mesh.points[t[0]];
    return norm(cross(mesh.points[t[1]] - a, mesh.points[t[2]] - a));
}

/// Whether the side that the triangle's normal points to is even, at its centroid but for rounding; 0 if it has
/// no sides, else 1 for yes and −1 for no.
int faces_outward(const mesh::Merged& mesh, const winding::XRays& rays, std::uint32_t triangle) {
    const Triangle& t = mesh.triangles[triangle];
    const Vec3 &a = mesh.points[t[0]], &b = mesh.points[t[1]], &c = mesh.points[t[2]];
    const Vec3 p = (1.0 / 3) * a + (1.0 / 3) * b + (1.0 / 3) * c;
    const int side = geometry::perturbed_orient3d(a, b, c, p);
    return rays.crossings(p) % 2 == 0 ? side : -side;
}

/// Whether the patch, made to agree with its first triangle, mostly faces inward: triangles picked evenly by
/// area vote. `members`: triangles of the patch with a running sum of their areas.
bool faces_inward(const mesh::Merged& mesh, const winding::XRays& rays, const Patches& patches,
                  std::span<const std::uint32_t> members, const std::vector<double>& running) {
    int balance = 0;
    for (std::uint64_t i = 0; i < votes; ++i) {
        const double at = (double(i) + 0.5) / double(votes) * running.back();
        const auto found = std::lower_bound(running.begin(), running.end(), at);
        const std::uint32_t t = members[std::min(std::size_t(found - running.begin()), members.size() - 1)];
        const int outward = faces_outward(mesh, rays, t);
        balance += patches.against[t] != 0 ? -outward : outward;
    }
    return balance < 0;
}

}  // namespace

namespace {

/// Two triangles that run through an edge, which no other has, in the same direction.
struct Disagreement {
    std::uint32_t first, second;
};

/// Joins sets that disagree at edges, those first that do so at most edges.
/// \return whether all of these edges are made to agree
bool join_disagreeing(Sets& sets, const std::vector<Disagreement>& edges) {
    struct Joint {
        std::uint32_t low, high;  // of two sets, their lowest members
        std::uint64_t edges;
        std::uint8_t against;  // whether the one must run against the other
    };
    std::vector<std::pair<std::uint32_t, std::uint32_t>> pairs;
    pairs.reserve(edges.size());
    for (const Disagreement& e : edges)
        pairs.push_back(std::minmax(sets.find(e.first).first, sets.find(e.second).first));
    std::sort(pairs.begin(), pairs.end());
    std::vector<Joint> joints;
    for (const auto& [low, high] : pairs) {
        if (joints.empty() || joints.back().low != low || joints.back().high != high)
            joints.push_back({low, high, 0, 1});
        ++joints.back().edges;
    }
    std::stable_sort(joints.begin(), joints.end(),
                     [](const Joint& a, const Joint& b) { return a.edges > b.edges; });
    bool all = true;
    for (const Joint& joint : joints) all &= sets.join(joint.low, joint.high, joint.against);
    return all;
}

/// How often more a patch goes up an edge than down.
struct Flow {
    std::uint64_t edge;
    std::uint32_t patch;
    std::int64_t excess;
};

/// The flows through edges with more than two triangles, as these run after turning, by edge.
std::vector<Flow> find_flows(const mesh::Merged& mesh, const Patches& patches,
                             const std::vector<std::uint8_t>& turn) {
    std::vector<Flow> flows;
    std::uint64_t edge = 0;
    mesh::for_edges(
        mesh, [&](std::size_t i) { return !mesh::repeats_corner(mesh.triangles[i]); },
        [&](std::uint32_t, std::span<const mesh::EdgeUse> uses) {
            if (uses.size() <= 2) return;
            for (const mesh::EdgeUse& use : uses)
                flows.push_back(
                    {edge, patches.patch[use.triangle], use.upwards != (turn[use.triangle] != 0) ? 1 : -1});
            ++edge;
        });
    std::stable_sort(flows.begin(), flows.end(), [](const Flow& a, const Flow& b) {
        return std::pair(a.edge, a.patch) < std::pair(b.edge, b.patch);
    });
    std::size_t kept = 0;
    for (const Flow& flow : flows) {
        if (kept > 0 && flows[kept - 1].edge == flow.edge && flows[kept - 1].patch == flow.patch)
            flows[kept - 1].excess += flow.excess;
        else
            flows[kept++] = flow;
    }
    flows.resize(kept);
    return flows;
}

/// Turns whole patches around, the smallest first, while that brings the two directions closer to each other at
/// edges with more than two triangles.
void balance(const mesh::Merged& mesh, const Patches& patches, const std::vector<double>& area,
             std::vector<std::uint8_t>& turn) {
    std::vector<Flow> flows = find_flows(mesh, patches, turn);
    if (flows.empty()) return;
    std::vector<std::int64_t> net(flows.back().edge + 1, 0);
    for (const Flow& flow : flows) net[flow.edge] += flow.excess;
    std::stable_sort(flows.begin(), flows.end(), [&](const Flow& a, const Flow& b) {
        return std::pair(area[a.patch], a.patch) < std::pair(area[b.patch], b.patch);
    });
    std::vector<std::uint8_t> turned(patches.count, 0);
    bool changed = true;
    for (int round = 0; round < most_rounds && changed; ++round) {
        changed = false;
        for (std::size_t begin = 0, end = 0; begin < flows.size(); begin = end) {
            const std::uint32_t patch = flows[begin].patch;
            std::int64_t gain = 0;
            for (end = begin; end < flows.size() && flows[end].patch == patch; ++end)
                gain += std::abs(net[flows[end].edge]) - std::abs(net[flows[end].edge] - 2 * flows[end].excess);
            if (gain <= 0) continue;
            for (std::size_t i = begin; i < end; ++i) {
                net[flows[i].edge] -= 2 * flows[i].excess;
                flows[i].excess = -flows[i].excess;
            }
            turned[patch] ^= 1;
            changed = true;
        }
    }
    for (std::size_t i = 0; i < turn.size(); ++i) turn[i] ^= turned[patches.patch[i]];
}

}  // namespace

Patches find_patches(const mesh::Merged& mesh) {
    Sets sets(mesh.triangles.size());
    Patches out;
    std::vector<Disagreement> disagreements;
    mesh::for_edges(
        mesh, [&](std::size_t i) { return !mesh::repeats_corner(mesh.triangles[i]); },
        [&](std::uint32_t, std::span<const mesh::EdgeUse> uses) {
            if (uses.size() != 2) return;
            if (uses[0].upwards == uses[1].upwards)
                disagreements.push_back({uses[0].triangle, uses[1].triangle});
            else
                sets.join(uses[0].triangle, uses[1].triangle, 0);
        });
    out.orientable = join_disagreeing(sets, disagreements);
    out.patch.resize(mesh.triangles.size());
    out.against.resize(mesh.triangles.size());
    for (std::uint32_t i = 0; i < mesh.triangles.size(); ++i) {
        const auto [root, against] = sets.find(i);
        out.against[i] = against;
        out.patch[i] = root == i ? out.count++ : out.patch[root];  // the root is the lowest
        if (root == i) out.mixed.push_back(0);
        out.mixed[out.patch[i]] |= against;
    }
    return out;
}

std::vector<std::uint8_t> majority_turns(const mesh::Merged& mesh, const Patches& patches) {
    std::vector<double> area(patches.count, 0), against(patches.count, 0);
    for (std::uint32_t i = 0; i < mesh.triangles.size(); ++i) {
        const double one = area_of(mesh, i);
        area[patches.patch[i]] += one;
        if (patches.against[i] != 0) against[patches.patch[i]] += one;
    }
    std::vector<std::uint8_t> turn(mesh.triangles.size());
    for (std::size_t i = 0; i < turn.size(); ++i) {
        const std::uint32_t p = patches.patch[i];
        turn[i] = std::uint8_t(patches.against[i] ^ std::uint8_t(against[p] > 0.5 * area[p]));
    }
    balance(mesh, patches, area, turn);
    return turn;
}

std::vector<std::uint8_t> outward_turns(const mesh::Merged& mesh, const Patches& patches, bool all) {
    const winding::XRays rays(mesh.points, mesh.triangles);
    std::vector<std::uint64_t> first(patches.count + std::size_t{1}, 0);
    for (const std::uint32_t p : patches.patch) ++first[p + std::size_t{1}];
    std::partial_sum(first.begin(), first.end(), first.begin());
    std::vector<std::uint32_t> order(mesh.triangles.size());
    std::vector<std::uint64_t> next(first.begin(), first.end() - 1);
    for (std::uint32_t i = 0; i < order.size(); ++i) order[next[patches.patch[i]]++] = i;

    std::vector<std::uint8_t> turn(mesh.triangles.size(), 0);
    std::vector<double> running;
    for (std::uint32_t p = 0; p < patches.count; ++p) {
        if (!all && patches.mixed[p] == 0) continue;
        const auto members = std::span(order).subspan(first[p], first[p + std::size_t{1}] - first[p]);
        running.clear();
        double sum = 0;
        for (const std::uint32_t t : members) running.push_back(sum += area_of(mesh, t));
        const auto inward = std::uint8_t(faces_inward(mesh, rays, patches, members, running));
        for (const std::uint32_t t : members) turn[t] = std::uint8_t(patches.against[t] ^ inward);
    }
    return turn;
}

}  // namespace its::inspector
