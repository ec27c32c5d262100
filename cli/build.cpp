#include <fmt/core.h>

#include <charconv>
#include <memory>
#include <optional>

#include "common.h"
#include "its/io.h"
#include "its/shell.h"
#include "report.h"

namespace its::cli {
namespace {

struct Options {
    CommonOptions common;
    std::string mesh, output;
    BuildOptions build;
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

void print_report(const Options& options, const ThinShell& shell, const BuildTimes& times, double read,
                  double write) {
    Table table;
    add_shell_rows(table, shell);
    table.row("Time", seconds_text(times.total));
    table.row("  octree", seconds_text(times.octree));
    table.row("  distance", seconds_text(times.distance) + ", signs " + seconds_text(times.signs));
    table.row("  field", seconds_text(times.field));
    table.row("  extrema", seconds_text(times.extrema));
    table.row("Reading, writing", seconds_text(read) + ", " + seconds_text(write));
    table.row("Wrote",
              fmt::format("{}, {}", options.output, bytes_text(std::filesystem::file_size(options.output))));
    table.print();
}

void print_build_json(const Options& options, const MeshFile& file, const ThinShell& shell,
                      const BuildTimes& times, double read, double write) {
    Json json = shell_json(shell);
    json["mesh"]["file"] = options.mesh;
    json["mesh"]["format"] = file.format;
    json["mesh"]["warnings"] = file.warnings;
    json["file"] = options.output;
    json["file_bytes"] = std::filesystem::file_size(options.output);
    json["seconds"] = {{"read", read},         {"octree", times.octree}, {"distance", times.distance},
                       {"signs", times.signs}, {"field", times.field},   {"extrema", times.extrema},
                       {"total", times.total}, {"write", write}};
    print_json(json);
}

int run(const Options& options) {
    check_output(options.output, options.mesh);
    const Stopwatch reading;
    const MeshFile file = read_mesh_with_warnings(options.mesh);
    const double read = reading.seconds();

    ProgressBar bar(options.common.quiet);
    BuildOptions build_options = options.build;
    build_options.threads = options.common.threads;
    build_options.progress = bar.callback();
    BuildTimes times;
    const ThinShell shell = naming_file(options.mesh, [&] { return build(file.mesh, build_options, &times); });
    bar.clear();
    stop_if_interrupted();

    const Stopwatch writing;
    save(shell, options.output);
    const double write = writing.seconds();
    if (options.common.json)
        print_build_json(options, file, shell, times, read, write);
    else if (!options.common.quiet)
        print_report(options, shell, times, read, write);
    return done;
}

}  // namespace

Run add_build(CLI::App& app) {
    const auto options = std::make_shared<Options>();
    app.add_option("MESH", options->mesh, "Mesh: .obj .stl .ply .off .glb .gltf .3mf")->required();
    app.add_option("-o,--output", options->output, "File to write")->required()->type_name("SHELL.its");
    app.add_option_function<std::string>(
           "--depth", [options](const std::string& text) { options->build.depth = parse_depth(text); },
           fmt::format("Finest cells are the longest side / 2^K wide, K from 0 to {};\n"
                       "auto (default): about four triangles in a cell, within the memory",
                       max_depth))
        ->type_name("K|auto");
    add_choice<std::optional<SignRule>>(app, "--sign",
                                        {{"auto", std::nullopt},
                                         {"winding", SignRule::winding},
                                         {"generalized", SignRule::generalized},
                                         {"even-odd", SignRule::even_odd},
                                         {"unsigned", SignRule::unsigned_rule}},
                                        options->build.sign, "How inside is defined")
        ->type_name("RULE");
    add_choice<Extrema>(app, "--extrema",
                        {{"certified", Extrema::certified}, {"candidates", Extrema::candidates}},
                        options->build.extrema, "How f is bounded on the mesh")
        ->type_name("WAY");
    add_choice<Solver>(app, "--solver", {{"direct", Solver::direct}, {"lscg", Solver::lscg}},
                       options->build.solver, "How coefficients are found")
        ->type_name("WAY");
    app.add_option_function<std::string>(
           "--max-memory",
           [options](const std::string& text) { options->build.max_memory = parse_size("--max-memory", text); },
           "Refuse to take more: bytes, or with K, M, G, T (powers of 1000);\n"
           "default: three quarters of what is free; --depth auto stays within it")
        ->type_name("SIZE");
    options->common.declare(app, "its build model.stl -o model.its --depth 8");
    return [options] { return run(*options); };
}

}  // namespace its::cli
