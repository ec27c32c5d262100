#include "up.h"

#include <fmt/core.h>

#include "report.h"

namespace its::cli {

namespace {

bool is_glb(const std::filesystem::path& path) {
    return CLI::detail::to_lower(path.extension().string()) == ".glb";
}

}  // namespace

void UpOption::declare(CLI::App& app) {
    add_choice<UpAxis>(
        app, "--up", {{"x", UpAxis::x}, {"y", UpAxis::y}, {"z", UpAxis::z}}, up_,
        "The axis that points upwards; nodes of a .glb turn it to y,\nwhich glTF calls up; default: "
        "nothing is turned")
        ->type_name("AXIS");
}

void UpOption::check(const std::filesystem::path& output) const {
    if (up_ != UpAxis::unknown && !is_glb(output))
        throw OptionError(
            fmt::format("--up is for .glb, whose nodes turn what they hold: '{}' keeps the axes of "
                        "its mesh; leave --up out",
                        output.string()));
}

WriteOptions UpOption::writing(const std::filesystem::path& output, const Vec3& origin) const {
    if (is_glb(output) && origin != Vec3{})
        print_message("warning", fmt::format("{}: far from the origin for its size, its place is its nodes' "
                                             "translation, which many programs add with 32 bits, and merge "
                                             "vertices; .ply and .obj keep every digit",
                                             output.string()));
    return {.origin = origin, .up = up_};
}

}  // namespace its::cli
