#include "its/page.h"

#include <fmt/core.h>

#include <filesystem>
#include <memory>
#include <optional>
#include <string>

#include "common.h"
#include "its/shell_file.h"
#include "report.h"

namespace its::cli {
namespace {

struct Options {
    CommonOptions common;
    std::string shell, output;
    std::optional<int> up;
    ViewOptions view;
};

int run(const Options& options) {
    check_output(options.output, options.shell);
    const ThinShell shell = load_shell(options.shell, options.common);
    ProgressBar bar(options.common.quiet);
    ViewOptions view = options.view;
    if (view.title.empty()) view.title = std::filesystem::path(options.shell).stem().string();
    view.up = upward_axis(options.up, shell.info().up);
    view.run = options.common.run(bar);
    view.max_memory = options.common.memory_beside(size_of(options.shell));
    const Stopwatch watch;
    naming_file(options.shell, [&] { write_view(shell, options.output, view); });
    const double seconds = watch.seconds();
    bar.clear();
    const std::uint64_t bytes = std::filesystem::file_size(options.output);
    if (options.common.json) {
        Json json;
        json["file"] = options.output;
        json["file_bytes"] = bytes;
        json["title"] = view.title;
        json["seconds"]["view"] = seconds;
        print_json(json);
    } else if (!options.common.quiet) {
        Table table;
        table.row("Time", seconds_text(seconds));
        table.row("Wrote", fmt::format("{}, {}; open it in a browser", options.output, bytes_text(bytes)));
        table.print();
    }
    return done;
}

}  // namespace

Action add_view(CLI::App& app) {
    const auto options = std::make_shared<Options>();
    ViewOptions& view = options->view;
    view.title.clear();
    app.add_option("SHELL", options->shell, "Shell written by its build")->required();
    app.add_option("-o,--output", options->output, "Page to write")->required()->type_name("OUT.html");
    app.add_option("--title", view.title, "Title of the page; default: the name of the shell")
        ->type_name("TEXT");
    add_choice<std::optional<int>>(app, "--up", {{"x", 0}, {"y", 1}, {"z", 2}}, options->up,
                                   "Axis that points upwards; default: that of the mesh's file, else z")
        ->type_name("AXIS");
    app.add_option("--resolution", view.resolution,
                   "Cells of the surfaces along the longest side; default: the shell's own, at most 128")
        ->check(CLI::Range(0, 65536))
        ->type_name("N");
    app.add_option("--samples", view.field_samples,
                   "Samples of f along the longest side, for the cut plane, 16 to 256; default 112")
        ->check(CLI::Range(16, 256))
        ->type_name("N");
    app.add_option("--max-triangles", view.max_triangles,
                   "Show larger meshes and surfaces simplified, 1000 or more; default 400000")
        ->check(CLI::Range(std::uint64_t{1000}, std::uint64_t{1'000'000'000}))
        ->type_name("N");
    options->common.declare(app, "its view model.its -o model.html");
    return [options] { return run(*options); };
}

}  // namespace its::cli
