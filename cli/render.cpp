#include <fmt/core.h>

#include <memory>
#include <optional>
#include <string>
#include <tuple>

#include "common.h"
#include "its/picture.h"
#include "its/shell_file.h"
#include "report.h"

namespace its::cli {
namespace {

struct Options {
    CommonOptions common;
    std::string shell, output;
    std::optional<int> up;
    RenderOptions render;
};

int run(const Options& options) {
    check_output(options.output, options.shell);
    const ThinShell shell = load_shell(options.shell, options.common);
    ProgressBar bar(options.common.quiet);
    RenderOptions render_options = options.render;
    render_options.up = upward_axis(options.up, shell.info().up);
    render_options.run = options.common.run(bar);
    render_options.max_memory = options.common.memory_beside(size_of(options.shell));
    const Stopwatch watch;
    const Image image = naming_file(options.shell, [&] { return render(shell, render_options); });
    const double seconds = watch.seconds();
    bar.clear();
    write_png(image, options.output);
    if (options.common.json) {
        Json json;
        json["file"] = options.output;
        json["width"] = image.width;
        json["height"] = image.height;
        json["samples"] = render_options.samples;
        json["seconds"]["render"] = seconds;
        print_json(json);
    } else if (!options.common.quiet) {
        Table table;
        table.row("Time", fmt::format("{}, {} rays a pixel", seconds_text(seconds), render_options.samples));
        table.row("Wrote", fmt::format("{}, {} × {} pixels", options.output, image.width, image.height));
        table.print();
    }
    return done;
}

}  // namespace

Action add_render(CLI::App& app) {
    const auto options = std::make_shared<Options>();
    RenderOptions& render = options->render;
    app.add_option("SHELL", options->shell, "Shell written by its build")->required();
    app.add_option("-o,--output", options->output, "Picture to write")->required()->type_name("OUT.png");
    app.add_option("--size", render.width, "Pixels of the picture's width, 256 to 8192; default 1600")
        ->check(CLI::Range(256, 8192))
        ->type_name("PIXELS");
    add_choice<std::optional<int>>(app, "--up", {{"x", 0}, {"y", 1}, {"z", 2}}, options->up,
                                   "Axis that points upwards; default: that of the mesh's file, else z")
        ->type_name("AXIS");
    const auto view = [&render](const std::string& text) {
        std::tie(render.azimuth, render.elevation) = parse_pair("--view", text);
    };
    app.add_option_function<std::string>("--view", view,
                                         "Direction of the camera in degrees, around the upward axis and above "
                                         "the floor; default 30,18")
        ->type_name("AZIMUTH,ELEVATION");
    const auto cut = [&render](const std::string& text) {
        std::tie(render.cut, render.at) = parse_pair("--cut", text);
    };
    app.add_option_function<std::string>("--cut", cut,
                                         "Where the cuts face, in degrees to the left of the camera, and their "
                                         "position, 0 to 1; default 48,0.5")
        ->type_name("DEGREES,RELATIVE");
    app.add_option("--samples", render.samples, "Rays a pixel, 1 to 4096: less noise, more time; default 16")
        ->check(CLI::Range(1, 4096))
        ->type_name("N");
    app.add_option("--resolution", render.resolution,
                   "Cells of the surfaces along the longest side; default: the shell's own")
        ->check(CLI::Range(0, 65536))
        ->type_name("N");
    options->common.declare(app, "its render model.its -o model.png --view 30,18");
    return [options] { return run(*options); };
}

}  // namespace its::cli
