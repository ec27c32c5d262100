#include "platform.h"

#include <csignal>

#if __has_include(<unistd.h>) && !defined(ITS_PLAIN)
#include <unistd.h>
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

#else

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
