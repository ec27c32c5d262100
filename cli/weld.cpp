#include "weld.h"

#include <fmt/core.h>

namespace its::cli {

void WeldOption::declare(CLI::App& app) {
    length_.declare(app, "--weld",
                    "Corners nearer than this become one first; mesh units, or with % of the\n"
                    "longest side");
}

Json weld_json(const WeldReport& report) {
    return {{"length", report.length},
            {"corners", report.corners},
            {"clusters", report.clusters},
            {"degenerate", report.degenerate},
            {"largest_move", report.largest_move}};
}

std::string weld_text(const WeldReport& report) {
    return fmt::format(
        "{} corners nearer than {:g} became {}, moved by at most {:g}; {} triangles became segments or "
        "points. All else is about the welded mesh",
        count_text(report.corners), report.length, count_text(report.clusters), report.largest_move,
        count_text(report.degenerate));
}

}  // namespace its::cli
