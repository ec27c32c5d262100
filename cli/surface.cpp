#include <fmt/core.h>

#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "common.h"
#include "its/mesh_file.h"
#include "its/shell_file.h"
#include "its/surface.h"
#ifdef ITS_VDB
#include "its/vdb.h"
#endif
#include "report.h"
#include "up.h"

namespace its::cli {
namespace {

namespace fs = std::filesystem;

struct Options {
    CommonOptions common;
    std::string shell, output;
    std::vector<SurfaceSide> sides = {SurfaceSide::outer};
    bool side_given = false, no_measure = false, single = false;
    SurfaceOptions surface;
    UpOption up;
};

std::string lower_extension(const fs::path& path) {
    return CLI::detail::to_lower(path.extension().string());
}

/// OUT-outer.ext for OUT.ext.
fs::path with_side(const fs::path& output, SurfaceSide side) {
    fs::path path = output;
    path.replace_filename(output.stem().string() + "-" + std::string(name(side)) + output.extension().string());
    return path;
}

/// A surface and the file that it was written to; empty where it was not.
struct Written {
    Surface surface;
    std::string file;
};

/// Refuses an extension that cannot be written before any long work.
void check_extension(const fs::path& output) {
    const std::string extension = lower_extension(output);
    for (const char* known : {".obj", ".ply", ".stl", ".off", ".glb", ".vdb"})
        if (extension == known) return;
    throw OptionError(fmt::format(
        "cannot write '{}': the extension must be .obj, .ply, .stl, .off, .glb or .vdb", output.string()));
}

/// One file for each side, all or none, or one for all of a .glb; empty surfaces are left out.
void write_surfaces(const Options& options, std::span<Written> surfaces) {
    const fs::path output = options.output;
    const bool together = lower_extension(output) == ".glb" && surfaces.size() > 1;
    std::vector<MeshOutput> files;
    std::vector<NamedMesh> nodes;
    Vec3 origin;
    for (Written& written : surfaces) {
        const SurfaceReport& report = written.surface.report;
        if (report.empty) continue;
        const fs::path path = surfaces.size() == 1 || together ? output : with_side(output, report.side);
        files.push_back({written.surface.mesh, path});
        origin = report.origin;  // the same for all sides of a shell
        nodes.push_back({std::string(name(report.side)), written.surface.mesh});
        written.file = path.string();
    }
    if (files.empty()) return;
    WriteOptions how = options.up.writing(output, origin);
    how.single = options.single;
    if (together)
        write_glb(nodes, output, how);
    else
        write_meshes(files, how);
}

Json surface_json(const Written& written, double scale) {
    const SurfaceReport& report = written.surface.report;
    const auto length = [](const std::optional<double>& value) { return value ? Json(*value) : Json(nullptr); };
    Json json;
    json["side"] = name(report.side);
    json["file"] = written.file.empty() ? Json(nullptr) : Json(written.file);
    json["faces"] = written.surface.mesh.triangles.size();
    json["vertices"] = written.surface.mesh.vertices.size();
    json["empty"] = report.empty;
    json["certified"] = report.certified;
    json["reason"] = report.reason;
    json["level"] = report.level;
    json["level_relative"] = report.level / scale;
    json["margin"] = report.margin;
    json["f_min"] = report.lowest;
    json["f_max"] = report.highest;
    json["components"] = report.components;
    json["components_enclosed"] = report.components_enclosed;
    json["cell_width"] = report.cell_width;
    json["cells"] = report.cells;
    json["thickness_wanted"] = report.thickness_wanted > 0 ? Json(report.thickness_wanted) : Json(nullptr);
    json["depth_wanted"] = report.depth_wanted > 0 ? Json(report.depth_wanted) : Json(nullptr);
    json["distance_to_mesh"] = length(report.to_mesh);
    json["distance_from_mesh"] = length(report.from_mesh);
    json["seconds"] = {{"surface", report.seconds.extract}, {"measure", report.seconds.measure}};
    return json;
}

void add_rows(Table& table, const Written& written, double scale) {
    const SurfaceReport& report = written.surface.report;
    const std::string label = std::string(name(report.side));
    if (report.empty) {
        table.row(label, "empty: " + report.reason);
        return;
    }
    table.row(label, fmt::format("{} triangles, {} vertices", count_text(written.surface.mesh.triangles.size()),
                                 count_text(written.surface.mesh.vertices.size())));
    table.row("  level",
              fmt::format("f = {} ({:.6g} relative)", length_text(report.level), report.level / scale));
    table.row("  certified", report.certified ? fmt::format("yes, margin {}", lower_bound_text(report.margin))
                                              : "no: " + report.reason);
    if (report.to_mesh && report.from_mesh)
        table.row("  measured distance",
                  fmt::format("surface to mesh {}, mesh to surface {}", length_text(*report.to_mesh),
                              length_text(*report.from_mesh)));
    table.row("  time", seconds_text(report.seconds.extract) +
                            (report.to_mesh ? ", measuring " + seconds_text(report.seconds.measure) : ""));
    table.row("  wrote", written.file);
}

#ifdef ITS_VDB
constexpr bool has_vdb = true;
#else
constexpr bool has_vdb = false;
struct VdbOptions {
    Run run;
};
void write_vdb(const ThinShell&, const fs::path&, const VdbOptions&) {}
#endif

int write_field(const Options& options, const ThinShell& shell) {
    if (options.side_given || options.surface.level || options.surface.resolution != 0)
        throw OptionError(".vdb has the function f itself: --side, --level and --resolution do not apply");
    ProgressBar bar(options.common.quiet);
    const Stopwatch watch;
    write_vdb(shell, options.output, {.run = options.common.run(bar)});
    bar.clear();
    const double seconds = watch.seconds();
    if (options.common.json) {
        Json json;
        json["file"] = options.output;
        json["file_bytes"] = fs::file_size(options.output);
        json["seconds"]["write"] = seconds;
        print_json(json);
    } else if (!options.common.quiet) {
        Table table;
        table.row("Wrote", fmt::format("{}, {}", options.output, bytes_text(fs::file_size(options.output))));
        table.row("Time", seconds_text(seconds));
        table.print();
    }
    return done;
}

void report(const Options& options, const std::vector<Written>& surfaces, const ThinShell& shell,
            double write) {
    const double scale = shell.info().scale;
    if (options.common.json) {
        Json json;
        json["surfaces"] = Json::array();
        double extraction = 0, measuring = 0;
        for (const Written& written : surfaces) {
            json["surfaces"].push_back(surface_json(written, scale));
            extraction += written.surface.report.seconds.extract;
            measuring += written.surface.report.seconds.measure;
        }
        json["epsilon_inner"] = shell.info().epsilon_inner;
        json["epsilon_outer"] = shell.info().epsilon_outer;
        json["scale"] = scale;
        json["seconds"] = {{"surface", extraction}, {"measure", measuring}, {"write", write}};
        print_json(json);
    } else if (!options.common.quiet) {
        Table table;
        for (const Written& written : surfaces) add_rows(table, written, scale);
        table.print();
    }
}

int run(const Options& options) {
    check_output(options.output, options.shell);
    check_extension(options.output);
    options.up.check(options.output);
    if (lower_extension(options.output) == ".vdb" && !has_vdb)
        throw missing_part(fmt::format("cannot write '{}'", options.output), "OpenVDB", "VDB");
    const ThinShell shell = load_shell(options.shell, options.common);
    stop_if_interrupted();
    if (lower_extension(options.output) == ".vdb") return write_field(options, shell);

    ProgressBar bar(options.common.quiet);
    SurfaceOptions surface_options = options.surface;
    surface_options.measure = !options.no_measure;
    surface_options.coordinates = coordinates_of(options.output, options.single);
    std::vector<Written> surfaces;
    std::uint64_t held = size_of(options.shell);
    for (const SurfaceSide side : options.sides) {
        const double sides = double(options.sides.size()), before = double(surfaces.size());
        surface_options.run = options.common.run(bar, before / sides, (before + 1) / sides);
        surface_options.side = side;
        surface_options.max_memory = options.common.memory_beside(held);
        surfaces.push_back(
            {naming_file(options.shell, [&] { return extract_surface(shell, surface_options); }), ""});
        held += memory_of(surfaces.back().surface.mesh);
    }
    bar.clear();
    stop_if_interrupted();
    for (const Written& written : surfaces)
        if (written.surface.report.empty)
            print_message("warning",
                          fmt::format("{}: the {} surface is empty and is not written: {}", options.shell,
                                      name(written.surface.report.side), written.surface.report.reason));
    const Stopwatch writing;
    write_surfaces(options, surfaces);
    report(options, surfaces, shell, writing.seconds());
    return done;
}

}  // namespace

Action add_surface(CLI::App& app) {
    const auto options = std::make_shared<Options>();
    app.add_option("SHELL", options->shell, "Shell written by its build")->required();
    app.add_option("-o,--output", options->output,
                   "Mesh to write: .obj .ply .stl .off .glb; or f itself: .vdb.\n"
                   "Of both sides: OUT-outer and OUT-inner, or one .glb with two meshes")
        ->required()
        ->type_name("OUT");
    using Sides = std::vector<SurfaceSide>;
    auto* const side = add_choice<Sides>(app, "--side",
                                         {{"outer", Sides{SurfaceSide::outer}},
                                          {"inner", Sides{SurfaceSide::inner}},
                                          {"both", Sides{SurfaceSide::outer, SurfaceSide::inner}},
                                          {"zero", Sides{SurfaceSide::zero}}},
                                         options->sides, "Which level set, default outer");
    side->type_name("SIDE");
    auto* const level = app.add_option("--level", options->surface.level,
                                       "Value of f, instead of the side's own, which is moved until\nthe "
                                       "surface is proven to be off the mesh")
                            ->type_name("VALUE");
    app.add_option("--resolution", options->surface.resolution,
                   "Cells along the longest side; default: the shell's own lattice")
        ->check(CLI::Range(1, 65536))
        ->type_name("N");
    app.add_flag(
        "--single", options->single,
        "32-bit coordinates in .ply, .obj and .off too, as .stl and .glb have; what is proven holds for them");
    app.add_flag("--no-measure", options->no_measure, "Do not measure the distances between mesh and surface");
    options->up.declare(app);
    options->common.declare(app, "its surface model.its -o shells.glb --side both");
    return [options, side, level] {
        options->side_given = !side->empty();
        if (!level->empty() && options->sides.size() > 1)
            throw OptionError("--level gives one surface: choose one --side for it");
        return run(*options);
    };
}

}  // namespace its::cli
