#pragma once

#include <atomic>
#include <string>
#include <thread>
#include <vector>

/// Counts threads as the system does.
namespace its::threads_test {

/// Threads of a process ("self" or its number); 0 if the system does not tell, or there is no such process.
int threads_of(const std::string& process);

/// Watches this process, with a thread that is not counted.
class Watch {
public:
    Watch();
    ~Watch();
    Watch(const Watch&) = delete;
    Watch& operator=(const Watch&) = delete;

    /// The most threads at any time so far.
    int most();

private:
    void look();

    std::atomic<bool> stop_ = false;
    std::atomic<int> most_ = 0;
    std::thread watcher_;
};

/// Runs `its` to its end without output. Returns its exit status and the most threads it had at any time that
/// was looked at.
struct CommandRun {
    int status = 0, most = 0;
};
CommandRun run_command(const std::vector<std::string>& arguments);

/// The names of all commands of `its`, as its help has them.
std::vector<std::string> commands();

}  // namespace its::threads_test
