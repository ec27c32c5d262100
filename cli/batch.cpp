#include <fmt/core.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <condition_variable>
#include <exception>
#include <fstream>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <set>
#include <thread>

#include "common.h"
#include "histogram.h"
#include "its/memory.h"
#include "manifest.h"
#include "platform.h"
#include "report.h"

/// One command on every mesh, or shell, of a folder, each in a process of its own. The manifest is that of
/// its.batch in Python.
namespace its::cli {
namespace {

namespace fs = std::filesystem;

/// A command that works on one file, and what it writes.
struct Job {
    const char* command;
    bool of_shells;         ///< or of meshes
    const char* extension;  ///< empty: it writes nothing
};
constexpr Job jobs[] = {{"build", false, ".its"}, {"check", false, ""},      {"simplify", false, ".ply"},
                        {"wrap", false, ".ply"},  {"offset", false, ".ply"}, {"surface", true, ".ply"},
                        {"render", true, ".png"}, {"slice", true, ".png"},   {"view", true, ".html"}};

struct Options {
    CommonOptions common;
    std::string folder, output, extension;
    std::vector<std::string> words;
    double seconds = 0;
    bool retry = false;
};

/// A mesh, or shell, by its path within the folder.
struct Work {
    std::string mesh;
    std::uint64_t size = 0;
    std::int64_t modified = 0;  ///< nanoseconds
};

/// All meshes, or all shells, of a folder and those in it but `output`, by name. Links are taken by their own
/// names; what a broken one names is what its command complains of.
std::vector<Work> find_files(const fs::path& folder, const fs::path& output, bool shells) {
    static const std::set<std::string> meshes = {".obj", ".stl", ".ply", ".off", ".glb", ".gltf", ".3mf"};
    if (!fs::is_directory(folder)) throw FileError(fmt::format("{}: there is no such folder", folder.string()));
    const fs::path results = fs::weakly_canonical(output);
    if (results == fs::weakly_canonical(folder))
        throw OptionError(fmt::format(
            "{}: results need a folder of their own, or the next run would take them in", folder.string()));
    std::vector<Work> found;
    std::error_code none;
    for (fs::recursive_directory_iterator it(folder), end; it != end; ++it) {
        if (it->is_directory(none)) {
            if (fs::weakly_canonical(it->path()) == results) it.disable_recursion_pending();
            continue;
        }
        const std::string extension = CLI::detail::to_lower(it->path().extension().string());
        if (!(shells ? extension == ".its" : meshes.contains(extension))) continue;
        if (!it->is_regular_file(none) && !it->is_symlink(none)) continue;
        Work work{.mesh = it->path().lexically_relative(folder).generic_string()};
        if (it->is_regular_file(none)) {
            const auto modified = std::chrono::file_clock::to_sys(it->last_write_time()).time_since_epoch();
            work.size = it->file_size();
            work.modified = std::chrono::duration_cast<std::chrono::nanoseconds>(modified).count();
        }
        found.push_back(std::move(work));
    }
    if (found.empty())
        throw InputError(
            fmt::format("{}: there are no {} in this folder", folder.string(), shells ? "shells" : "meshes"));
    std::sort(found.begin(), found.end(), [](const Work& a, const Work& b) { return a.mesh < b.mesh; });
    return found;
}

const Job& job_of(const Options& options) {
    std::string names;
    for (const std::string& word : options.words)
        if (word == "-h" || word == "--help")
            throw OptionError(
                fmt::format("batch: --help is for one at a time: its help {}", options.words.front()));
    for (const Job& job : jobs) {
        if (options.words.front() == job.command) return job;
        names += fmt::format("{}{}", names.empty() ? "" : ", ", job.command);
    }
    throw OptionError(fmt::format("batch: '{}' is not done with the files of a folder; choose among {}",
                                  options.words.front(), names));
}

/// Each line of a kind that a program of ours printed: "its: KIND: TEXT".
std::vector<std::string> messages(const std::string& printed, const std::string& kind) {
    const std::string start = "its: " + kind + ": ";
    std::vector<std::string> found;
    for (const std::string& line : CLI::detail::split(printed, '\n'))
        if (line.starts_with(start)) found.push_back(line.substr(start.size()));
    return found;
}

class Batch {
public:
    Batch(const Options& options, std::vector<Work> meshes, Manifest& manifest)
        : options_(options),
          job_(job_of(options)),
          meshes_(std::move(meshes)),
          manifest_(manifest),
          program_(platform::this_program().string()),
          words_(fmt::format("its {}", fmt::join(options.words, " ")) + options.extension) {
        if (program_.empty()) throw Error("batch: this system does not say where this program is");
        processes_ = options.common.threads > 0 ? options.common.threads
                                                : std::max(1, int(std::thread::hardware_concurrency()));
        each_ = options.common.memory_beside(0);
        if (each_ == 0) each_ = available_memory().value_or(0) / 4 * 3;
        each_ /= std::uint64_t(processes_);
        for (const Work& work : meshes_)
            if (!is_done(work)) left_.push_back(&work);
    }

    std::uint64_t resumed() const { return meshes_.size() - left_.size(); }
    const std::vector<Work>& meshes() const { return meshes_; }

    /// \throws Cancelled once all processes have ended, if interrupted
    void run(const Progress& progress) {
        const auto report = [&] {
            if (!progress("batch", double(resumed() + written_) / double(meshes_.size()))) stop_ = true;
            return stop_.load();
        };
        std::vector<std::jthread> others;
        others.reserve(std::size_t(processes_) - 1);
        for (int i = 1; i < processes_; ++i)
            others.emplace_back([this] { work([this] { return stop_.load(); }); });
        work(report);
        std::unique_lock lock(mutex_);
        while (ended_ < processes_) {
            changed_.wait_for(lock, std::chrono::milliseconds(100));
            report();
        }
        lock.unlock();
        others.clear();
        if (failure_) std::rethrow_exception(failure_);
        if (stop_) throw Cancelled("stopped by the caller");
    }

private:
    bool is_done(const Work& work) const {
        const Json* const line = manifest_.find(work.mesh);
        if (line == nullptr || line->value("job", "") != words_ ||
            line->value("size", std::uint64_t{0}) != work.size ||
            line->value("modified", std::int64_t{0}) != work.modified)
            return false;
        return !options_.retry || line->value("status", "") == "done";
    }

    /// Of one thread: the next mesh, until there is none.
    /// \param stop  asked while a process runs
    void work(const std::function<bool()>& stop) {
        try {
            while (!stop_) {
                const std::size_t i = next_++;
                if (i >= left_.size()) break;
                const std::optional<Json> line = treat(*left_[i], stop);
                const std::lock_guard lock(mutex_);
                if (line) manifest_.add(left_[i]->mesh, *line), ++written_;
                changed_.notify_one();
            }
        } catch (...) {
            const std::lock_guard lock(mutex_);
            if (!failure_) failure_ = std::current_exception();
            stop_ = true;
        }
        const std::lock_guard lock(mutex_);
        ++ended_;
        changed_.notify_one();
    }

    std::vector<std::string> command(const Work& work) const {
        const fs::path source = fs::path(options_.folder) / work.mesh;
        std::vector<std::string> words = {program_, job_.command, source.string()};
        std::string extension = options_.extension.empty() ? job_.extension : options_.extension;
        if (!extension.empty() && extension.front() != '.') extension.insert(0, 1, '.');
        if (*job_.extension != 0) {
            const fs::path target = fs::path(options_.output) / (work.mesh + extension);
            fs::create_directories(target.parent_path());
            words.insert(words.end(), {"-o", target.string()});
        }
        words.insert(words.end(), options_.words.begin() + 1, options_.words.end());
        words.insert(words.end(), {"--json", "--quiet"});
        const auto given = [&](const char* option) {
            return std::any_of(options_.words.begin(), options_.words.end(), [&](const std::string& word) {
                return word == option || word.starts_with(std::string(option) + "=");
            });
        };
        if (!given("--threads")) words.insert(words.end(), {"--threads", "1"});
        if (!given("--max-memory") && each_ > 0)
            words.insert(words.end(), {"--max-memory", std::to_string(each_)});
        return words;
    }

    /// Its line of the manifest; none if it was stopped.
    std::optional<Json> treat(const Work& work, const std::function<bool()>& stop) const {
        Json line{{"mesh", work.mesh}, {"status", "done"}};
        try {
            const platform::Ended ended = platform::run_program(command(work), options_.seconds, stop);
            if (ended.how == platform::Ended::stopped) return std::nullopt;
            describe(ended, line);
        } catch (const std::exception& error) {  // a folder that cannot be made, for instance
            line["status"] = "failed";
            line["error"] = error.what();
        }
        line["size"] = work.size;
        line["modified"] = work.modified;
        line["job"] = words_;
        return line;
    }

    void describe(const platform::Ended& ended, Json& line) const {
        line["seconds"] = std::round(1e6 * ended.seconds) / 1e6;
        if (ended.peak_bytes > 0) line["peak_bytes"] = ended.peak_bytes;
        const std::vector<std::string> errors = messages(ended.error, "error"),
                                       warnings = messages(ended.error, "warning");
        if (ended.how == platform::Ended::out_of_time) {
            line["status"] = "timeout";
            line["error"] = fmt::format("took longer than {:g} s", options_.seconds);
        } else if (ended.how == platform::Ended::killed) {
            line["status"] = "crashed";
            line["error"] = fmt::format("the process was ended by signal {}", ended.code);
        } else if (ended.code > check_failed) {
            line["status"] = "failed";
            line["error"] = errors.empty() ? fmt::format("exit status {}", ended.code) : errors.back();
        } else if (ended.code == check_failed) {
            line["exit"] = ended.code;
        }
        if (!warnings.empty()) line["warnings"] = warnings;
        const Json result = Json::parse(ended.out, nullptr, false);
        if (result.is_object()) line["result"] = result;
    }

    const Options& options_;
    const Job& job_;
    std::vector<Work> meshes_;
    Manifest& manifest_;
    std::string program_, words_;
    int processes_ = 1;
    std::uint64_t each_ = 0;  ///< bytes that a process may take
    std::vector<const Work*> left_;
    std::atomic<std::size_t> next_ = 0;
    std::atomic<bool> stop_ = false;
    std::mutex mutex_;
    std::condition_variable changed_;
    std::atomic<std::uint64_t> written_ = 0;
    int ended_ = 0;
    std::exception_ptr failure_;
};

/// What became of all meshes.
struct Summary {
    std::map<std::string, std::uint64_t> counts;  ///< by status
    std::vector<std::string> failures;
    std::vector<double> seconds;
    double peak_bytes = 0;
};

Summary summarise(const std::vector<Work>& meshes, const Manifest& manifest) {
    Summary summary;
    for (const Work& work : meshes) {
        const Json& line = *manifest.find(work.mesh);
        const std::string status = line.value("status", "");
        ++summary.counts[status];
        summary.seconds.push_back(line.value("seconds", 0.0));
        summary.peak_bytes = std::max(summary.peak_bytes, line.value("peak_bytes", 0.0));
        if (status != "done")
            summary.failures.push_back(fmt::format("{}: {}: {}", work.mesh, status, line.value("error", "")));
    }
    std::sort(summary.seconds.begin(), summary.seconds.end());
    return summary;
}

/// Seconds, memory, and each number that all results have.
std::vector<Column> columns(const std::vector<Work>& meshes, const Manifest& manifest) {
    std::vector<Column> columns = {{"seconds", {}}, {"peak_bytes", {}}};
    std::uint64_t count = 0;
    const auto add = [&](const std::string& name, const Json& value) {
        if (!value.is_number()) return;
        auto found =
            std::find_if(columns.begin(), columns.end(), [&](const Column& c) { return c.name == name; });
        if (found == columns.end()) found = columns.insert(found, {name, {}});
        found->values.push_back(value);
    };
    for (const Work& work : meshes) {
        const Json& line = *manifest.find(work.mesh);
        if (line.value("status", "") != "done") continue;
        ++count;
        add("seconds", line.value("seconds", Json()));
        add("peak_bytes", line.value("peak_bytes", Json()));
        const Json result = line.value("result", Json::object());
        for (const auto& [name, value] : result.items()) add(name, value);
    }
    std::erase_if(columns, [&](const Column& c) { return count == 0 || c.values.size() != count; });
    return columns;
}

void print_summary(const Options& options, const Batch& batch, const Summary& summary, double seconds) {
    if (options.common.json) {
        print_json({{"meshes", batch.meshes().size()},
                    {"counts", summary.counts},
                    {"done_before", batch.resumed()},
                    {"failures", summary.failures},
                    {"manifest", (fs::path(options.output) / "manifest.jsonl").string()},
                    {"seconds", {{"batch", seconds}}}});
        return;
    }
    if (options.common.quiet) return;
    Table table;
    table.row("Meshes", count_text(batch.meshes().size()));
    for (const auto& [status, count] : summary.counts) table.row("  " + status, count_text(count));
    table.row("Done before", count_text(batch.resumed()));
    table.row("Seconds a mesh",
              fmt::format("median {:.3g}, most {:.3g}", summary.seconds[summary.seconds.size() / 2],
                          summary.seconds.back()));
    if (summary.peak_bytes > 0) table.row("Most memory", bytes_text(std::uint64_t(summary.peak_bytes)));
    table.row("Time", seconds_text(seconds));
    table.row("Wrote", (fs::path(options.output) / "manifest.jsonl").string());
    table.row("", (fs::path(options.output) / "summary.svg").string());
    for (const std::string& failure : summary.failures) table.row("Not done", failure);
    if (!summary.failures.empty()) table.row("", "--retry does these again");
    table.print();
}

void write_text(const fs::path& path, const std::string& text) {
    std::ofstream file(path, std::ios::binary);
    file << text << std::flush;
    if (!file) throw FileError(fmt::format("cannot write '{}'", path.string()));
}

int run(const Options& options) {
    const Stopwatch watch;
    std::vector<Work> meshes = find_files(options.folder, options.output, job_of(options).of_shells);
    std::error_code error;
    fs::create_directories(options.output, error);
    if (error) throw FileError(fmt::format("cannot make the folder '{}': {}", options.output, error.message()));
    Manifest manifest(fs::path(options.output) / "manifest.jsonl");
    Batch batch(options, std::move(meshes), manifest);
    ProgressBar bar(options.common.quiet);
    try {
        batch.run(bar.callback());
    } catch (const Cancelled&) {
        throw StoppedMidway("stopped; the manifest has what is done: the same command goes on from there");
    }
    bar.clear();
    const Summary summary = summarise(batch.meshes(), manifest);
    write_text(fs::path(options.output) / "summary.svg", histogram(columns(batch.meshes(), manifest)));
    print_summary(options, batch, summary, watch.seconds());
    return summary.failures.empty() ? done : check_failed;
}

}  // namespace

Action add_batch(CLI::App& app) {
    const auto options = std::make_shared<Options>();
    app.add_option("FOLDER", options->folder, "Folder with meshes, those of its folders included")->required();
    app.add_option("-o,--output", options->output,
                   "Folder for results: FOLDER/a/b.stl gives OUT/a/b.stl.its. Its manifest.jsonl has a\n"
                   "line for each mesh that is over: the same command again goes on with the others")
        ->required()
        ->type_name("OUT");
    app.add_option("COMMAND", options->words,
                   "After --: what to do with each mesh, such as: build --thickness 0.1%. One of build,\n"
                   "check, simplify, wrap, offset, or, with each shell, surface, render, slice, view;\n"
                   "without its files")
        ->required();
    app.add_option("--seconds", options->seconds, "That each mesh may take; default: any number")
        ->check(CLI::PositiveNumber)
        ->type_name("S");
    app.add_option("--extension", options->extension,
                   "Of results: .its, .ply (simplify, surface, wrap, offset), .png, .html by default")
        ->type_name("EXT");
    app.add_flag("--retry", options->retry, "Try meshes again that failed before");
    options->common.declare(app, "its batch models -o shells --seconds 600 -- build --thickness 0.1%");
    app.get_option("--threads")
        ->description("Processes at a time, of one thread each; 0: as many as processors");
    app.get_option("--max-memory")
        ->description(
            "For all processes together: bytes, or with K, M, G, T (powers of 1000);\n"
            "default: three quarters of what is free");
    return [options] { return run(*options); };
}

}  // namespace its::cli
