#include "surface/patch.h"

#include "geometry/trilinear.h"

namespace its::surface {

namespace {

/// A face: its corners counter-clockwise seen from outside, and the edge from each to the next.
struct Face {
    std::uint8_t corner[4], edge[4];
};

struct Faces {
    Face face[6];  // 2·axis + side
    /// Corners 0, 1, 2, 3 = u + 2v along axis + 1 and axis + 2: the same order for both cells of a face.
    std::uint8_t square[6][4];

    constexpr Faces() : face{}, square{} {
        for (int f = 0; f < 6; ++f) {
            const int axis = f / 2, side = f % 2, u = 1 << (axis + 1) % 3, v = 1 << (axis + 2) % 3;
            const int base = side << axis;
            const int round[2][4] = {{base, base | v, base | u | v, base | u},
                                     {base, base | u, base | u | v, base | v}};
            for (int i = 0; i < 4; ++i) face[f].corner[i] = std::uint8_t(round[side][i]);
            for (int i = 0; i < 4; ++i)
                face[f].edge[i] = edge_between(round[side][i], round[side][(i + 1) % 4]);
            for (int i = 0; i < 4; ++i) square[f][i] = std::uint8_t(base | (i & 1 ? u : 0) | (i & 2 ? v : 0));
        }
    }

    static constexpr std::uint8_t edge_between(int a, int b) {
        for (int edge = 0; edge < 12; ++edge)
            if ((edge_start(edge) == a && edge_end(edge) == b) ||
                (edge_start(edge) == b && edge_end(edge) == a))
                return std::uint8_t(edge);
        return 255;
    }
};
constexpr Faces faces;

unsigned corners_in(const Face& face, unsigned set) {
    unsigned in = 0;
    for (int i = 0; i < 4; ++i) in |= (set >> face.corner[i] & 1) << i;
    return in;
}

constexpr bool diagonal(unsigned in) {
    return in == 0b0101 || in == 0b1010;
}

/// The loops of a case without ambiguous faces: each face has at most one segment, which leaves the face's part
/// above on its left where it goes from the edge that enters the part below to the edge that leaves it.
Loops trace(unsigned below) {
    Loops loops;
    int next[12];
    for (int& n : next) n = -1;
    for (const Face& face : faces.face) {
        const unsigned in = corners_in(face, below);
        if (diagonal(in)) {
            loops.ambiguous = true;
            return loops;
        }
        int enters = -1, leaves = -1;
        for (int i = 0; i < 4; ++i) {
            const bool here = in >> i & 1, there = in >> (i + 1) % 4 & 1;
            if (!here && there) enters = face.edge[i];
            if (here && !there) leaves = face.edge[i];
        }
        if (enters >= 0) next[enters] = leaves;
    }
    for (int start = 0; start < 12; ++start) {
        if (next[start] < 0) continue;
        Loop& loop = loops.loop[loops.count++];
        for (int edge = start; next[edge] >= 0;) {
            loop.edge[loop.size++] = std::uint8_t(edge);
            const int following = next[edge];
            next[edge] = -1;
            edge = following;
        }
    }
    return loops;
}

struct AllLoops {
    std::array<Loops, 256> of;
    AllLoops() {
        for (unsigned below = 0; below < 256; ++below) of[below] = trace(below);
    }
};
const AllLoops all_loops;

}  // namespace

const Loops& loops_of(unsigned below) {
    return all_loops.of[below];
}

Crossing make_crossing(const std::array<double, 8>& value) {
    Crossing crossing;
    for (unsigned c = 0; c < 8; ++c) crossing.below |= unsigned(value[c] < 0) << c;
    crossing.star = loops_of(crossing.below).ambiguous;
    if (!crossing.star) return crossing;
    for (unsigned f = 0; f < 6; ++f) {
        const auto& corner = faces.square[f];
        // The level at the saddle of the bilinear function is (v0·v3 − v1·v2)/(v0 + v3 − v1 − v2). The diagonal
        // of corners 0 and 3 is on one side, whose sign is that of the divisor.
        const double products = value[corner[0]] * value[corner[3]] - value[corner[1]] * value[corner[2]];
        crossing.joined |= unsigned(products > 0) << f;
    }
    crossing.centre_below = geometry::trilinear(value.data(), {0.5, 0.5, 0.5}) < 0;
    return crossing;
}

void add_fan(const Loop& loop, int apex, Patch& patch) {
    const int n = loop.size;
    const auto at = [&](int i) { return int(loop.edge[std::size_t((apex + i) % n)]); };
    for (int i = 2; i < n; ++i) patch.add(at(0), at(i - 1), at(i));
}

namespace {

/// The part of a face on the side of `corners` (bits of the face's corners), with each corner moved towards the
/// cell's centre. No triangle has two sides or a diagonal in the face: each has at most one, which is a loop's.
struct FacePart {
    const Face& face;
    bool flip;
    Patch& patch;

    int inner(int i) const { return first_inner + face.corner[i & 3]; }
    int edge(int i) const { return face.edge[i & 3]; }
    void add(int a, int b, int c) { flip ? patch.add(a, c, b) : patch.add(a, b, c); }

    void corner(int i) { add(edge(i + 3), inner(i), edge(i)); }
    void two(int i) {
        add(inner(i), inner(i + 1), edge(i + 1));
        add(inner(i), edge(i + 1), edge(i + 3));
    }
    void three(int i) {  // i, i + 1, i + 2
        add(inner(i + 1), inner(i + 2), edge(i + 2));
        add(inner(i + 1), edge(i + 2), edge(i + 3));
        add(inner(i + 1), edge(i + 3), inner(i));
    }
    void all() {
        add(inner(0), inner(1), inner(2));
        add(inner(0), inner(2), inner(3));
    }
    void joined(int i) {  // i and i + 2
        add(inner(i), edge(i), edge(i + 1));
        add(inner(i), edge(i + 1), inner(i + 2));
        add(inner(i), inner(i + 2), edge(i + 2));
        add(inner(i), edge(i + 2), edge(i + 3));
    }
};

}  // namespace

void add_star(const Crossing& crossing, Patch& patch) {
    const unsigned corners = crossing.inner();
    for (unsigned f = 0; f < 6; ++f) {
        const Face& face = faces.face[f];
        const unsigned in = corners_in(face, corners);
        // Seen from outside the faces are counter-clockwise; the patch is to be so seen from above.
        FacePart part{face, !crossing.centre_below, patch};
        if (diagonal(in)) {
            const int first = in == 0b0101 ? 0 : 1;
            // Corner 0 of the round is corner 0 of the square, and corner 2 is its corner 3.
            const bool together = (crossing.joined >> f & 1) == (first == 0);
            if (together) {
                part.joined(first);
            } else {
                part.corner(first);
                part.corner(first + 2);
            }
            continue;
        }
        for (int i = 0; i < 4; ++i) {
            const bool previous = in >> ((i + 3) & 3) & 1, here = in >> i & 1;
            if (previous || !here) continue;
            const bool second = in >> ((i + 1) & 3) & 1, third = in >> ((i + 2) & 3) & 1;
            third ? part.three(i) : second ? part.two(i) : part.corner(i);
        }
        if (in == 0b1111) part.all();
    }
}

}  // namespace its::surface
