#include "distance/packet.h"

#include <cmath>

#include "base/platform/compiler.h"

namespace its::distance {

namespace {

ITS_INLINE double larger(double a, double b) {
    return a < b ? b : a;
}
ITS_INLINE double smaller(double a, double b) {
    return b < a ? b : a;
}

/// The largest of eight numbers, without a chain of dependent comparisons.
ITS_INLINE double largest(const double* v) {
    double half[4], quarter[2];
    for (int i = 0; i < 4; ++i) half[i] = larger(v[i], v[i + 4]);
    for (int i = 0; i < 2; ++i) quarter[i] = larger(half[i], half[i + 2]);
    return larger(quarter[0], quarter[1]);
}

/// Improves eight points of the packet by one triangle.
ITS_INLINE void improve(Packet& packet, int chunk, const TriangleBlock& t, std::uint64_t lane,
                        std::uint64_t id) {
    for (int i = chunk; i < chunk + lanes; ++i) {
        const double d = squared_distance(t, lane, packet.x[i], packet.y[i], packet.z[i]);
        packet.nearest[i] = d < packet.squared[i] ? id : packet.nearest[i];
        packet.squared[i] = smaller(packet.squared[i], d);
    }
}

/// A node to visit, with a lower bound on its squared distance.
struct Visit {
    double squared;
    std::uint32_t level, index;
};

constexpr int tree_levels = 12;  // 8¹¹ > 2³² triangles
/// Visits waiting: eight, and seven more for each level.
struct Visits {
    Visit visit[lanes * (tree_levels + 1)];
    int size = 0;

    /// Adds a visit above `base`, where the squared distances stay descending.
    ITS_INLINE void insert(int base, const Visit& v) {
        int at = size++;
        for (; at > base && visit[at - 1].squared < v.squared; --at) visit[at] = visit[at - 1];
        visit[at] = v;
    }
};

/// Improves one point of the packet by the eight triangles of a block.
ITS_INLINE void improve_point(Packet& packet, int p, const TriangleBlock& block, std::uint32_t index) {
    const double x = packet.x[p], y = packet.y[p], z = packet.z[p];
    double squared[lanes], negated[lanes];
    for (int i = 0; i < lanes; ++i) squared[i] = squared_distance(block, std::uint64_t(i), x, y, z);
    for (int i = 0; i < lanes; ++i) negated[i] = -squared[i];
    const double best = -largest(negated);
    if (!(best < packet.squared[p])) return;
    packet.squared[p] = best;
    for (std::uint64_t i = 0; i < lanes; ++i)
        if (squared[i] == best) packet.nearest[p] = std::uint64_t{index} * lanes + i;
}

}  // namespace

ITS_CLONES void triangle_distances(const Points& p, const TriangleBlock& t, std::uint64_t lane,
                                   double* distance) {
    for (int i = 0; i < lanes; ++i) distance[i] = std::sqrt(squared_distance(t, lane, p.x[i], p.y[i], p.z[i]));
}

ITS_CLONES void node_distances(const Points& p, const TriangleTree::Nodes& n, std::uint64_t lane,
                               double* distance) {
    for (int i = 0; i < lanes; ++i) distance[i] = std::sqrt(squared_gap(n, lane, p.x[i], p.y[i], p.z[i]));
}

ITS_CLONES void block_distances(const TriangleBlock& t, double x, double y, double z, double* distance) {
    for (std::uint64_t i = 0; i < lanes; ++i) distance[i] = std::sqrt(squared_distance(t, i, x, y, z));
}

ITS_CLONES void nodes_distances(const TriangleTree::Nodes& n, double x, double y, double z, double* distance) {
    for (std::uint64_t i = 0; i < lanes; ++i) distance[i] = std::sqrt(squared_gap(n, i, x, y, z));
}

ITS_CLONES void improve_all(Packet& packet, const TriangleBlock& t, std::uint64_t lane, std::uint64_t id) {
    for (int chunk = 0; chunk < packet.count; chunk += lanes) improve(packet, chunk, t, lane, id);
}

ITS_CLONES void improve_near(Packet& packet, const TriangleBlock& t, std::uint64_t lane, std::uint64_t id,
                             double from_centre) {
    for (int chunk = 0; chunk < packet.count; chunk += lanes) {
        double excess[lanes];  // of what is known over a lower bound; both squared
        for (int i = 0; i < lanes; ++i) {
            const double least = larger(from_centre - packet.from_centre[chunk + i], 0.0);
            excess[i] = packet.squared[chunk + i] - least * least;
        }
        if (largest(excess) > 0) improve(packet, chunk, t, lane, id);
    }
}

ITS_CLONES double reach(const Packet& packet) {
    double far[lanes] = {};
    for (int chunk = 0; chunk < packet.count; chunk += lanes)
        for (int i = 0; i < lanes; ++i)
            far[i] = larger(far[i], std::sqrt(packet.squared[chunk + i]) + packet.from_centre[chunk + i]);
    return largest(far);
}

ITS_CLONES void search(const TriangleTree& tree, const Entries& entries, Packet& packet, int p) {
    const double x = packet.x[p], y = packet.y[p], z = packet.z[p];
    double squared[lanes];
    Visits visits;
    for (std::uint64_t block = 0; block < entries.blocks(); ++block) {
        for (int i = 0; i < lanes; ++i)
            squared[i] = squared_gap(entries.nodes[block], std::uint64_t(i), x, y, z);
        const std::uint64_t first = block * lanes,
                            count = std::min<std::uint64_t>(lanes, entries.id.size() - first);
        for (std::uint64_t i = 0; i < count; ++i)
            if (squared[i] < packet.squared[p])
                visits.insert(0, {squared[i], entries.id[first + i][0], entries.id[first + i][1]});
        while (visits.size > 0) {
            const Visit v = visits.visit[--visits.size];
            if (!(v.squared < packet.squared[p])) continue;
            if (v.level == 1) {
                improve_point(packet, p, tree.block[v.index], v.index);
                continue;
            }
            const TriangleTree::Nodes& below = tree.levels[v.level - 2][v.index];
            for (int i = 0; i < lanes; ++i) squared[i] = squared_gap(below, std::uint64_t(i), x, y, z);
            const int base = visits.size;
            for (std::uint32_t i = 0; i < lanes; ++i)
                if (squared[i] < packet.squared[p])
                    visits.insert(base, {squared[i], v.level - 1, lanes * v.index + i});
        }
    }
}

}  // namespace its::distance
