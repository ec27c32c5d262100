#include "cli/program.h"
#include "its/mesh_file.h"

#include <grp.h>
#include <poll.h>
#include <pty.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <csignal>
#include <cstdlib>
#include <fstream>
#include <sstream>
#include <stdexcept>
#include <utility>

namespace its::cli_test {
namespace fs = std::filesystem;

Workshop::Workshop() {
    std::string pattern = (fs::temp_directory_path() / "its_cli_XXXXXX").string();
    if (mkdtemp(pattern.data()) == nullptr) throw std::runtime_error("no temporary folder");
    folder_ = pattern;
    fs::permissions(folder_, fs::perms::all);  // for run_without_privileges
}

Workshop::~Workshop() {
    std::error_code ignored;
    fs::remove_all(folder_, ignored);
}

std::string Workshop::add(const std::string& name, const Mesh& mesh) const {
    write_mesh(mesh, folder_ / name);
    return path(name);
}

std::string Workshop::add(const std::string& name, const std::string& content) const {
    std::ofstream(folder_ / name, std::ios::binary) << content;
    return path(name);
}

std::vector<std::string> Workshop::names() const {
    std::vector<std::string> names;
    for (const auto& entry : fs::directory_iterator(folder_)) names.push_back(entry.path().filename().string());
    std::sort(names.begin(), names.end());
    return names;
}

std::string content(const fs::path& file) {
    std::ostringstream text;
    text << std::ifstream(file, std::ios::binary).rdbuf();
    return text.str();
}

namespace {

[[noreturn]] void execute(const fs::path& program, const std::vector<std::string>& arguments) {
    std::vector<std::string> words = {"its"};
    words.insert(words.end(), arguments.begin(), arguments.end());
    std::vector<char*> pointers;
    for (std::string& word : words) pointers.push_back(word.data());
    pointers.push_back(nullptr);
    execv(program.c_str(), pointers.data());
    _exit(127);
}

int wait_for(pid_t child) {
    int status = 0;
    waitpid(child, &status, 0);
    return WIFSIGNALED(status) ? 128 + WTERMSIG(status) : WEXITSTATUS(status);
}

/// Reads both until both are closed.
void drain(int out, int error, Result& result) {
    pollfd files[2] = {{out, POLLIN, 0}, {error, POLLIN, 0}};
    std::string* const texts[2] = {&result.out, &result.error};
    while (files[0].fd >= 0 || files[1].fd >= 0) {
        poll(files, 2, -1);
        for (int i = 0; i < 2; ++i) {
            if (files[i].fd < 0 || files[i].revents == 0) continue;
            char buffer[4096];
            const ssize_t count = read(files[i].fd, buffer, sizeof buffer);
            if (count > 0)
                texts[i]->append(buffer, static_cast<std::size_t>(count));
            else
                close(std::exchange(files[i].fd, -1));
        }
    }
}

Result run_as(uid_t user, const fs::path& program, const std::vector<std::string>& arguments) {
    int out[2], error[2];
    if (pipe(out) != 0 || pipe(error) != 0) throw std::runtime_error("no pipe");
    const pid_t child = fork();
    if (child == 0) {
        dup2(out[1], STDOUT_FILENO);
        dup2(error[1], STDERR_FILENO);
        for (const int file : {out[0], out[1], error[0], error[1]}) close(file);
        if (user != geteuid() && (setgroups(0, nullptr) != 0 || setgid(user) != 0 || setuid(user) != 0))
            _exit(126);
        execute(program, arguments);
    }
    close(out[1]);
    close(error[1]);
    Result result;
    drain(out[0], error[0], result);
    result.status = wait_for(child);
    return result;
}

}  // namespace

Result run(const std::vector<std::string>& arguments) {
    return run_as(geteuid(), ITS_PROGRAM, arguments);
}

bool has_command(const std::string& command) {
    return run({command, "--help"}).status == 0;
}

Result run_without_privileges(const std::vector<std::string>& arguments) {
    if (geteuid() != 0) return run(arguments);
    const Workshop place;  // others may be unable to reach the build folder
    fs::copy_file(ITS_PROGRAM, place / "its");
    fs::permissions(place / "its", fs::perms::owner_all | fs::perms::others_read | fs::perms::others_exec);
    return run_as(65534, place / "its", arguments);
}

Result run_on_terminal(const std::vector<std::string>& arguments, bool interrupt) {
    int terminal = -1;
    const pid_t child = forkpty(&terminal, nullptr, nullptr, nullptr);
    if (child < 0) throw std::runtime_error("no terminal");
    if (child == 0) execute(ITS_PROGRAM, arguments);
    Result result;
    char buffer[4096];
    // Reading fails with EIO once the program has closed the terminal.
    for (ssize_t count = 0; (count = read(terminal, buffer, sizeof buffer)) > 0;) {
        result.out.append(buffer, static_cast<std::size_t>(count));
        if (std::exchange(interrupt, false)) kill(child, SIGINT);
    }
    close(terminal);
    result.status = wait_for(child);
    return result;
}

}  // namespace its::cli_test
