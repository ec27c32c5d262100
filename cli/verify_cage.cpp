#include "its/verify_cage.h"

#include <fmt/core.h>

#include <algorithm>
#include <memory>

#include "common.h"
#include "its/mesh_file.h"
#include "length.h"
#include "report.h"

namespace its::cli {
namespace {

struct Options {
    CommonOptions common;
    std::string cage, mesh;
    bool inner = false;
    LengthOption clearance, distance;
};

void print_cage_json(const Options& options, const VerifyCageReport& report) {
    Json json;
    json["passed"] = report.passed();
    json["side"] = options.inner ? "inner" : "outer";
    json["checks"] = Json::array();
    for (const VerifyCheck& check : report.checks)
        json["checks"].push_back({{"name", check.name},
                                  {"passed", check.passed},
                                  {"tested", check.tested},
                                  {"violations", check.violations},
                                  {"detail", check.detail}});
    json["distance_lower"] = report.nearest;
    json["distance_upper"] = report.farthest;
    json["components"] = {{"cage", report.cage_components}, {"mesh", report.mesh_components}};
    json["seconds"]["verify"] = report.seconds.total;
    print_json(json);
}

void print_report(const VerifyCageReport& report) {
    std::size_t width = 0;
    for (const VerifyCheck& check : report.checks) width = std::max(width, check.name.size());
    for (const VerifyCheck& check : report.checks)
        fmt::print("{} {:<{}}  {}\n", check.passed ? "pass" : "FAIL", check.name, width, check.detail);
    Table table;
    table.row("Distance", fmt::format("{} to {} at every point of the cage, proven",
                                      lower_bound_text(report.nearest), upper_bound_text(report.farthest)));
    table.row("Time", seconds_text(report.seconds.total));
    table.row("Result", report.passed() ? "all checks passed" : "FAILED");
    table.print();
}

int run(const Options& options) {
    const MeshFile cage = read_mesh_with_warnings(options.cage, options.common),
                   mesh = read_mesh_with_warnings(options.mesh, options.common);
    // Copies, edges and corners sorted, boxes.
    options.common.require_memory(300 * (cage.mesh.triangles.size() + mesh.mesh.triangles.size()),
                                  memory_of(cage.mesh) + memory_of(mesh.mesh), "verifying");
    ProgressBar bar(options.common.quiet);
    VerifyCageOptions verifying;
    verifying.inner = options.inner;
    if (options.clearance.given()) verifying.clearance = options.clearance.length(mesh.mesh);
    if (options.distance.given()) verifying.distance = options.distance.length(mesh.mesh);
    verifying.run = options.common.run(bar);
    const VerifyCageReport report =
        naming_file(options.cage, [&] { return verify_cage(cage.mesh, mesh.mesh, verifying); });
    bar.clear();
    stop_if_interrupted();
    if (options.common.json)
        print_cage_json(options, report);
    else if (!options.common.quiet)
        print_report(report);
    for (const VerifyCheck& check : report.checks)
        if (!check.passed) print_message("failed", fmt::format("{}: {}", check.name, check.detail));
    return report.passed() ? done : check_failed;
}

}  // namespace

Action add_verify_cage(CLI::App& app) {
    const auto options = std::make_shared<Options>();
    const std::string formats = ".obj .stl .ply .off .glb .gltf .3mf";
    app.add_option("CAGE", options->cage, "Cage or wrap, whoever made it: " + formats)->required();
    app.add_option("MESH", options->mesh, "The mesh that it is to enclose: " + formats)->required();
    add_choice<bool>(app, "--side", {{"outer", false}, {"inner", true}}, options->inner,
                     "Around the mesh or inside it, default outer")
        ->type_name("SIDE");
    options->clearance.declare(app, "--clearance",
                               "No point of the cage may be nearer to the mesh; mesh units, or with % of\n"
                               "the longest side");
    options->distance.declare(app, "--distance", "None may be farther", LengthOption::Range::positive);
    options->common.declare(app, "its verify-cage wrap.stl model.stl --clearance 2 --distance 2.1");
    return [options] { return run(*options); };
}

}  // namespace its::cli
