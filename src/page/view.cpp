#include "its/memory.h"
#include "its/page.h"

#include <fmt/format.h>
#include <zlib.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <nlohmann/json.hpp>
#include <span>
#include <string_view>
#include <vector>

#include "base/output_file.h"
#include "base/parallel.h"
#include "base/progress.h"
#include "display/colour.h"
#include "display/numbers.h"
#include "geometry/vec3.h"
#include "its/inspect.h"
#include "its/surface.h"
#include "octree/lattice.h"
#include "page/cluster.h"
#include "page/page.h"
#include "shell/shell_data.h"

namespace its {
using namespace page;

namespace {

using Json = nlohmann::ordered_json;

constexpr std::string_view data_mark = "__ITS_DATA__";

constexpr double position_step = 0x1p-19;  // of s: what positions are rounded to
constexpr double field_step = 0x1p-18;  // of s: what f is rounded to; half of what the page's texture can tell
constexpr double surround = 0.09;       // of s, shown around the mesh
constexpr int default_resolution = 128;
constexpr int palette_half = 128;

void check(const ViewOptions& o) {
    if (o.up < 0 || o.up > 2) throw OptionError(fmt::format("upward axis {}: must be 0, 1 or 2", o.up));
    if (o.resolution < 0 || o.resolution > 65536)
        throw OptionError(fmt::format("resolution {}: must be 0 to 65536", o.resolution));
    if (o.field_samples < 16 || o.field_samples > 256)
        throw OptionError(fmt::format("{} samples of the field: must be 16 to 256", o.field_samples));
    if (o.max_triangles < 1000)
        throw OptionError(fmt::format("at most {} triangles: must be 1000 or more", o.max_triangles));
    require_threads(o.run.threads);
}

std::string base64(std::span<const unsigned char> bytes) {
    constexpr std::string_view digits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    std::string text;
    text.reserve((bytes.size() + 2) / 3 * 4);
    for (std::size_t i = 0; i < bytes.size(); i += 3) {
        const std::size_t left = std::min<std::size_t>(3, bytes.size() - i);
        std::uint32_t group = 0;
        for (std::size_t k = 0; k < 3; ++k) group = group << 8 | (k < left ? bytes[i + k] : 0u);
        for (std::size_t k = 0; k < 4; ++k) text += k <= left ? digits[group >> (18 - 6 * k) & 63] : '=';
    }
    return text;
}

std::string deflated(const std::vector<unsigned char>& bytes) {
    uLongf size = compressBound(uLong(bytes.size()));
    std::vector<unsigned char> packed(size);
    if (compress2(packed.data(), &size, bytes.data(), uLong(bytes.size()), 6) != Z_OK)
        throw MemoryError("not enough memory to pack the page's data");
    return base64(std::span(packed).first(size));
}

/// Whole numbers, as web/src/data.js reads them: each the difference to the one `stride` before it, zigzag (the
/// sign in the lowest bit), the four bytes of all in four runs; neighbours differ little, so most bytes are 0.
std::string encode(const std::vector<std::int32_t>& values, std::size_t stride) {
    std::vector<unsigned char> bytes(4 * values.size());
    for (std::size_t i = 0; i < values.size(); ++i) {
        const std::uint32_t before = i >= stride ? std::uint32_t(values[i - stride]) : 0;
        const std::uint32_t difference = std::uint32_t(values[i]) - before;
        const std::uint32_t zigzag = difference << 1 ^ (difference >> 31 != 0 ? ~0u : 0u);
        for (std::size_t k = 0; k < 4; ++k) bytes[k * values.size() + i] = (zigzag >> 8 * k) & 255;
    }
    return deflated(bytes);
}

/// Positions relative to `centre`, in units of s.
Json body_json(const Mesh& mesh, const Vec3& centre, double scale, const std::string& text) {
    std::vector<std::int32_t> positions, indices;
    positions.reserve(3 * mesh.vertices.size());
    indices.reserve(3 * mesh.triangles.size());
    for (const Vec3& v : mesh.vertices)
        for (int axis = 0; axis < 3; ++axis)  // unused vertices may be anywhere
            positions.push_back(std::int32_t(
                std::lround(std::clamp((v[axis] - centre[axis]) / scale, -4.0, 4.0) / position_step)));
    for (const Triangle& t : mesh.triangles)
        for (const std::uint32_t v : t) indices.push_back(std::int32_t(v));
    return {{"text", text},
            {"step", position_step},
            {"positions", encode(positions, 3)},
            {"indices", encode(indices, 3)}};
}

/// f ÷ s at samples of a box around the mesh, x fastest.
Json field_json(const ThinShell& shell, const Box& box, int samples_of_longest) {
    const ShellInfo& info = shell.info();
    const Vec3 low = box.min - surround * info.scale * Vec3{1, 1, 1};
    const Vec3 high = box.max + surround * info.scale * Vec3{1, 1, 1};
    const Vec3 size = high - low;
    const double spacing = std::max({size.x, size.y, size.z}) / (samples_of_longest - 1);
    std::array<std::uint64_t, 3> n;
    for (int axis = 0; axis < 3; ++axis)
        n[axis] = std::max<std::uint64_t>(2, 1 + std::uint64_t(std::lround(size[axis] / spacing)));
    std::vector<std::int32_t> values(n[0] * n[1] * n[2]);
    parallel_for(n[1] * n[2], 16, [&](std::uint64_t row) {
        const auto at = [&](int axis, std::uint64_t i) {
            return std::lerp(low[axis], high[axis], double(i) / double(n[axis] - 1));
        };
        for (std::uint64_t x = 0; x < n[0]; ++x) {
            const double f = shell.value({at(0, x), at(1, row % n[1]), at(2, row / n[1])});
            values[row * n[0] + x] = std::int32_t(std::lround(f / info.scale / field_step));
        }
    });
    const Vec3 centre = 0.5 * (info.root.min + info.root.max);
    const auto relative = [&](const Vec3& v) {
        return Json::array({v.x / info.scale, v.y / info.scale, v.z / info.scale});
    };
    return {{"low", relative(low - centre)},
            {"size", relative(size)},
            {"samples", n},
            {"step", field_step},
            {"values", encode(values, 1)}};
}

std::string palette() {
    const display::DivergingMap colours;
    std::vector<unsigned char> bytes;
    for (int i = -palette_half; i <= palette_half; ++i)
        for (const std::uint8_t c : colours(double(i) / palette_half)) bytes.push_back(c);
    return base64(bytes);
}

Json facts(const ThinShell& shell) {
    const ShellInfo& info = shell.info();
    return Json::array({{"Depth K", fmt::format("{}", info.depth)},
                        {"Finest cell", display::number_text(info.cell_width)},
                        {"Sign rule", std::string(name(info.sign))},
                        {"Sides", "exact"},
                        {"ε₁", display::number_text(info.epsilon_inner)},
                        {"ε₂", display::number_text(info.epsilon_outer)},
                        {"Thickness", display::number_text(info.thickness())},
                        {"÷ longest side", display::number_text(info.thickness() / info.scale)},
                        {"Mesh triangles", display::count_text(info.mesh_triangles)},
                        {"Mesh", info.mesh_closed ? "closed" : "open"},
                        {"Surface cells", display::count_text(info.surface_cells)}});
}

/// A level set that has not too many triangles; adds a note if it was extracted on a coarser lattice.
Surface page_surface(const ThinShell& shell, SurfaceSide side, const ViewOptions& options, Json& notes,
                     Parts& parts) {
    const int own = 1 << shell.info().depth;
    int resolution = options.resolution > 0 ? options.resolution : std::min(own, default_resolution);
    Surface surface;
    for (;; resolution /= 2) {
        surface =
            extract_surface(shell, {.side = side,
                                    .resolution = resolution == own ? 0 : resolution,
                                    .max_memory = options.max_memory,
                                    .run = {.threads = options.run.threads, .progress = parts.next(0.4)}});
        if (surface.mesh.triangles.size() <= options.max_triangles || resolution < 2) break;
    }
    if (!surface.report.reason.empty())
        notes.push_back(fmt::format("{} surface: {}", name(side), surface.report.reason));
    if (resolution != own)
        notes.push_back(fmt::format(
            "The {} surface is extracted on {} cells along the longest side; the shell has {}.", name(side),
            display::count_text(std::uint64_t(resolution)), display::count_text(std::uint64_t(own))));
    return surface;
}

std::string level_text(const Surface& surface) {
    return fmt::format("f = {} · {} triangles{}", display::number_text(surface.report.level, 3),
                       display::count_text(surface.mesh.triangles.size()),
                       surface.report.certified ? ", certified" : "");
}

/// For each cell that a surface runs through: two surfaces, and what the page has of them.
constexpr double bytes_per_cell = 450, bytes_per_triangle = 50, base_bytes = 1e6;

void check_memory(const ThinShell& shell, const ViewOptions& options) {
    const ShellInfo& info = shell.info();
    const int own = 1 << info.depth;
    const double ratio =
        double(options.resolution > 0 ? options.resolution : std::min(own, default_resolution)) / own;
    const double bytes = base_bytes + bytes_per_cell * double(info.surface_cells) * ratio * ratio +
                         bytes_per_triangle * double(info.mesh_triangles);
    require_memory(std::uint64_t(std::min(bytes, 1e18)), options.max_memory, "the page",
                   "choose a smaller resolution of its surfaces");
}

Json page_data(const ThinShell& shell, const ViewOptions& options, const Progress& progress) {
    check_memory(shell, options);
    Parts parts(progress);
    const ShellInfo& info = shell.info();
    const Vec3 centre = 0.5 * (info.root.min + info.root.max);
    Json notes = Json::array();
    const Surface outer = page_surface(shell, SurfaceSide::outer, options, notes, parts);
    const Surface inner = page_surface(shell, SurfaceSide::inner, options, notes, parts);
    const Mesh mesh = cluster(shell.mesh(), options.max_triangles);
    const std::string triangles = display::count_text(shell.mesh().triangles.size()) + " triangles";
    const bool whole = mesh.triangles.size() == shell.mesh().triangles.size();
    if (!whole)
        notes.push_back(fmt::format("The mesh of {} is shown with {}, merged for display.", triangles,
                                    display::count_text(mesh.triangles.size())));
    const Json field = field_json(shell, octree::bounds(shell.mesh()), options.field_samples);
    notes.push_back(fmt::format("The plane shows f from {} × {} × {} samples.", field["samples"][0].get<int>(),
                                field["samples"][1].get<int>(), field["samples"][2].get<int>()));
    const auto body = [&](const Mesh& m, const std::string& text) {
        return m.triangles.empty() ? Json() : body_json(m, centre, info.scale, text);
    };
    return {{"title", options.title},
            {"up", options.up},
            {"centre", {centre.x, centre.y, centre.z}},
            {"scale", info.scale},
            {"epsilon_inner", info.epsilon_inner / info.scale},
            {"epsilon_outer", info.epsilon_outer / info.scale},
            {"has_inside", info.sign != SignRule::unsigned_rule},
            {"facts", facts(shell)},
            {"notes", notes},
            {"palette", palette()},
            {"outer", body(outer.mesh, level_text(outer))},
            {"mesh", body(mesh, whole ? triangles : "of " + triangles)},
            {"inner", body(inner.mesh, level_text(inner))},
            {"field", field}};
}

}  // namespace

std::string view_page(const ThinShell& shell, const ViewOptions& options) {
    check(options);
    return run_call(options.run, "page", [&](const Progress& progress) {
        std::string data =
            page_data(shell, options, progress).dump(-1, ' ', false, Json::error_handler_t::replace);
        // Within a script element, "</script" and "<!--" would end or change it; < is written as an escape.
        for (std::size_t at = data.find('<'); at != std::string::npos; at = data.find('<', at + 1))
            data.replace(at, 1, "\\u003c");
        const std::string_view page(reinterpret_cast<const char*>(view_template().data()),
                                    view_template().size());
        const std::size_t mark = page.find(data_mark);
        if (mark == std::string_view::npos) throw Error("the built-in page has no place for data; rebuild");
        std::string html(page.substr(0, mark));
        html += data;
        html += page.substr(mark + data_mark.size());
        return html;
    });
}

void write_view(const ThinShell& shell, const std::filesystem::path& path, const ViewOptions& options) {
    const std::string html = view_page(shell, options);
    OutputFile file(path);
    file.write(std::as_bytes(std::span(html)));
    file.commit();
}

}  // namespace its
