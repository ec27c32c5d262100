#include "its/query.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <optional>

#include "common.h"
#include "its/distance.h"
#include "its/points.h"
#include "its/shell_file.h"
#include "report.h"

namespace its::cli {
namespace {

enum class Mode { exact, shell };

struct Options {
    CommonOptions common;
    std::string shell, points, output;
    Mode mode = Mode::exact;
    bool winding = false, value = false, gradient = false, closest = false, quick = false;
};

struct Seconds {
    double load = 0, read = 0, index = 0, query = 0, write = 0;
};

/// What is found at the points; the columns refer to the arrays.
struct Answers {
    std::vector<std::int8_t> codes;
    std::vector<double> winding, value, gradient, closest;
    std::vector<PointColumns> columns;
};

std::vector<double> closest_numbers(const std::vector<ClosestPoint>& found) {
    std::vector<double> numbers;
    numbers.reserve(5 * found.size());
    for (const ClosestPoint& c : found) {
        const double triangle = c.triangle == ClosestPoint::no_triangle ? -1 : double(c.triangle);
        numbers.insert(numbers.end(), {c.point.x, c.point.y, c.point.z, c.distance, triangle});
    }
    return numbers;
}

Answers ask(const Options& options, const Query& query, const std::optional<ClosestPoints>& closest,
            const std::vector<Vec3>& points, ProgressBar& bar) {
    const std::size_t n = points.size();
    const int batches =
        1 + int(options.winding) + int(options.value) + int(options.gradient) + int(closest.has_value());
    int batch = 0;
    const auto next = [&] {
        ++batch;
        return options.common.run(bar, double(batch - 1) / batches, double(batch) / batches);
    };
    Answers answers;
    answers.codes.resize(n);
    if (options.mode == Mode::exact)
        query.classify(points, answers.codes, next());
    else
        query.classify_shell(points, answers.codes, next());
    if (options.winding) {
        std::vector<WindingNumber> found(n);
        query.winding_number(points, found, next());
        answers.winding.reserve(2 * n);
        for (const WindingNumber& w : found) answers.winding.insert(answers.winding.end(), {w.value, w.error});
        answers.columns.push_back({{"winding", "winding_error"}, answers.winding});
    }
    if (options.value) {
        answers.value.resize(n);
        query.value(points, answers.value, next());
        answers.columns.push_back({{"value"}, answers.value});
    }
    if (options.gradient) {
        std::vector<Vec3> gradient(n);
        query.gradient(points, gradient, next());
        answers.gradient.reserve(3 * n);
        for (const Vec3& g : gradient) answers.gradient.insert(answers.gradient.end(), {g.x, g.y, g.z});
        answers.columns.push_back({{"gradient_x", "gradient_y", "gradient_z"}, answers.gradient});
    }
    if (closest) {
        std::vector<ClosestPoint> found(n);
        closest->find(points, found, next());
        answers.closest = closest_numbers(found);
        answers.columns.push_back(
            {{"closest_x", "closest_y", "closest_z", "distance", "triangle"}, answers.closest});
    }
    return answers;
}

/// Bytes that a point's answers take.
std::uint64_t answer_bytes(const Options& options) {
    const std::uint64_t number = sizeof(double);
    return 1 + (options.winding ? 4 * number : 0) + (options.value ? number : 0) +
           (options.gradient ? sizeof(Vec3) + 3 * number : 0) +
           (options.closest ? sizeof(ClosestPoint) + 5 * number : 0);
}

/// The codes' names and how many points have each.
std::vector<std::pair<std::string, std::uint64_t>> counts(const Options& options,
                                                          const std::vector<std::int8_t>& codes) {
    std::vector<std::pair<std::string, std::uint64_t>> result;
    const std::pair<const char*, std::int8_t> names[] = {
        {"inside", std::int8_t{-1}},
        {options.mode == Mode::exact ? "on_surface" : "on_shell", std::int8_t{0}},
        {"outside", std::int8_t{1}},
        {"uncertain", std::int8_t(Side::uncertain)},
        {"not_finite", not_finite}};
    for (const auto& [name, code] : names)
        if (code != std::int8_t(Side::uncertain) || options.mode == Mode::exact)
            result.emplace_back(name, std::uint64_t(std::count(codes.begin(), codes.end(), code)));
    return result;
}

void print_query_json(const Options& options, const Answers& answers, const Seconds& seconds) {
    Json json;
    json["file"] = options.output;
    json["points"] = answers.codes.size();
    json["mode"] = options.mode == Mode::exact ? "exact" : "shell";
    for (const auto& [name, count] : counts(options, answers.codes)) json["counts"][name] = count;
    json["columns"] = Json::array({"code"});
    for (const PointColumns& c : answers.columns)
        for (const std::string& name : c.names) json["columns"].push_back(name);
    json["seconds"] = {{"load", seconds.load},
                       {"read", seconds.read},
                       {"index", seconds.index},
                       {"query", seconds.query},
                       {"write", seconds.write}};
    print_json(json);
}

void print_report(const Options& options, const Answers& answers, const Seconds& seconds) {
    Table table;
    table.row("Points", count_text(answers.codes.size()));
    table.row("Sides", options.mode == Mode::exact ? "exact" : "of the shell, by f alone");
    for (auto [name, count] : counts(options, answers.codes)) {
        std::replace(name.begin(), name.end(), '_', ' ');
        table.row("  " + name, count_text(count));
    }
    const double each = 1e9 * seconds.query / double(std::max<std::size_t>(answers.codes.size(), 1));
    table.row("Time", fmt::format("{}, {:.3g} ns a point", seconds_text(seconds.query), each));
    table.row("Loading, index", seconds_text(seconds.load) + ", " + seconds_text(seconds.index));
    table.row("Reading, writing", seconds_text(seconds.read) + ", " + seconds_text(seconds.write));
    table.row("Wrote", options.output);
    table.print();
}

/// Runs fn, and says how long it took.
template <class F>
auto timed(double& seconds, F&& fn) {
    const Stopwatch watch;
    auto result = fn();
    seconds = watch.seconds();
    return result;
}

int run(const Options& options) {
    check_output(options.output, options.points);
    check_output(options.output, options.shell);
    check_points_extension(options.output);
    Seconds seconds;
    const ThinShell shell = timed(seconds.load, [&] {
        const LoadCheck check = options.quick ? LoadCheck::quick : LoadCheck::full;
        return load_shell(options.shell, options.common, check);
    });
    stop_if_interrupted();
    const std::uint64_t file_bytes = size_of(options.points), shell_bytes = size_of(options.shell);
    options.common.require_memory(2 * file_bytes, shell_bytes, "reading the points");
    const std::vector<Vec3> points = timed(seconds.read, [&] { return read_points(options.points); });
    const std::uint64_t index_bytes =
        shell_bytes / 2 + (options.winding ? 80 * shell.info().mesh_triangles : 0);
    options.common.require_memory(answer_bytes(options) * points.size() + index_bytes,
                                  shell_bytes + points.size() * sizeof(Vec3), "answering");
    std::optional<ClosestPoints> closest;
    const Query query = timed(seconds.index, [&] {
        if (options.closest) closest.emplace(shell.mesh_view(), options.common.run());
        return Query(shell);
    });
    stop_if_interrupted();
    ProgressBar bar(options.common.quiet);
    const Answers answers = timed(seconds.query, [&] { return ask(options, query, closest, points, bar); });
    bar.clear();
    stop_if_interrupted();
    const Stopwatch writing;
    write_points(options.output, points, answers.codes, answers.columns);
    seconds.write = writing.seconds();
    if (options.common.json)
        print_query_json(options, answers, seconds);
    else if (!options.common.quiet)
        print_report(options, answers, seconds);
    return done;
}

}  // namespace

Action add_query(CLI::App& app) {
    const auto options = std::make_shared<Options>();
    app.add_option("SHELL", options->shell, "Shell written by its build")->required();
    app.add_option("POINTS", options->points, "Points: .npy .csv .xyz .ply")->required();
    app.add_option("-o,--output", options->output, "File to write: .npy .csv .xyz .ply")
        ->required()
        ->type_name("OUT");
    add_choice<Mode>(app, "--mode", {{"exact", Mode::exact}, {"shell", Mode::shell}}, options->mode,
                     "Sides of the mesh, without tolerance (default), or of the shell,\n"
                     "by f alone")
        ->type_name("MODE");
    app.add_flag("--winding", options->winding,
                 "The winding number and the bound of its error as well: whole and\n"
                 "exact for closed meshes, NaN on the surface");
    app.add_flag("--value", options->value, "f as well");
    app.add_flag("--gradient", options->gradient, "The gradient of f as well");
    app.add_flag("--closest", options->closest,
                 "The closest point of the mesh, its distance and triangle as well");
    app.add_flag("--quick", options->quick,
                 "Do not examine all of the shell's file first: for large ones that are known to be whole");
    options->common.declare(app, "its query model.its points.npy -o sides.npy");
    return [options] { return run(*options); };
}

}  // namespace its::cli
