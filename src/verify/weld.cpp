#include "verify/weld.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <map>
#include <numeric>
#include <tuple>
#include <vector>

#include "geometry/vec3.h"

namespace its::verifier {
namespace {

/// Boxes a third and a half of the length wide: points of one are nearer than the length, whatever the rounding
/// of their numbers, and points that are nearer than it are at most three boxes apart.
constexpr double boxes_per_length = 2.5;
constexpr int reach = 3;

class Joined {
public:
    explicit Joined(std::size_t count) : to_(count) { std::iota(to_.begin(), to_.end(), std::uint32_t{0}); }
    std::uint32_t first(std::uint32_t i) const {
        while (to_[i] != i) i = to_[i];
        return i;
    }
    void join(std::uint32_t i, std::uint32_t j) {
        const std::uint32_t a = first(i), b = first(j), low = std::min(a, b);
        for (std::uint32_t v : {i, j})
            while (to_[v] != low) {
                const std::uint32_t next = to_[v];
                to_[v] = low;
                v = next;
            }
    }

private:
    std::vector<std::uint32_t> to_;
};

}  // namespace

Mesh welded(const Mesh& mesh, double length) {
    using Box = std::tuple<double, double, double>;
    std::vector<bool> used(mesh.vertices.size());
    for (const Triangle& t : mesh.triangles)
        for (const std::uint32_t v : t) used[v] = true;
    Joined joined(mesh.vertices.size());
    std::map<Box, std::vector<std::uint32_t>> boxes;
    const auto number = [&](double x) { return std::floor(x / length * boxes_per_length); };
    for (std::uint32_t v = 0; v < mesh.vertices.size(); ++v) {
        if (!used[v]) continue;
        const Vec3& p = mesh.vertices[v];
        auto& members = boxes[{number(p.x), number(p.y), number(p.z)}];
        members.push_back(v);
        joined.join(members.front(), v);
    }
    const auto touch = [&](const std::vector<std::uint32_t>& some, const std::vector<std::uint32_t>& others) {
        for (const std::uint32_t a : some)
            for (const std::uint32_t b : others)
                if (norm(mesh.vertices[a] - mesh.vertices[b]) < length) return true;
        return false;
    };
    // Near boxes first, so that those further away are mostly joined when their turn comes.
    for (int far = 1; far <= reach; ++far)
        for (const auto& [box, members] : boxes) {
            const auto [x, y, z] = box;
            for (int i = -far; i <= far; ++i)
                for (int j = -far; j <= far; ++j)
                    for (int k = -far; k <= far; ++k) {
                        if (std::max({std::abs(i), std::abs(j), std::abs(k)}) != far) continue;
                        const auto other = boxes.find({x + i, y + j, z + k});
                        if (other == boxes.end()) continue;
                        const std::uint32_t a = members.front(), b = other->second.front();
                        if (joined.first(a) != joined.first(b) && touch(members, other->second))
                            joined.join(a, b);
                    }
        }
    // Vertices at one position are one point: it moves only if a vertex elsewhere joins it.
    std::vector<bool> moved(mesh.vertices.size());
    for (std::uint32_t v = 0; v < used.size(); ++v)
        if (used[v] && !(mesh.vertices[v] == mesh.vertices[joined.first(v)])) moved[joined.first(v)] = true;
    Mesh out = mesh;
    for (Triangle& t : out.triangles)
        for (std::uint32_t& v : t)
            if (moved[joined.first(v)]) v = joined.first(v);
    return out;
}

}  // namespace its::verifier
