#include "verify/columns.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "base/parallel.h"
#include "geometry/vec3.h"
#include "verify/exact.h"
#include "verify/polygon.h"

namespace its::verifier {
namespace {

constexpr std::uint64_t triangle_grain = 64, row_grain = 16;

/// Whole numbers in [low, high], within the lattice.
std::pair<std::int64_t, std::int64_t> whole_between(double low, double high, std::int64_t last) {
    return {std::max<std::int64_t>(std::int64_t(std::ceil(low)), 0),
            std::min<std::int64_t>(std::int64_t(std::floor(high)), last)};
}

/// A triangle and its plane, both as it is given and in lattice units.
struct Facet {
    Vec3 a, b, c;  ///< as given, for exact signs
    Polygon flat;  ///< in lattice units, for guesses
    Vec3 normal;   ///< likewise
    int up = 0;    ///< sign of the normal's z, exact
};

/// The first lattice point of the line (x, y) that is above the facet. A guess is tried first.
std::int64_t first_above(const Facet& f, const Lattice& lattice, std::int64_t x, std::int64_t y) {
    const Vec3* v = f.flat.vertex;
    // Vertices in lattice units err by far less than one.
    std::int64_t below = std::int64_t(std::floor(std::min({v[0].z, v[1].z, v[2].z}))) - 1;
    std::int64_t above = std::int64_t(std::ceil(std::max({v[0].z, v[1].z, v[2].z}))) + 1;
    const auto narrow = [&](std::int64_t z) {
        if (z <= below || z >= above) return;
        (displaced_above(f.a, f.b, f.c, f.up, lattice.position({x, y, z})) ? above : below) = z;
    };
    const double guess =
        v[0].z - (f.normal.x * (double(x) - v[0].x) + f.normal.y * (double(y) - v[0].y)) / f.normal.z;
    if (guess > double(below) && guess < double(above)) {
        narrow(std::int64_t(std::floor(guess)));
        narrow(std::int64_t(std::floor(guess)) + 1);
    }
    while (above - below > 1) narrow(below + (above - below) / 2);
    return above;
}

}  // namespace

Columns::Columns(const Mesh& mesh, const Lattice& lattice, const Progress& progress) : lattice_(lattice) {
    const std::uint64_t triangles = mesh.triangles.size();
    Stage stage(progress, "verify: crossings", triangles);
    std::vector<std::vector<Drawn>> drawn(chunk_count(triangles, triangle_grain));
    for_chunks(triangles, triangle_grain, [&](std::uint64_t chunk, std::uint64_t begin, std::uint64_t end) {
        for (std::uint64_t t = begin; t < end; ++t) draw(mesh, mesh.triangles[t], drawn[chunk]);
        stage.advance(end - begin);
    });
    gather(drawn);
}

void Columns::draw(const Mesh& mesh, const Triangle& t, std::vector<Drawn>& out) const {
    Facet f{mesh.vertices[t[0]], mesh.vertices[t[1]], mesh.vertices[t[2]], {}, {}, 0};
    f.up = turn_sign(f.a, f.b, f.c, 0, 1);
    if (f.up == 0) return;  // parallel to the lines: none is crossed
    f.flat.count = 3;
    const Vec3* corners[3] = {&f.a, &f.b, &f.c};
    for (int i = 0; i < 3; ++i) f.flat.vertex[i] = lattice_.to_lattice(*corners[i]);
    const Vec3* v = f.flat.vertex;
    f.normal = cross(v[1] - v[0], v[2] - v[0]);
    // What clipping and the conversion may lose (docs/design/verify.md) is far below this margin.
    const double margin = 64 * lattice_.ulp();
    const std::int64_t last = lattice_.cells();
    const auto rows = whole_between(std::min({v[0].y, v[1].y, v[2].y}) - margin,
                                    std::max({v[0].y, v[1].y, v[2].y}) + margin, last);
    for (std::int64_t y = rows.first; y <= rows.second; ++y) {
        Polygon strip;
        if (!clip_slab(f.flat, 1, double(y) - margin, double(y) + margin, strip)) continue;
        double low = strip.vertex[0].x, high = low;
        for (int i = 1; i < strip.count; ++i) {
            low = std::min(low, strip.vertex[i].x);
            high = std::max(high, strip.vertex[i].x);
        }
        const auto columns = whole_between(low - margin, high + margin, last);
        for (std::int64_t x = columns.first; x <= columns.second; ++x) {
            const Vec3 p = lattice_.position({x, y, 0});
            if (displaced_turn(f.a, f.b, p) != f.up || displaced_turn(f.b, f.c, p) != f.up ||
                displaced_turn(f.c, f.a, p) != f.up)
                continue;
            const std::int64_t z = first_above(f, lattice_, x, y);
            out.push_back({std::uint32_t(y), {std::uint32_t(x), std::int32_t(z), f.up}});
        }
    }
}

void Columns::gather(const std::vector<std::vector<Drawn>>& drawn) {
    row_.assign(std::size_t(lattice_.cells()) + 2, 0);
    for (const auto& part : drawn)
        for (const Drawn& d : part) ++row_[d.row + 1];
    for (std::size_t i = 1; i < row_.size(); ++i) row_[i] += row_[i - 1];
    events_.resize(row_.back());
    std::vector<std::uint64_t> next(row_.begin(), row_.end() - 1);
    for (const auto& part : drawn)
        for (const Drawn& d : part) events_[next[d.row]++] = d.event;
    parallel_for(row_.size() - 1, row_grain, [&](std::uint64_t row) {
        const auto begin = events_.begin() + std::ptrdiff_t(row_[row]),
                   end = events_.begin() + std::ptrdiff_t(row_[row + 1]);
        std::sort(begin, end,
                  [](const Event& a, const Event& b) { return std::pair(a.x, a.z) < std::pair(b.x, b.z); });
        for (auto it = end; it != begin;) {
            --it;
            if (it + 1 != end && (it + 1)->x == it->x) it->sum += (it + 1)->sum;
        }
    });
}

std::int32_t Columns::above(std::int64_t x, std::int64_t y, std::int64_t z) const {
    const auto end = events_.begin() + std::ptrdiff_t(row_[std::size_t(y) + 1]);
    const auto it = std::upper_bound(
        events_.begin() + std::ptrdiff_t(row_[std::size_t(y)]), end, std::pair(x, z),
        [](const auto& at, const Event& e) { return at < std::pair(std::int64_t(e.x), std::int64_t(e.z)); });
    return it != end && it->x == x ? it->sum : 0;
}

}  // namespace its::verifier
