#include "its/verify.h"

#include <fmt/core.h>

#include <memory>

#include "common.h"
#include "its/mesh_file.h"
#include "its/shell_file.h"
#include "report.h"

namespace its::cli {
namespace {

struct Options {
    CommonOptions common;
    std::string shell, mesh;
    VerifyOptions verify;
};

void print_verify_json(const VerifyReport& report, const ShellInfo& info) {
    Json json;
    json["passed"] = report.passed();
    json["checks"] = Json::array();
    // Adding 0 turns −0 into 0.
    for (const VerifyCheck& check : report.checks)
        json["checks"].push_back({{"name", check.name},
                                  {"passed", check.passed},
                                  {"complete", check.complete},
                                  {"tested", check.tested},
                                  {"violations", check.violations},
                                  {"worst", check.worst + 0.0},
                                  {"detail", check.detail}});
    json["weld"] = info.weld;
    json["epsilon_inner"] = info.epsilon_inner;
    json["epsilon_outer"] = info.epsilon_outer;
    json["sampled_min"] = report.sampled_min;
    json["sampled_max"] = report.sampled_max;
    json["proven_min"] = report.proven_min;
    json["proven_max"] = report.proven_max;
    json["seconds"]["verify"] = report.seconds.total;
    print_json(json);
}

void print_report(const VerifyReport& report, const ShellInfo& info) {
    std::size_t width = 5;
    for (const VerifyCheck& check : report.checks) width = std::max(width, check.name.size());
    fmt::print("{:<6} {:<{}} {:<6} {:>13} {:>10} {:>12}\n", "", "Check", width, "", "tested", "violations",
               "margin");
    for (const VerifyCheck& check : report.checks) {
        fmt::print("{:<6} {:<{}} {:<6} {:>13} {:>10} {:>12.3g}\n", check.passed ? "pass" : "FAIL", check.name,
                   width, check.complete ? "all" : "sample", count_text(check.tested),
                   count_text(check.violations), check.worst + 0.0);
        if (!check.detail.empty()) fmt::print("       {}\n", check.detail);
    }
    const auto range = [](double low, double high) { return fmt::format("[{:.9g}, {:.9g}]", low, high); };
    Table table;
    if (info.weld > 0)
        table.row("Welded",
                  fmt::format("the mesh, with corners nearer than {:g} made one, as the shell's", info.weld));
    table.row("Shell [ε₁, ε₂]", range(info.epsilon_inner, info.epsilon_outer));
    table.row("f proven on M", range(report.proven_min, report.proven_max));
    table.row("f sampled on M", range(report.sampled_min, report.sampled_max));
    table.row("Time", seconds_text(report.seconds.total));
    table.row("Result", report.passed() ? "all checks passed" : "FAILED");
    table.print();
}

int run(const Options& options) {
    const ThinShell shell = load_shell(options.shell, options.common);
    const MeshFile file = read_mesh_with_warnings(options.mesh, options.common);
    // Trees over the mesh, a table of the shell's cells and what samples find.
    options.common.require_memory(250 * file.mesh.triangles.size() + size_of(options.shell) / 2,
                                  memory_of(file.mesh) + size_of(options.shell), "verifying");
    ProgressBar bar(options.common.quiet);
    VerifyOptions verify_options = options.verify;
    verify_options.run = options.common.run(bar);
    const VerifyReport report =
        naming_file(options.mesh, [&] { return verify(shell, file.mesh, verify_options); });
    bar.clear();
    stop_if_interrupted();
    if (options.common.json)
        print_verify_json(report, shell.info());
    else if (!options.common.quiet)
        print_report(report, shell.info());
    for (const VerifyCheck& check : report.checks)
        if (!check.passed) print_message("failed", fmt::format("{}: {}", check.name, check.detail));
    return report.passed() ? done : check_failed;
}

}  // namespace

Action add_verify(CLI::App& app) {
    const auto options = std::make_shared<Options>();
    app.add_option("SHELL", options->shell, "Shell written by its build")->required();
    app.add_option("MESH", options->mesh, "The mesh that it was built from")->required();
    app.add_option("--samples", options->verify.samples,
                   "Points on the mesh, uniform by area; default 1,000,000")
        ->check(CLI::Range(std::uint64_t{1}, std::uint64_t{1'000'000'000'000}))
        ->type_name("N");
    app.add_option("--grid-samples", options->verify.grid_samples,
                   "Grid points whose values are compared with distances; default 1,000,000")
        ->check(CLI::Range(std::uint64_t{1}, std::uint64_t{1'000'000'000'000}))
        ->type_name("N");
    app.add_flag(
        "--complete", options->verify.complete,
        "Compare all grid points, however many: then no change of a statement of the file goes unseen");
    app.add_option("--seed", options->verify.seed, "Of the random points; default 20240")->type_name("N");
    options->common.declare(app, "its verify model.its model.stl --samples 10000000");
    return [options] { return run(*options); };
}

}  // namespace its::cli
