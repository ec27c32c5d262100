#include "platform.h"

#include <fmt/core.h>

#include <cerrno>
#include <chrono>
#include <csignal>
#include <cstdio>
#include <cstring>
#include <thread>

#include "its/base.h"

#if __has_include(<unistd.h>) && !defined(ITS_PLAIN)
#include <fcntl.h>
#include <sys/file.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>
#if defined(__linux__)
#include <sys/prctl.h>
#endif
#define ITS_HAS_POSIX 1
#else
#define ITS_HAS_POSIX 0
#endif

namespace its::cli::platform {

#if ITS_HAS_POSIX

bool errors_go_to_a_terminal() {
    return isatty(STDERR_FILENO) != 0;
}

bool may_write_into(const std::filesystem::path& folder) {
    return access(folder.c_str(), W_OK) == 0;
}

void handle_first_interruption(void (*handler)(int)) {
    struct sigaction action = {};
    action.sa_handler = handler;
    action.sa_flags = static_cast<int>(SA_RESETHAND | SA_RESTART);
    for (const int signal : {SIGINT, SIGTERM}) sigaction(signal, &action, nullptr);
}

std::filesystem::path this_program() {
    std::error_code none;
    return std::filesystem::read_symlink("/proc/self/exe", none);
}

namespace {

/// Not handed to programs that are started.
void keep(int descriptor) {
    fcntl(descriptor, F_SETFD, FD_CLOEXEC);
}

/// A file without a name, which a program writes and we read.
class Printed {
public:
    Printed() : file_(std::tmpfile(), &std::fclose) {
        if (!file_) throw Error(fmt::format("a temporary file cannot be made: {}", std::strerror(errno)));
        keep(number());
    }

    int number() const { return fileno(file_.get()); }  // which no other program gets but as its own output

    std::string text() const {
        std::string text;
        char part[1 << 14];
        std::rewind(file_.get());
        for (std::size_t n; (n = std::fread(part, 1, sizeof part, file_.get())) > 0;) text.append(part, n);
        return text;
    }

private:
    std::shared_ptr<std::FILE> file_;
};

/// In the new process: only what may follow fork() in a program of several threads.
[[noreturn]] void become(char* const* words, int out, int error, pid_t parent) {
    setpgid(0, 0);  // the terminal's signals are for the parent
#if defined(__linux__)
    prctl(PR_SET_PDEATHSIG, SIGKILL);
    if (getppid() != parent) _exit(127);
#else
    static_cast<void>(parent);
#endif
    for (const int signal : {SIGINT, SIGTERM}) std::signal(signal, SIG_DFL);
    dup2(open("/dev/null", O_RDONLY), STDIN_FILENO);
    dup2(out, STDOUT_FILENO);
    dup2(error, STDERR_FILENO);
    execv(words[0], words);
    _exit(127);
}

}  // namespace

Ended run_program(const std::vector<std::string>& words, double seconds, const std::function<bool()>& stop) {
    using Clock = std::chrono::steady_clock;
    std::vector<char*> pointers;
    pointers.reserve(words.size() + 1);
    for (const std::string& word : words) pointers.push_back(const_cast<char*>(word.c_str()));
    pointers.push_back(nullptr);
    std::signal(SIGCHLD,
                SIG_DFL);  // who ignores it, as a parent may have made us do, is not told how children end
    const Printed out, error;
    const auto start = Clock::now();
    const auto spent = [&] { return std::chrono::duration<double>(Clock::now() - start).count(); };
    const pid_t parent = getpid(), child = fork();
    if (child < 0) throw Error(fmt::format("a program cannot be started: {}", std::strerror(errno)));
    if (child == 0) become(pointers.data(), out.number(), error.number(), parent);

    Ended ended;
    int status = 0;
    rusage usage = {};
    auto pause = std::chrono::microseconds(200);
    for (pid_t found; (found = wait4(child, &status, WNOHANG, &usage)) != child;) {
        if (found < 0 && errno != EINTR)
            throw Error(fmt::format("how a program ended is not known: {}", std::strerror(errno)));
        const bool late = seconds > 0 && spent() > seconds;
        if (late || stop()) {
            ended.how = late ? Ended::out_of_time : Ended::stopped;
            kill(-child, SIGKILL);
            while (wait4(child, &status, 0, &usage) < 0 && errno == EINTR) {
            }
            break;
        }
        std::this_thread::sleep_for(pause);
        pause = std::min(pause + pause / 8, std::chrono::microseconds(20'000));  // an eighth of its time late
    }
    ended.seconds = spent();
    ended.peak_bytes = 1024 * std::uint64_t(usage.ru_maxrss);
    ended.out = out.text();
    ended.error = error.text();
    if (ended.how == Ended::exited && WIFSIGNALED(status)) ended.how = Ended::killed;
    ended.code = WIFEXITED(status) ? WEXITSTATUS(status) : WTERMSIG(status);
    return ended;
}

FileHold::FileHold(const std::filesystem::path& path)
    : file_(std::fopen(path.c_str(), "ab"), [](void* file) {
          if (file != nullptr) std::fclose(static_cast<std::FILE*>(file));
      }) {
    if (!file_) throw FileError(fmt::format("cannot write '{}': {}", path.string(), std::strerror(errno)));
    keep(fileno(static_cast<std::FILE*>(file_.get())));
    held_ = flock(fileno(static_cast<std::FILE*>(file_.get())), LOCK_EX | LOCK_NB) == 0;
}

#else

std::filesystem::path this_program() {
    return {};
}

Ended run_program(const std::vector<std::string>&, double, const std::function<bool()>&) {
    throw Error("this system has no way to run other programs that this one knows");
}

FileHold::FileHold(const std::filesystem::path&) {}

bool errors_go_to_a_terminal() {
    return false;
}

bool may_write_into(const std::filesystem::path&) {
    return true;
}

void handle_first_interruption(void (*handler)(int)) {
    for (const int signal : {SIGINT, SIGTERM}) std::signal(signal, handler);
}

#endif

}  // namespace its::cli::platform
