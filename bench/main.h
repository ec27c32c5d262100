#pragma once

#include <fmt/format.h>

#include <cstdio>
#include <exception>
#include <filesystem>
#include <stdexcept>
#include <string_view>

#include "its/base.h"

/// What the main() of every benchmark and tool does.
namespace its::bench {

/// An option that the program does not know.
/// \throws OptionError
[[noreturn]] inline void refuse(std::string_view option) {
    throw OptionError(fmt::format("'{}' is no option; see --help", option));
}

/// run(argc, argv) → exit status. --help prints the usage and returns 0; without arguments, and for what is
/// thrown, one line goes to standard error, and 2 is returned.
template <class Run>
int guarded(int argc, char** argv, std::string_view usage, Run&& run) {
    if (argc == 2 && std::string_view(argv[1]) == "--help") {
        fmt::print("usage: {}\n", usage);
        return 0;
    }
    if (argc < 2) {
        fmt::print(stderr, "usage: {}\n", usage);
        return 2;
    }
    const auto fail = [&](std::string_view what) {
        fmt::print(stderr, "{}: error: {}\n", std::filesystem::path(argv[0]).filename().string(), what);
        return 2;
    };
    try {
        return run(argc, argv);
    } catch (const std::invalid_argument&) {  // of std::stoi() and the like
        return fail("a number was expected; see --help");
    } catch (const std::exception& error) {
        return fail(error.what());
    }
}

}  // namespace its::bench
