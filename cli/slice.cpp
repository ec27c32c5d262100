#include <fmt/core.h>

#include <memory>
#include <optional>
#include <string>

#include "common.h"
#include "its/mesh_file.h"
#include "its/picture.h"
#include "its/shell_file.h"
#include "report.h"

namespace its::cli {
namespace {

struct Options {
    CommonOptions common;
    std::string shell, output, mesh;
    SliceOptions slice;
};

std::string plane_text(const SliceOptions& slice) {
    const auto vector = [](const Vec3& v) { return fmt::format("({:.6g}, {:.6g}, {:.6g})", v.x, v.y, v.z); };
    const std::string normal =
        slice.normal ? "normal " + vector(*slice.normal) : std::string(1, "xyz"[slice.axis]);
    return slice.through ? normal + " through " + vector(*slice.through)
                         : fmt::format("{} at {:.6g} of the mesh's extent", normal, slice.at);
}

void add_plane(Json& json, const SliceOptions& slice) {
    const auto vector = [](const Vec3& v) { return Json::array({v.x, v.y, v.z}); };
    if (slice.normal) {
        json["normal"] = vector(*slice.normal);
    } else {
        json["axis"] = std::string(1, "xyz"[slice.axis]);
    }
    if (slice.through) {
        json["through"] = vector(*slice.through);
    } else {
        json["at"] = slice.at;
    }
}

int run(const Options& options) {
    check_output(options.output, options.shell);
    const ThinShell shell = load_shell(options.shell, options.common);
    SliceOptions slice_options = options.slice;
    slice_options.run = options.common.run();
    std::optional<MeshFile> mesh;
    if (!options.mesh.empty()) mesh = read_mesh_with_warnings(options.mesh, options.common);
    if (mesh) slice_options.mesh = mesh->mesh;
    // Values, lines and colours of each pixel, with margins: 15 bytes were measured.
    const std::uint64_t pixels = std::uint64_t(options.slice.size) * std::uint64_t(options.slice.size);
    options.common.require_memory(20 * pixels + 4'000'000,
                                  size_of(options.shell) + (mesh ? memory_of(mesh->mesh) : 0), "the picture");
    const Stopwatch watch;
    const Image image = naming_file(options.shell, [&] { return slice(shell, slice_options); });
    const double seconds = watch.seconds();
    stop_if_interrupted();
    write_png(image, options.output);
    if (options.common.json) {
        Json json;
        json["file"] = options.output;
        json["width"] = image.width;
        json["height"] = image.height;
        add_plane(json, slice_options);
        json["cells"] = slice_options.cells;
        json["seconds"]["slice"] = seconds;
        print_json(json);
    } else if (!options.common.quiet) {
        Table table;
        table.row("Plane", plane_text(slice_options));
        table.row("Time", seconds_text(seconds));
        table.row("Wrote", fmt::format("{}, {} × {} pixels", options.output, image.width, image.height));
        table.print();
    }
    return done;
}

CLI::Option* add_vector(CLI::App& app, const std::string& option, std::optional<Vec3>& value,
                        const std::string& description) {
    const auto parse = [option, &value](const std::string& text) { value = parse_vector(option, text); };
    return app.add_option_function<std::string>(option, parse, description)->type_name("X,Y,Z");
}

}  // namespace

Action add_slice(CLI::App& app) {
    const auto options = std::make_shared<Options>();
    app.add_option("SHELL", options->shell, "Shell written by its build")->required();
    app.add_option("-o,--output", options->output, "Picture to write")->required()->type_name("OUT.png");
    CLI::Option* const axis = add_choice<int>(app, "--axis", {{"x", 0}, {"y", 1}, {"z", 2}},
                                              options->slice.axis, "Normal of the plane, default z")
                                  ->type_name("AXIS");
    add_vector(app, "--normal", options->slice.normal, "Normal of an oblique plane, towards you")
        ->excludes(axis);
    CLI::Option* const at =
        app.add_option("--at", options->slice.at, "Position within the mesh's extent, 0 to 1; default 0.5")
            ->check(CLI::Range(0.0, 1.0))
            ->type_name("RELATIVE");
    add_vector(app, "--through", options->slice.through, "A point of the plane, instead of --at")->excludes(at);
    app.add_option("--mesh", options->mesh, "Draw this mesh's section instead of that of the shell's own")
        ->type_name("MESH");
    app.add_option("--size", options->slice.size, "Pixels of the longer side, 64 to 8192; default 1024")
        ->check(CLI::Range(64, 8192))
        ->type_name("PIXELS");
    app.add_flag("--cells", options->slice.cells, "Draw the octree's cells");
    options->common.declare(app, "its slice model.its -o model.png --axis y --at 0.5");
    return [options] { return run(*options); };
}

}  // namespace its::cli
