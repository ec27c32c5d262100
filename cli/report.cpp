#include "report.h"

#include <fmt/core.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <cstdio>
#include <cstdlib>

namespace its::cli {

namespace {

constexpr std::string_view gap = "...";

/// The first byte of a character of UTF-8, from `at` on.
std::size_t character_from(std::string_view text, std::size_t at) {
    while (at < text.size() && (static_cast<unsigned char>(text[at]) & 0xc0) == 0x80) ++at;
    return at;
}

/// Its beginning and end, where it has more bytes than `most`.
std::string shortened(std::string_view text, std::size_t begin, std::size_t most) {
    if (text.size() <= most) return std::string(text);
    while (begin > 0 && character_from(text, begin) != begin) --begin;
    const std::size_t end = character_from(text, text.size() - (most - begin - gap.size()));
    return fmt::format("{}{}{}", text.substr(0, begin), gap, text.substr(end));
}

}  // namespace

std::string message_line(std::string_view text) {
    constexpr std::size_t longest_word = 100, longest_line = 280, beginning = 140;
    std::string line;
    for (std::size_t at = 0; at < text.size();) {
        const std::size_t end = std::min(text.find(' ', at), text.size());
        line += shortened(text.substr(at, end - at), 0, longest_word);  // of a path the end says more
        if (end < text.size()) line += ' ';
        at = end + 1;
    }
    std::replace_if(
        line.begin(), line.end(), [](unsigned char c) { return std::iscntrl(c) != 0; }, ' ');
    return shortened(line, beginning, longest_line);
}

void print_message(std::string_view kind, std::string_view text) {
    fmt::print(stderr, "its: {}: {}\n", kind, message_line(text));
}

void print_json(const Json& json) {
    // File names need not be UTF-8, JSON must be.
    fmt::print("{}\n", json.dump(2, ' ', false, Json::error_handler_t::replace));
}

void Table::row(std::string label, std::string value) {
    rows_.emplace_back(std::move(label), std::move(value));
}

void Table::print() const {
    constexpr int label_width = 22;
    for (const auto& [label, value] : rows_) fmt::print("{:<{}}{}\n", label, label_width, value);
}

std::string count_text(std::uint64_t count) {
    std::string text = std::to_string(count);
    for (std::size_t i = text.size(); i > 3;) text.insert(i -= 3, 1, ',');
    return text;
}

std::string bytes_text(std::uint64_t bytes) {
    static constexpr std::string_view units[] = {"bytes", "kB", "MB", "GB", "TB", "PB", "EB"};
    if (bytes < 1000) return fmt::format("{} bytes", bytes);
    std::size_t unit = 0;
    double value = double(bytes);
    for (; value >= 999.5; value /= 1000) ++unit;
    return fmt::format("{:.3g} {}", value, units[unit]);
}

std::string seconds_text(double seconds) {
    return seconds < 0.9995 ? fmt::format("{:.3g} ms", 1000 * seconds) : fmt::format("{:#.4g} s", seconds);
}

std::string length_text(double length) {
    return fmt::format("{:.6g}", length);
}

namespace {

/// Six digits that do not pass the length on the side of `direction`, −1 or 1.
std::string bound_text(double length, int direction) {
    std::string text = length_text(length);
    if (direction * (std::strtod(text.c_str(), nullptr) - length) >= 0 || !std::isfinite(length)) return text;
    return length_text(length + direction * std::pow(10.0, std::floor(std::log10(std::abs(length))) - 5));
}

}  // namespace

std::string lower_bound_text(double length) {
    return bound_text(length, -1);
}

std::string upper_bound_text(double length) {
    return bound_text(length, 1);
}

std::string yes_or_no(bool value) {
    return value ? "yes" : "no";
}

Json box_json(const Box& box) {
    return {{"min", {box.min.x, box.min.y, box.min.z}}, {"max", {box.max.x, box.max.y, box.max.z}}};
}

Json up_json(UpAxis up) {
    return up == UpAxis::unknown ? Json() : Json(std::string(1, "xyz"[int(up) - 1]));
}

int upward_axis(const std::optional<int>& chosen, UpAxis of_file) {
    constexpr int z = 2;
    return chosen.value_or(of_file == UpAxis::unknown ? z : int(of_file) - 1);
}

Json shell_json(const ThinShell& shell, const Run& run) {
    const ShellInfo& info = shell.info();
    Json json;
    json["mesh"]["vertices"] = info.mesh_vertices;
    json["mesh"]["triangles"] = info.mesh_triangles;
    json["mesh"]["closed"] = info.mesh_closed;
    json["mesh"]["weld"] = info.weld;
    json["mesh"]["up"] = up_json(info.up);
    json["sign"] = name(info.sign);
    json["sign_reason"] = info.sign_reason;
    json["sides"] = "exact";
    json["depth"] = info.depth;
    json["scale"] = info.scale;
    json["cell_width"] = info.cell_width;
    json["epsilon_inner"] = info.epsilon_inner;
    json["epsilon_outer"] = info.epsilon_outer;
    json["thickness"] = info.thickness();
    json["thickness_relative"] = info.thickness() / info.scale;
    json["adaptive"] = info.adaptive;
    if (info.adaptive) {
        json["thickness_asked"] = info.thickness_asked;
        json["coarse_cells"] = info.coarse_cells;
    }
    json["rounding"] = info.rounding;
    json["extrema"] = name(info.extrema);
    json["solver"] = name(info.solver);
    json["surface_cells"] = info.surface_cells;
    json["cells"] = info.cells;
    json["grid_points"] = shell.grid_points(run);
    json["memory_bytes"] = info.memory_bytes;
    json["root"] = box_json(info.root);
    return json;
}

std::string coarse_text(const ShellInfo& info) {
    return fmt::format(
        "the shell is {} thick instead of {}: {} of {} surface cells are too coarse, between ({}, {}, {}) and "
        "({}, {}, {}); more memory, more or deeper cells, or a larger thickness would do",
        length_text(info.thickness()), length_text(info.thickness_asked), count_text(info.coarse_cells),
        count_text(info.surface_cells), length_text(info.coarse.min.x), length_text(info.coarse.min.y),
        length_text(info.coarse.min.z), length_text(info.coarse.max.x), length_text(info.coarse.max.y),
        length_text(info.coarse.max.z));
}

void add_shell_rows(Table& table, const ThinShell& shell, const Run& run) {
    const ShellInfo& info = shell.info();
    const auto length = [&](double value) {
        return fmt::format("{:<14} {:.6f} of the longest side", length_text(value), value / info.scale);
    };
    table.row("Mesh", fmt::format("{} vertices, {} triangles, {}", count_text(info.mesh_vertices),
                                  count_text(info.mesh_triangles), info.mesh_closed ? "closed" : "not closed"));
    if (info.weld > 0)
        table.row("Welded",
                  fmt::format("corners nearer than {:g} are one: all is proven of this mesh", info.weld));
    table.row("Sign rule", fmt::format("{}: {}", name(info.sign), info.sign_reason));
    table.row("Sides of points", "exact");
    table.row("Longest side", fmt::format("{} mesh units", length_text(info.scale)));
    table.row("Depth", std::to_string(info.depth));
    table.row("Finest cell", length(info.cell_width));
    table.row("ε₁, inner", length(info.epsilon_inner));
    table.row("ε₂, outer", length(info.epsilon_outer));
    table.row("Thickness", length(info.thickness()));
    if (info.thickness_asked > 0) table.row("Thickness asked", length(info.thickness_asked));
    if (info.coarse_cells > 0) table.row("Not reached", coarse_text(info));
    table.row("Bounds on f", fmt::format("{}, with {:.2g} for rounding", name(info.extrema), info.rounding));
    table.row("Solver", std::string(name(info.solver)));
    table.row("Surface cells", count_text(info.surface_cells));
    table.row("Cells, all levels", count_text(info.cells));
    table.row("Grid points", count_text(shell.grid_points(run)));
    const double per_cell = double(info.memory_bytes) / double(std::max<std::uint64_t>(info.surface_cells, 1));
    table.row("Memory",
              fmt::format("{}, {:.0f} bytes per surface cell", bytes_text(info.memory_bytes), per_cell));
}

}  // namespace its::cli
