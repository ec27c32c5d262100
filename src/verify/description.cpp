#include <fmt/format.h>
#include <xxhash.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <memory>
#include <new>
#include <span>
#include <tuple>
#include <vector>

#include "base/parallel.h"
#include "its/version.h"
#include "verify/checks.h"

namespace its::verifier {
namespace {

bool turned(const Triangle& a, const Triangle& b) {
    return a != b && b == Triangle{a[0], a[2], a[1]};
}

/// An edge of the given mesh's triangle, and whether it runs from its lower to its higher position.
struct Side {
    std::uint32_t low, high, triangle;
    bool ascending;
};

std::vector<Side> sides_of(const Mesh& mesh, const std::vector<std::uint32_t>& position) {
    std::vector<Side> sides;
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t)
        for (int i = 0; i < 3; ++i) {
            const std::uint32_t from = position[mesh.triangles[t][std::size_t(i)]],
                                to = position[mesh.triangles[t][std::size_t((i + 1) % 3)]];
            sides.push_back({std::min(from, to), std::max(from, to), std::uint32_t(t), from < to});
        }
    std::sort(sides.begin(), sides.end(), [](const Side& a, const Side& b) {
        return std::tuple(a.low, a.high, a.triangle) < std::tuple(b.low, b.high, b.triangle);
    });
    return sides;
}

/// Two triangles that share an edge with no third and agree about the outside are turned together or not at
/// all. \return how many such pairs were torn apart
std::uint64_t torn_pairs(const Job& job) {
    const std::vector<Side> sides = sides_of(job.mesh, number_positions(job.mesh).number);
    const auto is_turned = [&](std::uint32_t t) {
        return turned(job.mesh.triangles[t], job.view.data().mesh.triangles[t]);
    };
    std::uint64_t torn = 0;
    for (std::size_t i = 0; i < sides.size();) {
        std::size_t end = i;
        while (end < sides.size() && sides[end].low == sides[i].low && sides[end].high == sides[i].high) ++end;
        if (end - i == 2 && sides[i].triangle != sides[i + 1].triangle && sides[i].low != sides[i].high)
            torn += sides[i].ascending != sides[i + 1].ascending &&
                    is_turned(sides[i].triangle) != is_turned(sides[i + 1].triangle);
        i = end;
    }
    return torn;
}

/// Where the copy first differs from the given mesh by more than turns.
std::string first_difference(const Job& job) {
    const shell::MeshArrays& copy = job.view.data().mesh;
    if (copy.vertices.size() != job.mesh.vertices.size() || copy.triangles.size() != job.mesh.triangles.size())
        return fmt::format("the shell's copy of the mesh has {} vertices and {} triangles, the mesh {} and {}",
                           copy.vertices.size(), copy.triangles.size(), job.mesh.vertices.size(),
                           job.mesh.triangles.size());
    for (std::size_t v = 0; v < copy.vertices.size(); ++v)
        if (!(copy.vertices[v] == job.mesh.vertices[v]))
            return fmt::format("vertex {} of the shell's copy of the mesh is at {}, not at {}", v,
                               place(copy.vertices[v]), place(job.mesh.vertices[v]));
    for (std::size_t t = 0; t < copy.triangles.size(); ++t)
        if (copy.triangles[t] != job.mesh.triangles[t] && !turned(job.mesh.triangles[t], copy.triangles[t]))
            return fmt::format("triangle {} of the shell's copy of the mesh has other corners", t);
    return {};
}

void check_copy(const Job& job, VerifyReport& report) {
    VerifyCheck check{"copy of the mesh", false, true, job.mesh.triangles.size(), 0, 0, ""};
    if (!job.same_mesh) {
        check.violations = 1;
        check.detail = first_difference(job);
        report.checks.push_back(check);
        return;
    }
    std::uint64_t turns = 0;
    for (std::size_t t = 0; t < job.mesh.triangles.size(); ++t)
        turns += turned(job.mesh.triangles[t], job.view.data().mesh.triangles[t]);
    const SignRule rule = job.view.data().info.sign;
    const bool directed = rule == SignRule::winding || rule == SignRule::generalized;
    check.violations = directed ? torn_pairs(job) : turns;
    check.passed = check.violations == 0;
    check.detail = fmt::format("the shell's copy is the given mesh, {} of {} triangles turned around", turns,
                               job.mesh.triangles.size());
    if (job.view.data().info.weld > 0)
        check.detail += fmt::format(", after corners nearer than {:.6g} became one", job.view.data().info.weld);
    if (!check.passed)
        check.detail += directed ? fmt::format("; {} neighbours that agreed no longer do", check.violations)
                                 : ", for which the sign rule has no reason";
    report.checks.push_back(check);
}

/// What the shell takes in memory: its arrays, and 16 bytes for the counts of every eight masks.
std::uint64_t memory_of(const shell::ShellData& data) {
    const auto bytes = [](const auto& array) { return array.size() * sizeof(array[0]); };
    std::uint64_t sum = bytes(data.surface.lower) + bytes(data.surface.upper) +
                        bytes(data.surface.lists.offset) + bytes(data.surface.lists.bytes) +
                        bytes(data.sides.winding) + bytes(data.surface.corners_inside);
    for (std::size_t k = 0; k < data.octree.levels.size(); ++k) {
        const octree::Level& level = data.octree.levels[k];
        sum += bytes(level.parent) + bytes(level.mask) + 16 * (level.mask.size() / 8 + 1) +
               bytes(data.sides.inside[k]) + bytes(data.field.values[k]);
        if (!level.leaf.empty()) sum += bytes(level.leaf) + 16 * (level.leaf.size() / 8 + 1);
    }
    return sum;
}

/// γ must bound the error of the shipped evaluation at a point of M as a caller gives it: the point is off by
/// four roundings of its largest coordinate and its lattice coordinates by two of the root's side, for f's
/// slopes along three axes; interpolation adds 15 roundings of the largest value. In cell widths.
double least_rounding(const View& view) {
    double slope = 0, value = 0;
    for (int k = 0; k < view.surface_levels(); ++k)
        for (std::size_t i = 0; i < view.data().octree.levels[std::size_t(k)].parent.size(); ++i)
            for (int child = 0; child < 8; ++child) {
                if ((view.surface_bits(k, i) >> child & 1) == 0) continue;
                double v[8];
                for (int c = 0; c < 8; ++c) {
                    v[c] = view.data().field.values[std::size_t(k)]
                                                   [points_of_group * i + std::uint64_t(group_point(child, c))];
                    value = std::max(value, std::abs(v[c]));
                }
                for (const double s : slopes(v)) slope = std::max(slope, std::ldexp(s, -k));
            }
    const Lattice& lattice = view.lattice();
    const double displaced = 4 * roundoff * lattice.reach() + 2 * lattice.ulp();
    return 3 * slope * displaced + 15 * roundoff * value;
}

std::string judge_numbers(const Job& job) {
    const shell::ShellData& data = job.view.data();
    const ShellInfo& info = data.info;
    if (info.mesh_triangles != job.mesh.triangles.size() || info.mesh_vertices != job.boundary.vertices)
        return fmt::format("the mesh has {} triangles over {} positions, not {} over {}",
                           job.mesh.triangles.size(), job.boundary.vertices, info.mesh_triangles,
                           info.mesh_vertices);
    if (info.mesh_closed != (!job.boundary.single_edges || job.boundary.odd_edges.empty()))
        return info.mesh_closed
                   ? "the mesh is not closed: an edge has one triangle, and others do not cancel it"
                   : "the mesh is closed: no edge has one triangle, or others cancel it";
    if (info.sign == SignRule::winding && !job.boundary.edges.empty())
        return fmt::format("{} edges of the mesh do not cancel, so that it has no winding numbers",
                           job.boundary.edges.size());
    if (info.sign == SignRule::even_odd && !job.boundary.odd_edges.empty())
        return fmt::format("{} edges of the mesh have an odd number of triangles, so that it has no inside",
                           job.boundary.odd_edges.size());
    if (data.grid_points != 0 && data.grid_points != job.arrays.grid_points)
        return fmt::format("there are {} grid points, not {}", job.arrays.grid_points, data.grid_points);
    if (info.memory_bytes != memory_of(data))
        return fmt::format("the shell takes {} bytes, not {}", memory_of(data), info.memory_bytes);
    const double least = least_rounding(job.view) * job.width();
    if (!(info.rounding >= least))
        return fmt::format("γ = {:.3g} does not bound the rounding of f, which may be {:.3g}", info.rounding,
                           least);
    return {};
}

void check_numbers(const Job& job, VerifyReport& report) {
    const std::string wrong = judge_numbers(job);
    VerifyCheck check{"description", wrong.empty(), true, 8, std::uint64_t(!wrong.empty()), 0, wrong};
    if (wrong.empty())
        check.detail = "sizes of mesh and shell, whether the mesh is closed and has such an inside, γ";
    report.checks.push_back(check);
}

/// What identifies mesh and options: docs/design/build.md. A rule that is left to the builder counts as such.
std::array<std::uint64_t, 2> hash_of(const Job& job, bool chose_sign, bool turned_parts) {
    const ShellInfo& info = job.view.data().info;
    constexpr std::uint64_t chosen = ~std::uint64_t{0};
    const std::uint64_t numbers[] = {info.thickness_asked > 0 ? chosen : std::uint64_t(info.depth),
                                     chose_sign ? chosen : std::uint64_t(info.sign),
                                     std::uint64_t(turned_parts),
                                     std::uint64_t(info.extrema),
                                     std::uint64_t(info.solver),
                                     std::bit_cast<std::uint64_t>(info.weld),
                                     std::bit_cast<std::uint64_t>(info.thickness_asked),
                                     info.max_cells,
                                     info.deepest < 0 ? chosen : std::uint64_t(info.deepest),
                                     job.mesh.vertices.size(),
                                     job.mesh.triangles.size()};
    const std::unique_ptr<XXH3_state_t, decltype(&XXH3_freeState)> state(XXH3_createState(), XXH3_freeState);
    if (!state) throw std::bad_alloc();
    XXH3_128bits_reset(state.get());
    const auto add = [&](const auto& array) {
        XXH3_128bits_update(state.get(), std::data(array), std::size(array) * sizeof(*std::data(array)));
    };
    add(ITS_VERSION);
    add(numbers);
    if (info.up != UpAxis::unknown) add(std::array{info.up});
    add(job.mesh.vertices);
    add(job.given.triangles);
    const XXH128_hash_t hash = XXH3_128bits_digest(state.get());
    return {hash.low64, hash.high64};
}

/// The hash tells which mesh and options the shell is of, in this version of the library. A shell of another
/// version cannot be recognised, so only a complete check insists.
void check_hash(const Job& job, VerifyReport& report) {
    const std::array<std::uint64_t, 2>& stored = job.view.data().info.input_hash;
    VerifyCheck check{"input hash", true, true, 1, 0, 0, "not known"};
    if (stored != std::array<std::uint64_t, 2>{}) {
        bool found = false;
        for (int choice = 0; choice < 4 && !found; ++choice) {
            found = hash_of(job, (choice & 1) != 0, (choice & 2) != 0) == stored;
            if (found)
                check.detail = fmt::format(
                    "that of this mesh, depth or thickness, solver and bounds, the rule {}{}",
                    choice & 1 ? "chosen" : "given", choice & 2 ? ", parts turned around by nesting" : "");
        }
        if (!found) {
            check.passed = !job.options.complete;
            check.violations = 1;
            check.complete = job.options.complete;
            check.detail = fmt::format(
                "not that of this mesh with the shell's depth or thickness, rule, bounds and "
                "solver in version {}; another version may have made it",
                ITS_VERSION);
        }
    }
    report.checks.push_back(check);
}

}  // namespace

void check_description(const Job& job, VerifyReport& report) {
    check_copy(job, report);
    check_numbers(job, report);
    check_hash(job, report);
}

}  // namespace its::verifier
