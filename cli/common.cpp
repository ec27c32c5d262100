#include "common.h"

#include <fmt/core.h>

#include <array>
#include <atomic>
#include <cctype>
#include <charconv>
#include <cmath>
#include <map>
#include <span>
#include <system_error>

#include "its/memory.h"
#include "its/mesh_file.h"
#include "platform.h"
#include "report.h"

namespace its::cli {

namespace fs = std::filesystem;

OptionError missing_part(const std::string& what, const std::string& part, const std::string& option) {
    return OptionError(fmt::format(
        "{}: this program was built without {}; build it with -DITS_{}=ON, which says what that needs", what,
        part, option));
}

namespace {

std::map<const CLI::Option*, std::vector<std::string>>& all_choices() {
    static std::map<const CLI::Option*, std::vector<std::string>> choices;
    return choices;
}

}  // namespace

std::vector<std::string> choices_of(const CLI::Option& option) {
    const auto found = all_choices().find(&option);
    return found == all_choices().end() ? std::vector<std::string>{} : found->second;
}

void remember_choices(const CLI::Option& option, std::vector<std::string> names) {
    all_choices()[&option] = std::move(names);
}

void CommonOptions::declare(CLI::App& app, const std::string& example) {
    app.add_flag("--json", json, "Print one JSON object on standard output instead of the report");
    app.add_flag("-q,--quiet", quiet, "No report, no progress bar; warnings and errors only");
    app.add_option("--threads", threads, "Number of threads; 0: all. Results do not depend on it")
        ->check(CLI::Range(0, 1024))
        ->type_name("N");
    app.add_option_function<std::string>(
           "--max-memory", [this](const std::string& text) { max_memory = parse_size("--max-memory", text); },
           "Refuse to take more: bytes, or with K, M, G, T (powers of 1000);\n"
           "default: three quarters of what is free")
        ->type_name("SIZE");
    app.footer("Example: " + example);
}

// What the program has resident with the libraries that it loads, before it has read anything: 38 MB on
// Debian 12.
constexpr std::uint64_t program_bytes = 40'000'000;

std::uint64_t CommonOptions::memory_beside(std::uint64_t held) const {
    if (max_memory == 0) return 0;
    if (max_memory <= program_bytes + held)
        throw MemoryError(fmt::format("the program and its input take {} of memory, and --max-memory allows {}",
                                      bytes_text(program_bytes + held), bytes_text(max_memory)));
    return max_memory - program_bytes - held;
}

void CommonOptions::require_memory(std::uint64_t bytes, std::uint64_t held, const std::string& what) const {
    its::require_memory(bytes, memory_beside(held), what, "set --max-memory if there is more");
}

std::uint64_t memory_of(const Mesh& mesh) {
    return mesh.vertices.size() * sizeof(Vec3) + mesh.triangles.size() * sizeof(Triangle);
}

std::uint64_t size_of(const fs::path& path) {
    std::error_code error;
    const std::uint64_t size = fs::file_size(path, error);
    return error ? 0 : size;
}

Run CommonOptions::run(ProgressBar& bar, double begin, double end) const {
    return {.threads = threads, .progress = bar.callback(begin, end)};
}

std::uint64_t parse_size(const std::string& option, const std::string& text) {
    double number = 0;
    const char* const end = text.data() + text.size();
    const auto [stop, error] = std::from_chars(text.data(), end, number);
    double unit = 1;
    const char* rest = stop;
    if (rest != end) {
        const std::size_t power = std::string_view("BKMGT").find(static_cast<char>(std::toupper(*rest)));
        unit = power == std::string_view::npos ? 0 : std::pow(1000.0, double(power));
        ++rest;
    }
    const double bytes = number * unit;
    // 2^63: far above any memory, and exact as a double.
    if (error != std::errc{} || rest != end || !(bytes >= 1) || bytes >= 0x1p63)
        throw CLI::ValidationError(option, "'" + text + "' is no size; write one such as 500M or 2G");
    return static_cast<std::uint64_t>(bytes);
}

namespace {

/// As many finite numbers as `values` holds, with commas between them and nothing else.
bool parse_numbers(const std::string& text, std::span<double> values) {
    const char* at = text.data();
    const char* const end = text.data() + text.size();
    for (std::size_t i = 0; i < values.size(); ++i) {
        const bool last = i + 1 == values.size();
        const auto [stop, error] = std::from_chars(at, end, values[i]);
        if (error != std::errc{} || !std::isfinite(values[i])) return false;
        if (last ? stop != end : stop == end || *stop != ',') return false;
        at = stop + 1;
    }
    return true;
}

}  // namespace

Vec3 parse_vector(const std::string& option, const std::string& text) {
    std::array<double, 3> v;
    if (!parse_numbers(text, v))
        throw CLI::ValidationError(option, "'" + text + "' is no x,y,z; write three numbers such as 1,0,-0.5");
    return {v[0], v[1], v[2]};
}

std::pair<double, double> parse_pair(const std::string& option, const std::string& text) {
    std::array<double, 2> v;
    if (!parse_numbers(text, v))
        throw CLI::ValidationError(option, "'" + text + "' is no pair; write two numbers such as 30,0.5");
    return {v[0], v[1]};
}

MeshFile read_mesh_with_warnings(const fs::path& path, const CommonOptions& common,
                                 const ReadOptions& options) {
    // The file and its mesh, which is at most 2.4 times as large in any format that is not packed ("f 1 2 3
    // 4").
    naming_file(path, [&] { common.require_memory(size_of(path) * 17 / 5, 0, "reading it"); });
    MeshFile file = naming_file(path, [&] { return read_mesh(path, options); });
    for (const std::string& warning : file.warnings) print_message("warning", path.string() + ": " + warning);
    stop_if_interrupted();
    return file;
}

ThinShell load_shell(const fs::path& path, const CommonOptions& options, LoadCheck check) {
    naming_file(path, [&] { options.require_memory(size_of(path), 0, "the shell"); });
    return naming_file(path, [&] { return load(path, {.check = check, .run = options.run()}); });
}

Coordinates coordinates_of(const fs::path& output, bool single) {
    if (CLI::detail::to_lower(output.extension().string()) == ".glb") return Coordinates::single_offset;
    return single || !keeps_doubles(output) ? Coordinates::single : Coordinates::doubles;
}

void check_output(const fs::path& output, const fs::path& input) {
    const fs::path folder = output.has_parent_path() ? output.parent_path() : fs::path(".");
    std::error_code ignored;
    if (!fs::is_directory(folder, ignored))
        throw FileError(
            fmt::format("{}: there is no folder {}; create it first", output.string(), folder.string()));
    if (fs::is_directory(output, ignored))
        throw FileError(fmt::format("{}: this is a folder; give the name of a file", output.string()));
    if (!platform::may_write_into(folder))
        throw FileError(fmt::format("{}: no permission to write into {}; choose another folder",
                                    output.string(), folder.string()));
    if (fs::equivalent(output, input, ignored))
        throw FileError(
            fmt::format("{}: input and output are the same file; give another name to -o", output.string()));
}

namespace {

std::atomic<int> received_signal = 0;
static_assert(std::atomic<int>::is_always_lock_free, "a signal handler may use lock-free atomics only");

}  // namespace

void catch_interruptions() {
    platform::handle_first_interruption([](int signal) { received_signal = signal; });
}

int interruption() {
    return received_signal;
}

void stop_if_interrupted() {
    if (received_signal != 0) throw Cancelled("stopped");
}

ProgressBar::ProgressBar(bool quiet) : enabled_(!quiet && platform::errors_go_to_a_terminal()) {}

Progress ProgressBar::callback(double begin, double end) {
    return [this, begin, end](std::string_view stage, double fraction_of_call) {
        const double fraction = begin + (end - begin) * fraction_of_call;
        if (enabled_) {
            constexpr int width = 30;
            const int full = static_cast<int>(fraction * width);
            fmt::print(stderr, "\r[{:=<{}}{:{}}] {:3.0f} %  {}\033[K", "", full, "", width - full,
                       100 * fraction, stage);
            std::fflush(stderr);
            drawn_ = true;
        }
        return interruption() == 0;
    };
}

void ProgressBar::clear() {
    if (drawn_) fmt::print(stderr, "\r\033[K");
    drawn_ = false;
}

}  // namespace its::cli
