#include <fmt/core.h>
#include <algorithm>

#include <CLI/CLI.hpp>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <exception>
#include <new>
#include <string>
#include <string_view>
#include <vector>

#include "common.h"
#include "its/version.h"
#include "manual.h"
#include "report.h"

namespace {

using namespace its::cli;

struct Command {
    const char* name;
    const char* summary;
    Action (*add)(CLI::App&);
};

#if !defined ITS_PICTURE || !defined ITS_PAGE
/// In place of a command whose part this program was built without: takes any words and says so.
Action add_missing(CLI::App& app, const std::string& part, const std::string& option) {
    app.set_help_flag();
    app.allow_extras();
    return [command = app.get_name(), part, option]() -> int { throw missing_part(command, part, option); };
}
#endif
#ifndef ITS_PICTURE
Action add_missing_picture(CLI::App& app) {
    return add_missing(app, "pictures", "PICTURE");
}
constexpr auto add_render = add_missing_picture, add_slice = add_missing_picture;
#endif
#ifndef ITS_PAGE
Action add_view(CLI::App& app) {
    return add_missing(app, "pages", "PAGE");
}
#endif

constexpr Command commands[] = {
    {"batch", "Do one command with every mesh of a folder, resumable, each in a process of its own", add_batch},
    {"build", "Build the implicit thin shell of a mesh", add_build},
    {"info", "Show what a shell holds, and how it was built", add_info},
    {"check", "Report the defects of a mesh, and which sign rule would be chosen", add_check},
    {"query", "Tell on which side of a mesh points are, and f there", add_query},
    {"verify", "Check the promises of a shell against its mesh, independently of the builder", add_verify},
    {"render", "Draw mesh, inner and outer surface side by side and cut open", add_render},
    {"simplify", "Simplify a mesh, with a proven bound on the error", add_simplify},
    {"slice", "Draw a shell's function on a plane", add_slice},
    {"surface", "Write the surfaces that wrap the mesh inside and outside, or any level set", add_surface},
    {"wrap", "Wrap a mesh in a surface at a proven distance, outside or inside", add_wrap},
    {"offset", "Move the surface of a mesh outwards or inwards by a proven distance", add_offset},
    {"verify-cage", "Check that a surface encloses a mesh, whoever made it, and how far away it is",
     add_verify_cage},
    {"view", "Write a page that shows a shell in a browser", add_view},
};

std::string command_names() {
    std::string names;
    for (const Command& command : commands)
        names += fmt::format("{}{}", names.empty() ? "" : ", ", command.name);
    return names;
}

bool is_command(const std::string& word) {
    for (const Command& command : commands)
        if (word == command.name) return true;
    return false;
}

/// The first word that looks like a long option and is none of the command's, or nothing.
std::string unknown_option(const CLI::App& command, int argc, char** argv) {
    for (int i = 2; i < argc; ++i) {
        std::string word = argv[i];
        word.resize(std::min(word.size(), word.find('=')));
        if (word.size() > 2 && word.compare(0, 2, "--") == 0 && command.get_option_no_throw(word) == nullptr)
            return word;
    }
    return "";
}

/// Prints a usage error in one line, or the help that was asked for.
int finish_parsing(const CLI::App& app, const CLI::ParseError& error, int argc, char** argv) {
    if (error.get_exit_code() == static_cast<int>(CLI::ExitCodes::Success)) return app.exit(error);
    const std::string word = argc > 1 ? argv[1] : "";
    if (is_command(word)) {
        // CLI11 would first complain about what a misspelled option leaves missing.
        const std::string unknown = unknown_option(*app.get_subcommand(word), argc, argv);
        print_message("error", fmt::format("{} (see its {} --help)",
                                           unknown.empty() ? error.what() : "unknown option " + unknown, word));
    } else if (word.empty() || word.front() == '-') {
        print_message("error", fmt::format("{}; the first word is a command: {} (see its --help)",
                                           word.empty() ? "no command given" : "'" + word + "' is no command",
                                           command_names()));
    } else {
        print_message(
            "error", fmt::format("unknown command '{}'; there are {} (see its --help)", word, command_names()));
    }
    return bad_input;
}

/// "its help COMMAND" as "its COMMAND --help", "its help" as "its --help".
std::vector<char*> without_help_command(int argc, char** argv) {
    static char help[] = "--help";
    std::vector<char*> words(argv, argv + argc);
    if (argc < 2 || std::string_view(words[1]) != "help") return words;
    words.erase(words.begin() + 1);
    words.push_back(help);
    return words;
}

int parse_and_run(int argc, char** argv) {
    CLI::App app(
        "Implicit thin shells: a function f and two numbers with ε₁ ≤ f ≤ ε₂, proven, on all of a mesh.");
    app.name("its");
    app.set_help_flag("-h,--help", "Print this help and exit");
    app.set_version_flag("-V,--version", "its " ITS_VERSION, "Print the version and exit");
    app.require_subcommand(1);
    app.get_formatter()->column_width(34);
    app.footer(
        "Lengths are in mesh units. Exit status: 0 done, 1 a check failed, 2 bad usage or input.\n"
        "Example: its build model.stl -o model.its");
    std::vector<std::pair<CLI::App*, Action>> runs;
    for (const Command& command : commands) {
        CLI::App* const sub = app.add_subcommand(command.name, command.summary);
        runs.emplace_back(sub, command.add(*sub));
    }
    const Action run_manual = add_manual(app);
    try {
        if (argc > 1 && argv[1][0] != '-' &&
            app.get_subcommands([&](const CLI::App* sub) { return sub->get_name() == argv[1]; }).empty())
            throw CLI::ExtrasError("its", {argv[1]});  // also where --help follows
        app.parse(argc, argv);
    } catch (const CLI::ParseError& error) {
        return finish_parsing(app, error, argc, argv);
    }
    for (const auto& [sub, run] : runs)
        if (sub->parsed()) return run();
    return run_manual();
}

/// What was printed may still fail to arrive, on a full disk for instance.
int flush_output(int status) {
    if (std::fflush(stdout) == 0 && std::ferror(stdout) == 0) return status;
    print_message("error", fmt::format("standard output: {}", std::strerror(errno)));
    return bad_input;
}

}  // namespace

int main(int argc, char** argv) {
    catch_interruptions();
    try {
        std::vector<char*> words = without_help_command(argc, argv);
        const int status = parse_and_run(int(words.size()), words.data());
        // Files were renamed before the signal was looked at: whoever sent it must know that they are new.
        if (interruption() != 0)
            print_message("warning", "the interruption came too late: everything is done and written");
        return flush_output(status);
    } catch (const its::Cancelled& error) {
        const auto* const midway = dynamic_cast<const StoppedMidway*>(&error);
        print_message("error", midway != nullptr ? midway->what() : "stopped; nothing was written");
        return interruption() != 0 ? 128 + interruption() : bad_input;
    } catch (const its::Error& error) {
        print_message("error", error.what());
    } catch (const std::bad_alloc&) {
        print_message("error",
                      "out of memory: less was free than the estimate said; --max-memory sets a limit");
    } catch (const std::exception& error) {
        print_message("error", fmt::format("internal error: {}; please report it", error.what()));
    }
    return bad_input;
}
