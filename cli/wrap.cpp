#include "its/wrap.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <span>
#include <vector>

#include "common.h"
#include "its/mesh_file.h"
#include "length.h"
#include "report.h"
#include "up.h"
#include "weld.h"

namespace its::cli {
namespace {

namespace fs = std::filesystem;

struct Options {
    CommonOptions common;
    std::string mesh, output;
    bool offset = false;  ///< the command is `offset`
    LengthOption clearance, distance, slack;
    std::vector<WrapSide> sides = {WrapSide::outer};
    bool no_measure = false, single = false;
    WeldOption weld;
    UpOption up;
};

struct Written {
    Wrap wrap;
    std::string file;
};

/// OUT-outer.ext for OUT.ext.
fs::path with_side(const fs::path& output, WrapSide side) {
    fs::path path = output;
    path.replace_filename(output.stem().string() + "-" + std::string(name(side)) + output.extension().string());
    return path;
}

/// Refuses an extension that cannot be written before any long work.
void check_extension(const fs::path& output) {
    const std::string extension = CLI::detail::to_lower(output.extension().string());
    for (const char* known : {".obj", ".ply", ".stl", ".off", ".glb"})
        if (extension == known) return;
    throw OptionError(fmt::format("cannot write '{}': the extension must be .obj, .ply, .stl, .off or .glb",
                                  output.string()));
}

/// One file for each side, all or none, or one for both of a .glb.
void write_wraps(const Options& options, std::span<Written> wraps) {
    const fs::path output = options.output;
    const bool glb = CLI::detail::to_lower(output.extension().string()) == ".glb";
    const bool together = glb && wraps.size() > 1;
    std::vector<MeshOutput> files;
    std::vector<NamedMesh> nodes;
    for (Written& written : wraps) {
        const WrapSide side = written.wrap.report.side;
        const fs::path path = wraps.size() == 1 || together ? output : with_side(output, side);
        files.push_back({written.wrap.mesh, path});
        nodes.push_back({std::string(name(side)), written.wrap.mesh});
        written.file = path.string();
    }
    WriteOptions how = options.up.writing(output, wraps[0].wrap.report.origin);
    how.single = options.single;
    if (together)
        write_glb(nodes, output, how);
    else
        write_meshes(files, how);
}

Json wrap_json(const Written& written) {
    const WrapReport& report = written.wrap.report;
    const auto length = [](const std::optional<double>& value) { return value ? Json(*value) : Json(nullptr); };
    Json json;
    json["side"] = name(report.side);
    json["file"] = written.file;
    json["faces"] = written.wrap.mesh.triangles.size();
    json["vertices"] = written.wrap.mesh.vertices.size();
    json["clearance"] = report.clearance;
    json["slack"] = report.slack;
    json["distance_lower"] = report.lowest;
    json["distance_upper"] = report.highest;
    json["distance_to_mesh"] = length(report.to_mesh);
    json["distance_from_mesh"] = length(report.from_mesh);
    json["components"] = report.components;
    json["volume"] = report.volume;
    json["cells"] = report.cells;
    json["passes"] = report.passes;
    json["seconds"] = {{"wrap", report.seconds.wrap}, {"measure", report.seconds.measure}};
    return json;
}

void add_rows(Table& table, const Written& written) {
    const WrapReport& report = written.wrap.report;
    table.row(
        std::string(name(report.side)),
        fmt::format("{} triangles, {} vertices, {} part{}", count_text(written.wrap.mesh.triangles.size()),
                    count_text(written.wrap.mesh.vertices.size()), count_text(report.components),
                    report.components == 1 ? "" : "s"));
    table.row("  distance", fmt::format("{} to {} at every point, proven", lower_bound_text(report.lowest),
                                        upper_bound_text(report.highest)));
    if (report.to_mesh && report.from_mesh)
        table.row("  measured", fmt::format("at most {} to the mesh, and {} from it",
                                            length_text(*report.to_mesh), length_text(*report.from_mesh)));
    table.row("  volume",
              fmt::format("{}{}", length_text(report.volume),
                          report.mesh_volume ? ", the mesh's " + length_text(*report.mesh_volume) : ""));
    table.row("  time", seconds_text(report.seconds.wrap) +
                            (report.to_mesh ? ", measuring " + seconds_text(report.seconds.measure) : ""));
    table.row("  wrote", written.file);
}

void report(const Options& options, const MeshFile& file, const std::vector<Written>& wraps, double read,
            double write) {
    if (options.common.json) {
        const WrapReport& first = wraps[0].wrap.report;
        Json json;
        json["mesh"] = {{"file", options.mesh},
                        {"format", file.format},
                        {"warnings", file.warnings},
                        {"triangles", file.mesh.triangles.size()},
                        {"components", first.mesh_components},
                        {"volume", first.mesh_volume ? Json(*first.mesh_volume) : Json(nullptr)}};
        json["sign"] = name(first.sign);
        json["wraps"] = Json::array();
        double wrapping = 0, measuring = 0;
        for (const Written& written : wraps) {
            json["wraps"].push_back(wrap_json(written));
            wrapping += written.wrap.report.seconds.wrap;
            measuring += written.wrap.report.seconds.measure;
        }
        json["seconds"] = {{"read", read}, {"wrap", wrapping}, {"measure", measuring}, {"write", write}};
        print_json(json);
    } else if (!options.common.quiet) {
        Table table;
        for (const Written& written : wraps) add_rows(table, written);
        table.print();
    }
}

/// An offset is a wrap on the side of its sign.
WrapOptions wrap_options(const Options& options, const Mesh& mesh) {
    WrapOptions wrapping;
    wrapping.clearance = options.clearance.length(mesh);
    if (options.offset) {
        const double distance = options.distance.length(mesh);
        wrapping.clearance = std::abs(distance);
        wrapping.side = distance < 0 ? WrapSide::inner : WrapSide::outer;
    }
    wrapping.slack = options.slack.length(mesh);
    wrapping.coordinates = coordinates_of(options.output, options.single);
    wrapping.measure = !options.no_measure && (options.common.json || !options.common.quiet);
    return wrapping;
}

int run(const Options& options) {
    check_output(options.output, options.mesh);
    check_extension(options.output);
    options.up.check(options.output);
    const Stopwatch reading;
    MeshFile file = read_mesh_with_warnings(options.mesh, options.common);
    const double read = reading.seconds();
    if (options.weld.given())
        file.mesh =
            naming_file(options.mesh, [&] { return weld(file.mesh, options.weld.length(file.mesh)).mesh; });

    ProgressBar bar(options.common.quiet);
    WrapOptions wrapping = wrap_options(options, file.mesh);
    std::vector<WrapSide> sides = options.sides;
    if (options.offset) sides = {wrapping.side};
    std::vector<Written> wraps;
    std::uint64_t held = memory_of(file.mesh);
    for (const WrapSide side : sides) {
        const double count = double(sides.size()), before = double(wraps.size());
        wrapping.side = side;
        wrapping.run = options.common.run(bar, before / count, (before + 1) / count);
        wrapping.max_memory = options.common.memory_beside(held);
        wraps.push_back({naming_file(options.mesh, [&] { return wrap(file.mesh, wrapping); }), ""});
        held += memory_of(wraps.back().wrap.mesh);
    }
    bar.clear();
    stop_if_interrupted();
    for (const Written& written : wraps)
        if (written.wrap.report.empty)
            throw OptionError(fmt::format("{}: the {} wrap is empty, and nothing is written: {}", options.mesh,
                                          name(written.wrap.report.side), written.wrap.report.reason));
    const Stopwatch writing;
    write_wraps(options, wraps);
    report(options, file, wraps, read, writing.seconds());
    return done;
}

void declare_common(CLI::App& app, Options& options, const std::string& example) {
    options.slack.declare(app, "--slack",
                          "How much farther than that points may be: proven; default: 2 % of\n"
                          "that, or 0.1 % of the longest side if it is larger",
                          true);
    app.add_flag(
        "--single", options.single,
        "32-bit coordinates in .ply, .obj and .off too, as .stl and .glb have; what is proven holds for them");
    app.add_flag("--no-measure", options.no_measure, "Do not measure the distances between mesh and result");
    options.weld.declare(app);
    options.up.declare(app);
    options.common.declare(app, example);
}

void declare_files(CLI::App& app, Options& options, const std::string& output) {
    app.add_option("MESH", options.mesh, "Mesh: .obj .stl .ply .off .glb .gltf .3mf")->required();
    app.add_option("-o,--output", options.output, output)->required()->type_name("OUT");
}

}  // namespace

Action add_wrap(CLI::App& app) {
    const auto options = std::make_shared<Options>();
    declare_files(app, *options,
                  "Mesh to write: .obj .stl .ply .off .glb; of both sides: OUT-outer and\n"
                  "OUT-inner, or one .glb with two meshes");
    options->clearance.declare(app, "--clearance",
                               "No point of the wrap is nearer to the mesh than this: proven; mesh\n"
                               "units, or with % of the longest side; default 0: as tight as the slack");
    using Sides = std::vector<WrapSide>;
    add_choice<Sides>(app, "--side",
                      {{"outer", Sides{WrapSide::outer}},
                       {"inner", Sides{WrapSide::inner}},
                       {"both", Sides{WrapSide::outer, WrapSide::inner}}},
                      options->sides, "Around the mesh or inside it, default outer")
        ->type_name("SIDE");
    declare_common(app, *options, "its wrap model.stl -o wrap.stl --clearance 2 --slack 0.1");
    return [options] { return run(*options); };
}

Action add_offset(CLI::App& app) {
    const auto options = std::make_shared<Options>();
    options->offset = true;
    declare_files(app, *options, "Mesh to write: .obj .stl .ply .off .glb");
    options->distance
        .declare(app, "--distance",
                 "Outwards, or inwards if it is negative; no point of the result is nearer to\n"
                 "the mesh: proven; mesh units, or with % of the longest side",
                 LengthOption::Range::any)
        ->required();
    declare_common(app, *options, "its offset model.stl -o thinner.stl --distance -0.5");
    return [options] { return run(*options); };
}

}  // namespace its::cli
