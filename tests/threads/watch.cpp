#include "threads/watch.h"

#include <fcntl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <sstream>

namespace its::threads_test {

namespace {

constexpr auto pause = std::chrono::microseconds(300);

[[noreturn]] void become(const std::vector<std::string>& arguments) {
    std::vector<char*> words = {const_cast<char*>(ITS_PROGRAM)};
    for (const std::string& word : arguments) words.push_back(const_cast<char*>(word.c_str()));
    words.push_back(nullptr);
    const int nowhere = open("/dev/null", O_RDWR);
    dup2(nowhere, STDOUT_FILENO);
    execv(ITS_PROGRAM, words.data());
    _exit(127);
}

}  // namespace

int threads_of(const std::string& process) {
    std::error_code error;
    int count = 0;
    for (std::filesystem::directory_iterator at("/proc/" + process + "/task", error), end; !error && at != end;
         at.increment(error))
        ++count;
    return count;
}

Watch::Watch()
    : watcher_([this] {
          while (!stop_) {
              look();
              std::this_thread::sleep_for(pause);
          }
      }) {}

Watch::~Watch() {
    stop_ = true;
    watcher_.join();
}

void Watch::look() {
    const int now = threads_of("self") - 1;
    for (int before = most_; now > before && !most_.compare_exchange_weak(before, now);) {
    }
}

int Watch::most() {
    look();
    return most_;
}

CommandRun run_command(const std::vector<std::string>& arguments) {
    const pid_t child = fork();
    if (child == 0) become(arguments);
    CommandRun run;
    int status = 0;
    while (waitpid(child, &status, WNOHANG) == 0) {
        run.most = std::max(run.most, threads_of(std::to_string(child)));
        std::this_thread::sleep_for(pause);
    }
    run.status = WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
    return run;
}

std::vector<std::string> commands() {
    std::string text;
    FILE* const pipe = popen("'" ITS_PROGRAM "' --help", "r");
    for (int c = std::fgetc(pipe); c != EOF; c = std::fgetc(pipe)) text += char(c);
    pclose(pipe);
    std::vector<std::string> names;
    std::istringstream lines(text.substr(text.find("Subcommands:")));
    std::string line;
    std::getline(lines, line);
    while (std::getline(lines, line) && line.starts_with("  "))
        if (line[2] != ' ') names.push_back(line.substr(2, line.find(' ', 2) - 2));
    return names;
}

}  // namespace its::threads_test
