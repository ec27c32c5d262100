#include <fmt/core.h>

#include <memory>

#include "common.h"
#include "its/io.h"
#include "its/picture.h"
#include "report.h"

namespace its::cli {
namespace {

struct Options {
    CommonOptions common;
    std::string shell, output;
    SliceOptions slice;
};

int run(const Options& options) {
    check_output(options.output, options.shell);
    const ThinShell shell = naming_file(options.shell, [&] { return load(options.shell); });
    SliceOptions slice_options = options.slice;
    slice_options.threads = options.common.threads;
    const Stopwatch watch;
    const Image image = naming_file(options.shell, [&] { return slice(shell, slice_options); });
    const double seconds = watch.seconds();
    stop_if_interrupted();
    write_png(image, options.output);
    const std::string axis(1, "xyz"[slice_options.axis]);
    if (options.common.json) {
        Json json;
        json["file"] = options.output;
        json["width"] = image.width;
        json["height"] = image.height;
        json["axis"] = axis;
        json["at"] = slice_options.at;
        json["cells"] = slice_options.cells;
        json["seconds"]["slice"] = seconds;
        print_json(json);
    } else if (!options.common.quiet) {
        Table table;
        table.row("Plane", fmt::format("{} at {:.6g} of the mesh's extent", axis, slice_options.at));
        table.row("Time", seconds_text(seconds));
        table.row("Wrote", fmt::format("{}, {} × {} pixels", options.output, image.width, image.height));
        table.print();
    }
    return done;
}

}  // namespace

Run add_slice(CLI::App& app) {
    const auto options = std::make_shared<Options>();
    app.add_option("SHELL", options->shell, "Shell written by its build")->required();
    app.add_option("-o,--output", options->output, "Picture to write")->required()->type_name("OUT.png");
    add_choice<int>(app, "--axis", {{"x", 0}, {"y", 1}, {"z", 2}}, options->slice.axis,
                    "Normal of the plane, default z")
        ->type_name("AXIS");
    app.add_option("--at", options->slice.at, "Position within the mesh's bounds, 0 to 1; default 0.5")
        ->check(CLI::Range(0.0, 1.0))
        ->type_name("RELATIVE");
    app.add_option("--size", options->slice.size, "Pixels of the longer side, 64 to 8192; default 1024")
        ->check(CLI::Range(64, 8192))
        ->type_name("PIXELS");
    app.add_flag("--cells", options->slice.cells, "Draw the octree's cells");
    options->common.declare(app, "its slice model.its -o model.png --axis y --at 0.5");
    return [options] { return run(*options); };
}

}  // namespace its::cli
