#include <fmt/core.h>

#include <cmath>
#include <memory>
#include <optional>

#include "common.h"
#include "its/inspect.h"
#include "its/mesh.h"
#include "its/mesh_file.h"
#include "parts.h"
#include "report.h"
#include "weld.h"

namespace its::cli {
namespace {

struct Options {
    CommonOptions common;
    std::string mesh;
    bool turn_parts = false;
    WeldOption weld;
};

/// The option to give, and what it does.
std::string advice_text(SignAdvice advice) {
    const auto effect = [&] {
        switch (advice) {
            case SignAdvice::around_both_sides:
                return "for a shell around both sides";
            case SignAdvice::with_holes_open:
                return "for a shell around both sides, with the holes open";
            case SignAdvice::winding_as_it_is:
                return "to take the triangles as they are: then nothing is inside";
            case SignAdvice::crossings_as_it_is:
                return "for inside by counting crossings, without turning anything";
            case SignAdvice::generalized_as_it_is:
                return "to take the directions of the triangles as they are";
            case SignAdvice::fill_nevertheless:
                return "to fill the holes nevertheless";
            case SignAdvice::none:
                break;
        }
        return "";
    };
    const std::optional<SignRule> rule = advised_rule(advice);
    return rule ? fmt::format("--sign {} {}", name(*rule), effect()) : "";
}

void print_check_json(const Options& options, const MeshFile& file, const std::optional<Welded>& welded,
                      const MeshReport& report, std::uint64_t parts_turned) {
    Json json;
    json["file"] = options.mesh;
    json["format"] = file.format;
    json["up"] = up_json(file.up);
    json["warnings"] = file.warnings;
    if (welded) json["weld"] = weld_json(welded->report);
    json["vertices"] = report.vertices;
    json["triangles"] = report.triangles;
    json["degenerate"] = report.degenerate;
    json["duplicate"] = report.duplicate;
    json["boundary_edges"] = report.boundary_edges;
    json["nonmanifold_edges"] = report.nonmanifold_edges;
    json["inconsistent_edges"] = report.inconsistent_edges;
    json["unbalanced_edges"] = report.unbalanced_edges;
    json["odd_edges"] = report.odd_edges;
    json["open_edges"] = report.open_edges;
    json["open_odd_edges"] = report.open_odd_edges;
    json["t_junctions"] = report.t_junctions;
    json["components"] = report.components;
    json["euler"] = report.euler;
    json["closed"] = report.closed;
    json["oriented"] = report.oriented;
    json["bounds"] = box_json(report.bounds);
    json["signed_volume"] = report.signed_volume;
    json["sign"] = name(report.sign);
    json["sign_reason"] = report.sign_reason;
    json["sign_advice"] = advice_text(report.sign_advice);
    json["turned"] = report.turned;
    json["repaired"] = report.repaired;
    json["separating"] = report.separating;
    json["parts"] = parts_json(report.parts);
    json["parts"]["turned"] = parts_turned;
    json["seconds"] = {{"check", report.seconds.total}};
    print_json(json);
}

void print_report(const Options& options, const MeshFile& file, const std::optional<Welded>& welded,
                  const MeshReport& report, std::uint64_t parts_turned) {
    const Box& box = report.bounds;
    const auto defects = [](std::uint64_t count, const char* meaning) {
        return count == 0 ? std::string("none") : fmt::format("{:<10} {}", count_text(count), meaning);
    };
    Table table;
    table.row("File", fmt::format("{} ({})", options.mesh, file.format));
    if (welded) table.row("Welded", weld_text(welded->report));
    table.row("Vertices", count_text(report.vertices));
    table.row("Triangles", count_text(report.triangles));
    table.row("Components", count_text(report.components));
    table.row("Euler number", std::to_string(report.euler));
    table.row("Size", fmt::format("{} × {} × {} mesh units", length_text(box.max.x - box.min.x),
                                  length_text(box.max.y - box.min.y), length_text(box.max.z - box.min.z)));
    table.row("From", fmt::format("({:.6g}, {:.6g}, {:.6g})", box.min.x, box.min.y, box.min.z));
    table.row("To", fmt::format("({:.6g}, {:.6g}, {:.6g})", box.max.x, box.max.y, box.max.z));
    if (file.up != UpAxis::unknown)
        table.row("Upwards", fmt::format("{}, by its format", up_json(file.up).get<std::string>()));
    table.row("Signed volume", fmt::format("{:.6g}{}", report.signed_volume,
                                           report.closed && report.signed_volume < 0 ? "   inside out" : ""));
    table.row("Closed", yes_or_no(report.closed));
    table.row("Oriented", yes_or_no(report.oriented));
    table.row("Degenerate triangles", defects(report.degenerate, "without area"));
    table.row("Duplicate triangles", defects(report.duplicate, "over the corners of an earlier one"));
    table.row("Boundary edges", defects(report.boundary_edges, "with one triangle"));
    table.row("Non-manifold edges", defects(report.nonmanifold_edges, "with more than two triangles"));
    table.row("Inconsistent edges", defects(report.inconsistent_edges, "run through twice the same way"));
    table.row("Unbalanced edges", defects(report.unbalanced_edges, "not run through as often each way"));
    table.row("Odd edges", defects(report.odd_edges, "with an odd number of triangles"));
    table.row("Open edges", defects(report.open_edges, "unbalanced ones that leave a gap"));
    table.row("T-junctions", defects(report.t_junctions, "points that split an edge on one side only"));
    if (report.sign == SignRule::generalized || report.separating < 1)
        table.row("Separating",
                  fmt::format("{:.1f} % of the area has inside on one side and outside on the other",
                              std::floor(1000 * report.separating) / 10));
    add_part_rows(table, report.parts);
    if (parts_turned > 0) table.row("Parts turned", count_text(parts_turned) + " by nesting, before all this");
    table.row("Sign rule", fmt::format("{}: {}", name(report.sign), report.sign_reason));
    if (report.turned > 0)
        table.row("Turned around", fmt::format("{} of the triangles", count_text(report.turned)));
    if (report.repaired > 0)
        table.row("Repaired", fmt::format("{} triangles, which disagreed with those around them",
                                          count_text(report.repaired)));
    if (report.sign_advice != SignAdvice::none) table.row("Otherwise", advice_text(report.sign_advice));
    table.print();
}

int run(const Options& options) {
    const MeshFile file = read_mesh_with_warnings(options.mesh, options.common);
    // Welding, edges by their ends and rays for its sides: 70 bytes a triangle were measured. Trees of closed
    // parts whose bounds meet: a box (48 bytes), its number, and up to one node of 64 bytes, whose array may
    // have doubled.
    options.common.require_memory(260 * file.mesh.triangles.size(), memory_of(file.mesh), "checking");
    const its::Run run = options.common.run();
    std::optional<Welded> welded;
    MeshReport report = naming_file(options.mesh, [&] {
        if (options.weld.given()) welded = weld(file.mesh, options.weld.length(file.mesh));
        return inspect(welded ? welded->mesh : file.mesh, run);
    });
    const std::uint64_t parts_turned = options.turn_parts ? report.parts.to_turn : 0;
    if (parts_turned > 0) report = inspect(turn_parts(welded ? welded->mesh : file.mesh, run), run);
    if (options.common.json)
        print_check_json(options, file, welded, report, parts_turned);
    else if (!options.common.quiet)
        print_report(options, file, welded, report, parts_turned);
    return done;
}

}  // namespace

Action add_check(CLI::App& app) {
    const auto options = std::make_shared<Options>();
    app.add_option("MESH", options->mesh, "Mesh: .obj .stl .ply .off .glb .gltf .3mf")->required();
    app.add_flag("--turn-parts", options->turn_parts,
                 "As with closed parts turned around by nesting: solid, cavity, solid, and so on");
    options->weld.declare(app);
    options->common.declare(app, "its check model.stl");
    return [options] { return run(*options); };
}

}  // namespace its::cli
