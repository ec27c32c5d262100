#pragma once

#include <array>
#include <cstdint>
#include <limits>
#include <vector>

#include "distance/triangle_tree.h"

/// Distances from a few points that are close together: what is common to all of them is done once.
namespace its::distance {

inline constexpr int lanes = 8;
inline constexpr int padded_points = 32;  // 27 points, the last one repeated
inline constexpr double open_factor =
    3;  // nodes with more than this many half cubes of radius are opened; measured
inline constexpr double infinity = std::numeric_limits<double>::infinity();

struct alignas(64) Points {
    double x[lanes], y[lanes], z[lanes];
};

/// The points that are to be solved; the last one is repeated to fill up whole lanes.
struct alignas(64) Packet {
    double x[padded_points], y[padded_points], z[padded_points];
    double from_centre[padded_points];     ///< distance to the centre of their cube, rounded up
    double squared[padded_points];         ///< smallest computed squared distance so far
    std::uint64_t nearest[padded_points];  ///< the triangle that has it
    int point[padded_points];              ///< number by which they are known
    int count;
};

/// distance[i] = from point i to triangle `lane` of the block.
void triangle_distances(const Points& p, const TriangleBlock& t, std::uint64_t lane, double* distance);

/// distance[i] = lower bound on the distance from point i to what is in the node.
void node_distances(const Points& p, const TriangleTree::Nodes& n, std::uint64_t lane, double* distance);

/// distance[i] = from one point to triangle i of the block, and to what is in node i.
void block_distances(const TriangleBlock& t, double x, double y, double z, double* distance);
void nodes_distances(const TriangleTree::Nodes& n, double x, double y, double z, double* distance);

/// Improves all points of the packet by a triangle.
void improve_all(Packet& packet, const TriangleBlock& t, std::uint64_t lane, std::uint64_t id);

/// The same, where the triangle can be nearer than what is known, by its distance to the centre less some
/// slack.
void improve_near(Packet& packet, const TriangleBlock& t, std::uint64_t lane, std::uint64_t id,
                  double from_centre);

/// How far from the centre anything can be that is nearer to a point of the packet than what is known.
double reach(const Packet& packet);

/// Nodes to search from, gathered.
struct Entries {
    std::vector<TriangleTree::Nodes> nodes;
    std::vector<std::array<std::uint32_t, 2>> id;  ///< level and index

    void clear() { id.clear(); }
    std::uint64_t blocks() const { return (id.size() + lanes - 1) / lanes; }
    void add(const TriangleTree::Nodes& from, std::uint32_t level, std::uint32_t index) {
        const std::uint64_t block = id.size() / lanes, to = id.size() % lanes, lane = index % lanes;
        if (block == nodes.size()) nodes.emplace_back();
        TriangleTree::Nodes& n = nodes[block];
        n.x[to] = from.x[lane];
        n.y[to] = from.y[lane];
        n.z[to] = from.z[lane];
        n.axis_x[to] = from.axis_x[lane];
        n.axis_y[to] = from.axis_y[lane];
        n.axis_z[to] = from.axis_z[lane];
        n.radius[to] = from.radius[lane];
        n.thickness[to] = from.thickness[lane];
        id.push_back({level, index});
    }
};

/// Improves one point of the packet by all that is below the entries: depth first, nearest child first.
void search(const TriangleTree& tree, const Entries& entries, Packet& packet, int p);

}  // namespace its::distance
