#include "its/simplify.h"

#include <fmt/core.h>
#include <fmt/ranges.h>

#include <memory>

#include "common.h"
#include "its/distance.h"
#include "its/mesh_file.h"
#include "length.h"
#include "parts.h"
#include "report.h"
#include "up.h"
#include "weld.h"

namespace its::cli {
namespace {

struct Options {
    CommonOptions common;
    std::string mesh, output;
    SimplifyOptions simplify;
    std::uint64_t samples = 200'000;
    bool no_attributes = false, single = false;
    WeldOption weld;
    UpOption up;
    LengthOption thickness;
};

/// A mesh as it is simplified.
struct Input {
    MeshFile file;
    std::optional<WeldReport> weld;
};

/// "colours, texture coordinates, normals": those that there are.
std::vector<std::string> names_of(const MeshAttributes& attributes) {
    std::vector<std::string> names;
    if (!attributes.colours.empty()) names.emplace_back("colours");
    if (!attributes.texture.empty()) names.emplace_back("texture coordinates");
    if (!attributes.normals.empty()) names.emplace_back("normals");
    return names;
}

/// Distances between mesh and result, both ways.
struct Measured {
    MeshDistance to_result, to_mesh;
    double seconds = 0;
};

const Choices<SimplifyMethod> methods = choices_of(
    {SimplifyMethod::certified, SimplifyMethod::vertex, SimplifyMethod::priority, SimplifyMethod::qem});

Json distance_json(const MeshDistance& distance) {
    return {{"max", distance.max}, {"mean", distance.mean}, {"root_mean_square", distance.root_mean_square}};
}

void print_simplify_json(const Options& options, const Input& input, const SimplifyReport& report,
                         const std::vector<std::string>& lost, const std::optional<Measured>& measured,
                         double read, double write) {
    Json json;
    json["mesh"] = {{"file", options.mesh}, {"format", input.file.format}, {"warnings", input.file.warnings}};
    if (input.weld) json["weld"] = weld_json(*input.weld);
    json["method"] = name(options.simplify.method);
    json["faces_before"] = report.faces_before;
    json["faces_after"] = report.faces_after;
    json["vertices_before"] = report.vertices_before;
    json["vertices_after"] = report.vertices_after;
    json["collapses"] = report.collapses;
    json["refused"] = report.refused;
    json["stop"] = reason(report.stop);
    json["tolerance"] = options.simplify.tolerance ? Json(*options.simplify.tolerance) : Json();
    json["proven_bound"] = report.proven_bound ? Json(*report.proven_bound) : Json();
    json["in_shell"] = report.in_shell;
    if (report.shell) {
        const ShellInfo& shell = *report.shell;
        json["shell"] = {{"depth", shell.depth},
                         {"sign", name(shell.sign)},
                         {"epsilon_inner", shell.epsilon_inner},
                         {"epsilon_outer", shell.epsilon_outer},
                         {"thickness", shell.thickness()}};
    }
    if (report.parts) {
        json["parts"] = parts_json(*report.parts);
        json["parts"]["turned"] = options.simplify.turn_parts ? report.parts->to_turn : 0;
    }
    json["attributes"] = {{"names", names_of(input.file.attributes)},
                          {"seam_edges_before", report.seam_edges_before},
                          {"seam_edges_after", report.seam_edges_after},
                          {"lost", lost}};
    json["no_self_intersections"] = options.simplify.no_self_intersections;
    if (measured) {
        json["measured"] = {{"samples", options.samples},
                            {"mesh_to_result", distance_json(measured->to_result)},
                            {"result_to_mesh", distance_json(measured->to_mesh)}};
        json["measured"]["hausdorff"] = std::max(measured->to_result.max, measured->to_mesh.max);
    }
    json["file"] = options.output;
    json["seconds"] = {{"read", read},
                       {"shell", report.seconds.shell},
                       {"simplify", report.seconds.simplify},
                       {"total", report.seconds.total},
                       {"measure", measured ? measured->seconds : 0.0},
                       {"write", write}};
    print_json(json);
}

void print_report(const Options& options, const Input& input, const SimplifyReport& report,
                  const std::vector<std::string>& lost, const std::optional<Measured>& measured, double read,
                  double write) {
    Table table;
    if (input.weld) table.row("Welded", weld_text(*input.weld));
    table.row("Faces",
              fmt::format("{} to {}", count_text(report.faces_before), count_text(report.faces_after)));
    table.row("Stopped because", std::string(reason(report.stop)));
    if (report.proven_bound)
        table.row("Proven, both ways",
                  fmt::format("every point within {}", upper_bound_text(*report.proven_bound)));
    if (report.shell)
        table.row("Shell", fmt::format("{} thick, [{}, {}], depth {}{}", length_text(report.shell->thickness()),
                                       length_text(report.shell->epsilon_inner),
                                       length_text(report.shell->epsilon_outer), report.shell->depth,
                                       report.in_shell ? "; every point of the result is in it, proven" : ""));
    if (report.parts) add_part_rows(table, *report.parts);
    if (options.simplify.turn_parts)
        table.row("Parts turned", count_text(report.parts->to_turn) + " by nesting");
    if (!input.file.attributes.empty())
        table.row("Attributes", fmt::format("{}{}", fmt::join(names_of(input.file.attributes), ", "),
                                            report.seam_edges_before == 0
                                                ? ""
                                                : fmt::format("; {} to {} edges of seams, held",
                                                              count_text(report.seam_edges_before),
                                                              count_text(report.seam_edges_after))));
    for (const std::string& line : lost) table.row("Lost", line);
    if (options.simplify.no_self_intersections) table.row("Self-intersections", "none, by exact predicates");
    if (measured) {
        const auto text = [](const MeshDistance& d) {
            return fmt::format("{} at most, {} on average", length_text(d.max), length_text(d.mean));
        };
        table.row("Measured, mesh to result", text(measured->to_result));
        table.row("Measured, result to mesh", text(measured->to_mesh));
    }
    table.row("Time", seconds_text(report.seconds.total));
    if (report.shell) table.row("  shell", seconds_text(report.seconds.shell));
    table.row("  simplification", seconds_text(report.seconds.simplify));
    if (measured) table.row("Measuring", seconds_text(measured->seconds));
    table.row("Reading, writing", seconds_text(read) + ", " + seconds_text(write));
    table.row("Wrote", options.output);
    table.print();
}

std::optional<Measured> measure(const Options& options, const Mesh& mesh, const Mesh& result) {
    const bool wanted = options.samples > 0 && (options.common.json || !options.common.quiet);
    if (!wanted) return std::nullopt;
    const Stopwatch watch;
    Measured measured{mesh_distance(mesh, result, options.samples, options.common.run()),
                      mesh_distance(result, mesh, options.samples, options.common.run()), 0};
    measured.seconds = watch.seconds();
    return measured;
}

int run(const Options& options) {
    check_output(options.output, options.mesh);
    options.up.check(options.output);
    const Stopwatch reading;
    Input input{read_mesh_with_warnings(options.mesh, options.common, {.attributes = !options.no_attributes}),
                {}};
    MeshFile& file = input.file;
    const double read = reading.seconds();

    if (options.weld.given()) {
        Welded welded =
            naming_file(options.mesh, [&] { return weld(file.mesh, options.weld.length(file.mesh)); });
        file.mesh = std::move(welded.mesh);
        input.weld = welded.report;
    }

    ProgressBar bar(options.common.quiet);
    SimplifyOptions simplify_options = options.simplify;
    if (options.thickness.given())
        naming_file(options.mesh, [&] { simplify_options.thickness = options.thickness.length(file.mesh); });
    simplify_options.run = options.common.run(bar);
    // Half-edges, quadrics, queue and proof: 500 bytes a triangle were measured, and a shell's, if any,
    // besides.
    const std::uint64_t collapsing = 550 * file.mesh.triangles.size();
    options.common.require_memory(collapsing, memory_of(file.mesh), "simplifying");
    simplify_options.max_memory = options.common.memory_beside(memory_of(file.mesh) + collapsing);
    simplify_options.coordinates = coordinates_of(options.output, options.single);
    const Simplified result =
        naming_file(options.mesh, [&] { return simplify(file.mesh, file.attributes, simplify_options); });
    bar.clear();
    stop_if_interrupted();

    const Stopwatch writing;
    const MeshView written = result.mesh;
    WriteOptions how = options.up.writing(options.output, result.report.origin);
    how.single = options.single;
    const std::vector<std::string> lost = write_mesh(written, result.attributes, options.output, how);
    const double write = writing.seconds();
    if (options.simplify.faces && result.report.faces_after > *options.simplify.faces)
        print_message("warning", fmt::format("{}: {} faces are left, not {}: {}", options.output,
                                             result.report.faces_after, *options.simplify.faces,
                                             reason(result.report.stop)));
    if (result.report.parts && (options.simplify.turn_parts || goes_by_directions(result.report.shell->sign)))
        warn_of_parts(options.mesh, *result.report.parts, options.simplify.turn_parts);
    const std::optional<Measured> measured = measure(options, file.mesh, result.mesh);
    if (options.common.json)
        print_simplify_json(options, input, result.report, lost, measured, read, write);
    else if (!options.common.quiet)
        print_report(options, input, result.report, lost, measured, read, write);
    return done;
}

}  // namespace

Action add_simplify(CLI::App& app) {
    const auto options = std::make_shared<Options>();
    SimplifyOptions& simplify = options->simplify;
    app.add_option("MESH", options->mesh, "Mesh: .obj .stl .ply .off .glb .gltf .3mf")->required();
    app.add_option("-o,--output", options->output, "Mesh to write: .obj .stl .ply .off .glb")
        ->required()
        ->type_name("OUT");
    add_choice(app, "--method", methods, simplify.method, "What allows a collapse, or orders them")
        ->type_name("METHOD");
    app.add_option("--tolerance", simplify.tolerance,
                   "No point of the result is farther from the mesh, and none of the mesh\n"
                   "from the result: proven; mesh units")
        ->type_name("LENGTH");
    app.add_option("--faces", simplify.faces, "Stop at this number of triangles")->type_name("N");
    options->thickness.declare(app, "--thickness",
                               "Stay in the shell of this thickness as well, in mesh units, or with % of the\n"
                               "longest side; default: no shell with --tolerance or --faces; by vertex with\n"
                               "--faces the thinnest found that allows so few; else as its build makes it",
                               true);
    app.add_option("--depth", simplify.depth,
                   fmt::format("Instead of a thickness: the shell of cells of one size, 0 to {}", max_depth))
        ->type_name("K");
    app.add_option("--gamma", simplify.gamma, "priority: weight of f² beside the quadric error; default 1")
        ->type_name("GAMMA");
    app.add_flag("--no-self-intersections", simplify.no_self_intersections,
                 "No two triangles of the result meet; those of the mesh must not");
    app.add_flag("--turn-parts", simplify.turn_parts,
                 "Turn closed parts around by nesting: solid, cavity, solid, and so on");
    app.add_flag("--no-attributes", options->no_attributes,
                 "Leave out colours, texture coordinates and normals; their seams hold nothing then");
    app.add_flag(
        "--single", options->single,
        "32-bit coordinates in .ply, .obj and .off too, as .stl and .glb have; what is proven holds for them");
    app.add_option("--samples", options->samples,
                   "Points for the measured distances, each way; 0: none; default 200,000")
        ->check(CLI::Range(std::uint64_t{0}, std::uint64_t{1'000'000'000'000}))
        ->type_name("N");
    options->weld.declare(app);
    options->up.declare(app);
    options->common.declare(app, "its simplify model.stl -o small.stl --tolerance 0.1");
    return [options] { return run(*options); };
}

}  // namespace its::cli
