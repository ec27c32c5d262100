#include <fmt/core.h>

#include <memory>

#include "common.h"
#include "its/shell_file.h"
#include "report.h"

namespace its::cli {
namespace {

struct Options {
    CommonOptions common;
    std::string shell;
};

int run(const Options& options) {
    const ThinShell shell = load_shell(options.shell, options.common);
    const std::uint64_t file_bytes = std::filesystem::file_size(options.shell);
    if (options.common.json) {
        Json json = shell_json(shell, options.common.run());
        json["file"] = options.shell;
        json["file_bytes"] = file_bytes;
        const auto& hash = shell.info().input_hash;
        json["input_hash"] = fmt::format("{:016x}{:016x}", hash[1], hash[0]);
        print_json(json);
    } else if (!options.common.quiet) {
        Table table;
        table.row("File", fmt::format("{}, {}", options.shell, bytes_text(file_bytes)));
        add_shell_rows(table, shell, options.common.run());
        const Box& root = shell.info().root;
        table.row("Root cube", fmt::format("({:.6g}, {:.6g}, {:.6g}) to ({:.6g}, {:.6g}, {:.6g})", root.min.x,
                                           root.min.y, root.min.z, root.max.x, root.max.y, root.max.z));
        table.print();
    }
    return done;
}

}  // namespace

Action add_info(CLI::App& app) {
    const auto options = std::make_shared<Options>();
    app.add_option("SHELL", options->shell, "Shell written by its build")->required();
    options->common.declare(app, "its info model.its");
    return [options] { return run(*options); };
}

}  // namespace its::cli
