#pragma once

#include <CLI/CLI.hpp>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <string>
#include <utility>
#include <vector>

#include "its/base.h"
#include "its/mesh.h"
#include "its/mesh_file.h"
#include "its/shell_file.h"
#include "its/stopwatch.h"

/// What all commands share: options, reading with warnings, errors that name a file, progress, interruption.
namespace its::cli {

/// Exit statuses of the program; an interrupted one ends with 128 + the signal's number.
enum ExitStatus : int { done = 0, check_failed = 1, bad_input = 2 };

/// Runs a command whose options are parsed, and returns the exit status.
using Action = std::function<int()>;

/// Declares the options of one command on `app`, and returns what runs it. One source file each.
Action add_batch(CLI::App& app);
Action add_build(CLI::App& app);
Action add_check(CLI::App& app);
Action add_info(CLI::App& app);
Action add_offset(CLI::App& app);
Action add_query(CLI::App& app);
Action add_render(CLI::App& app);
Action add_simplify(CLI::App& app);
Action add_slice(CLI::App& app);
Action add_surface(CLI::App& app);
Action add_verify(CLI::App& app);
Action add_verify_cage(CLI::App& app);
Action add_view(CLI::App& app);
Action add_wrap(CLI::App& app);

class ProgressBar;

/// The error of what this program was built without: "WHAT: this program was built without PART; …".
OptionError missing_part(const std::string& what, const std::string& part, const std::string& option);

/// Options that every command has.
struct CommonOptions {
    bool json = false;
    bool quiet = false;
    int threads = 0;               ///< 0: all
    std::uint64_t max_memory = 0;  ///< bytes of the whole process; 0: three quarters of what is free

    /// Declares --json, --quiet, --threads and --max-memory, and adds the example line to the help.
    void declare(CLI::App& app, const std::string& example);

    /// Bytes that a call may take while the program holds `held` bytes of input; 0: three quarters of what is
    /// free.
    /// \throws MemoryError if the program and its input leave nothing
    std::uint64_t memory_beside(std::uint64_t held) const;
    /// \throws MemoryError if `what`, of about `bytes`, is more than memory_beside(held)
    void require_memory(std::uint64_t bytes, std::uint64_t held, const std::string& what) const;

    /// How the library is to run: with that number of threads, on the bar if there is one.
    Run run() const { return {.threads = threads}; }
    /// \param begin, end  where on the bar the call begins and ends
    Run run(ProgressBar& bar, double begin = 0, double end = 1) const;
};

template <class Value>
using Choices = std::vector<std::pair<std::string, Value>>;

/// Values of an enum of the library, by its own names.
template <class Value>
Choices<Value> choices_of(std::initializer_list<Value> values) {
    Choices<Value> choices;
    for (const Value value : values) choices.emplace_back(std::string(name(value)), value);
    return choices;
}

/// The values that an option of add_choice() has; of another option, none.
std::vector<std::string> choices_of(const CLI::Option& option);
/// Tells choices_of() of an option.
void remember_choices(const CLI::Option& option, std::vector<std::string> names);

/// A named choice such as --sign, without distinction of case.
template <class Value>
CLI::Option* add_choice(CLI::App& app, const std::string& option, const Choices<Value>& choices, Value& value,
                        const std::string& description) {
    std::string names;
    std::vector<std::string> list;
    for (const auto& choice : choices) {
        names += (names.empty() ? "" : ", ") + choice.first;
        list.push_back(choice.first);
    }
    const auto choose = [option, choices, names, &value](const std::string& text) {
        for (const auto& choice : choices) {
            if (choice.first != CLI::detail::to_lower(text)) continue;
            value = choice.second;
            return;
        }
        throw CLI::ValidationError(option, "'" + text + "' is none of " + names);
    };
    CLI::Option* const added = app.add_option_function<std::string>(option, choose, description + ": " + names);
    remember_choices(*added, std::move(list));
    return added;
}

/// A vector or point given as x,y,z.
/// \throws CLI::ValidationError naming `option`.
Vec3 parse_vector(const std::string& option, const std::string& text);
/// Two numbers given as a,b.
std::pair<double, double> parse_pair(const std::string& option, const std::string& text);

/// Bytes of a size such as 800, 500M or 2G: K, M, G and T are powers of 1000.
/// \throws CLI::ValidationError naming `option`.
std::uint64_t parse_size(const std::string& option, const std::string& text);

/// Runs fn; an error of the library that does not name `file` gets it in front.
template <class F>
auto naming_file(const std::filesystem::path& file, F&& fn) {
    try {
        return std::forward<F>(fn)();
    } catch (const Cancelled&) {
        throw;
    } catch (const Error& error) {
        const std::string what = error.what();
        // The library shows the end of long names.
        constexpr std::size_t shown = 90;
        const std::string name = file.string();
        if (what.find(name.substr(name.size() - std::min(name.size(), shown))) != std::string::npos) throw;
        throw Error(name + ": " + what);
    }
}

/// Reads a mesh, and prints its warnings to standard error.
/// \throws Error, Cancelled.
MeshFile read_mesh_with_warnings(const std::filesystem::path& path, const CommonOptions& common,
                                 const ReadOptions& options = {});

/// Bytes that a mesh takes.
std::uint64_t memory_of(const Mesh& mesh);
/// Bytes of a file, 0 if it has none; what is wrong with it is said where it is read.
std::uint64_t size_of(const std::filesystem::path& path);

/// Reads a shell.
/// \throws Error that names the file
ThinShell load_shell(const std::filesystem::path& path, const CommonOptions& options,
                     LoadCheck check = LoadCheck::full);

/// Refuses an output that cannot be written, before any long work: a missing folder, a folder in its place, no
/// permission, or the same file as the input.
/// \throws FileError.
void check_output(const std::filesystem::path& output, const std::filesystem::path& input);

/// The numbers that a file of this name keeps: results are made of these, so that what is proven holds for it.
Coordinates coordinates_of(const std::filesystem::path& output, bool single);

/// Thrown by a command that was interrupted after it had written something; what() says what there is.
class StoppedMidway : public Cancelled {
public:
    using Cancelled::Cancelled;
};

/// From now on the first SIGINT or SIGTERM is remembered; a second one kills.
void catch_interruptions();
/// The signal's number, or 0.
int interruption();
/// \throws Cancelled after an interruption. For use between steps that cannot be stopped themselves.
void stop_if_interrupted();

/// A progress bar on standard error if that is a terminal and `quiet` is not set. Its callback also passes on
/// interruptions, with or without a bar.
class ProgressBar {
public:
    explicit ProgressBar(bool quiet);
    ~ProgressBar() { clear(); }
    ProgressBar(const ProgressBar&) = delete;
    ProgressBar& operator=(const ProgressBar&) = delete;

    /// For one of several calls: what goes from 0 to 1 there goes from `begin` to `end` on the bar. Valid as
    /// long as this object.
    Progress callback(double begin = 0, double end = 1);
    void clear();

private:
    bool enabled_, drawn_ = false;
};

}  // namespace its::cli
