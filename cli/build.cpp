#include <fmt/core.h>

#include <charconv>
#include <memory>
#include <optional>

#include "common.h"
#include "its/inspect.h"
#include "its/mesh_file.h"
#include "its/shell.h"
#include "its/shell_file.h"
#include "length.h"
#include "parts.h"
#include "report.h"
#include "weld.h"

namespace its::cli {
namespace {

struct Options {
    CommonOptions common;
    std::string mesh, output;
    bool force = false;
    BuildOptions build;
    WeldOption weld;
    LengthOption thickness;
    bool strict = false;
};

/// A build that was done, or found done.
struct Built {
    ThinShell shell;
    std::optional<WeldReport> weld = {};
    bool unchanged = false;
    MeshReport mesh = {};
    double read = 0, write = 0;
};

std::optional<int> parse_depth(const std::string& text) {
    if (text == "auto") return std::nullopt;
    int depth = -1;
    const auto [stop, error] = std::from_chars(text.data(), text.data() + text.size(), depth);
    if (error != std::errc{} || stop != text.data() + text.size() || depth < 0 || depth > max_depth)
        throw CLI::ValidationError(
            "--depth", fmt::format("'{}' is neither auto nor a whole number from 0 to {}", text, max_depth));
    return depth;
}

std::uint64_t parts_turned(const Options& options, const Built& built) {
    return options.build.turn_parts && goes_by_directions(built.shell.info().sign) ? built.mesh.parts.to_turn
                                                                                   : 0;
}

void print_report(const Options& options, const Built& built) {
    const std::string file =
        fmt::format("{}, {}", options.output, bytes_text(std::filesystem::file_size(options.output)));
    Table table;
    if (built.weld) table.row("Welding", weld_text(*built.weld));
    add_shell_rows(table, built.shell, options.common.run());
    add_part_rows(table, built.mesh.parts);
    if (options.build.turn_parts)
        table.row("Parts turned", count_text(parts_turned(options, built)) + " by nesting");
    if (built.unchanged) {
        table.row("Unchanged", file + ": built from this mesh with these options; --force builds anew");
    } else {
        const BuildSeconds& times = built.shell.build_seconds();
        table.row("Time", seconds_text(times.total));
        table.row("  octree", seconds_text(times.octree));
        table.row("  distance", seconds_text(times.distance) + ", signs " + seconds_text(times.signs));
        table.row("  field", seconds_text(times.field));
        table.row("  extrema", seconds_text(times.extrema));
        table.row("Reading, writing", seconds_text(built.read) + ", " + seconds_text(built.write));
        table.row("Wrote", file);
    }
    table.print();
}

void print_build_json(const Options& options, const MeshFile& file, const Built& built) {
    const BuildSeconds& times = built.unchanged ? BuildSeconds{} : built.shell.build_seconds();
    Json json = shell_json(built.shell, options.common.run());
    json["mesh"]["file"] = options.mesh;
    json["mesh"]["format"] = file.format;
    json["mesh"]["warnings"] = file.warnings;
    json["mesh"]["turned"] = built.mesh.turned;
    json["mesh"]["repaired"] = built.mesh.repaired;
    json["mesh"]["separating"] = built.mesh.separating;
    json["mesh"]["parts"] = parts_json(built.mesh.parts);
    json["mesh"]["parts"]["turned"] = parts_turned(options, built);
    if (built.weld) json["weld"] = weld_json(*built.weld);
    json["file"] = options.output;
    json["file_bytes"] = std::filesystem::file_size(options.output);
    json["unchanged"] = built.unchanged;
    json["seconds"] = {{"read", built.read},   {"octree", times.octree}, {"distance", times.distance},
                       {"signs", times.signs}, {"field", times.field},   {"extrema", times.extrema},
                       {"total", times.total}, {"write", built.write}};
    print_json(json);
}

/// The shell in the output, if it is whole and what this build would write again.
std::optional<ThinShell> stored_shell(const Options& options, const Mesh& mesh) {
    std::error_code error;
    if (options.force || !std::filesystem::is_regular_file(options.output, error)) return {};
    try {
        const ShellInfo info =
            load(options.output, {.check = LoadCheck::quick, .run = options.common.run()}).info();
        // Coarser than was asked for, perhaps for want of memory then.
        if (info.coarse_cells > 0 || info.input_hash != input_hash(mesh, options.build)) return {};
        return load(options.output, {.run = options.common.run()});
    } catch (const Error&) {
        return {};  // not a shell, or damaged: it will be replaced
    }
}

/// What is known about the mesh that the shell is of: the welded one, if it is welded.
MeshReport report_of(const Options& options, const Mesh& mesh) {
    if (options.build.weld > 0) return inspect(weld(mesh, options.build.weld).mesh, options.common.run());
    return inspect(mesh, options.common.run());
}

Built build_and_save(const Options& options, const Mesh& mesh) {
    ProgressBar bar(options.common.quiet);
    BuildOptions build_options = options.build;
    build_options.run = options.common.run(bar);
    MeshReport report;
    const ThinShell shell = naming_file(options.mesh, [&] { return build(mesh, build_options, &report); });
    bar.clear();
    stop_if_interrupted();
    if (options.strict && shell.info().coarse_cells > 0)
        throw MemoryError(
            fmt::format("{}: {}; nothing is written (--strict)", options.mesh, coarse_text(shell.info())));
    const Stopwatch writing;
    save(shell, options.output, options.common.run());
    return {.shell = shell, .mesh = report, .write = writing.seconds()};
}

/// What goes with a thickness only, given or the default one.
void check_limits(const Options& options) {
    if (!options.build.depth) return;
    if (options.thickness.given()) throw OptionError("--thickness and --depth: give one of them");
    if (options.build.max_cells > 0 || options.build.deepest || options.strict)
        throw OptionError("--max-cells, --max-depth and --strict do not go with --depth");
}

int run(Options options) {
    check_limits(options);
    check_output(options.output, options.mesh);
    const Stopwatch reading;
    const MeshFile file = read_mesh_with_warnings(options.mesh, options.common);
    const double read = reading.seconds();
    options.build.up = file.up;
    options.build.max_memory = options.common.memory_beside(memory_of(file.mesh));
    if (options.weld.given())
        naming_file(options.mesh, [&] { options.build.weld = options.weld.length(file.mesh); });
    if (options.thickness.given())
        naming_file(options.mesh, [&] { options.build.thickness = options.thickness.length(file.mesh); });
    const std::optional<ThinShell> stored = stored_shell(options, file.mesh);
    Built built = stored ? Built{.shell = *stored, .unchanged = true, .mesh = report_of(options, file.mesh)}
                         : build_and_save(options, file.mesh);
    built.read = read;
    if (goes_by_directions(built.shell.info().sign))
        warn_of_parts(options.mesh, built.mesh.parts, options.build.turn_parts);
    if (options.build.weld > 0) built.weld = weld(file.mesh, options.build.weld).report;
    if (options.common.json)
        print_build_json(options, file, built);
    else if (!options.common.quiet)
        print_report(options, built);
    if (built.shell.info().coarse_cells == 0) return done;
    print_message("warning", fmt::format("{}: {}", options.mesh, coarse_text(built.shell.info())));
    return options.thickness.given() ? check_failed : done;
}

}  // namespace

Action add_build(CLI::App& app) {
    const auto options = std::make_shared<Options>();
    app.add_option("MESH", options->mesh, "Mesh: .obj .stl .ply .off .glb .gltf .3mf")->required();
    app.add_option("-o,--output", options->output, "File to write")->required()->type_name("SHELL.its");
    app.add_option_function<std::string>(
           "--depth", [options](const std::string& text) { options->build.depth = parse_depth(text); },
           fmt::format("All cells that meet the mesh are the longest side / 2^K wide, K from 0\n"
                       "to {}; auto (default): as large as the thickness allows",
                       max_depth))
        ->type_name("K|auto");
    options->thickness.declare(app, "--thickness",
                               "Cells are as large as a shell of this thickness allows; mesh units, or with %\n"
                               "of the longest side; default: 0.2%",
                               true);
    app.add_option("--max-cells", options->build.max_cells,
                   fmt::format("Cells of all levels, at most; the coarsest shell of all may have more.\n"
                               "Default: any number with --thickness, else {} millions, and {} a triangle",
                               default_max_cells / 1'000'000, default_cells_per_triangle))
        ->type_name("N")
        ->check(CLI::PositiveNumber);
    app.add_option("--max-depth", options->build.deepest,
                   fmt::format("Cells are at least the longest side / 2^K wide, K from {} to {}",
                               least_adaptive_depth, max_adaptive_depth))
        ->type_name("K");
    app.add_flag("--strict", options->strict, "Write nothing where the thickness is not reached");
    Choices<std::optional<SignRule>> rules = {{"auto", std::nullopt}};
    for (const auto& rule :
         choices_of({SignRule::winding, SignRule::generalized, SignRule::even_odd, SignRule::unsigned_rule}))
        rules.emplace_back(rule);
    add_choice(app, "--sign", rules, options->build.sign, "How inside is defined")->type_name("RULE");
    add_choice(app, "--extrema", choices_of({Extrema::certified, Extrema::candidates}), options->build.extrema,
               "How f is bounded on the mesh")
        ->type_name("WAY");
    add_choice(app, "--solver", choices_of({Solver::direct, Solver::lscg}), options->build.solver,
               "How coefficients are found")
        ->type_name("WAY");
    app.add_flag("--turn-parts", options->build.turn_parts,
                 "Turn closed parts around by nesting: solid, cavity, solid, and so on");
    app.add_flag("--force", options->force,
                 "Build even if the output already holds this shell: same mesh, options and version");
    options->weld.declare(app);
    options->common.declare(app, "its build model.stl -o model.its --depth 8");
    return [options] { return run(*options); };
}

}  // namespace its::cli
