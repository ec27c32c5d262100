#pragma once

#include <CLI/CLI.hpp>
#include <string>

#include "common.h"

/// The manual page and the shells' completions, written from the definition of the command line itself.
namespace its::cli {

/// its.1, in the man macros.
std::string manual_page(const CLI::App& app);

/// What bash, zsh and fish read from their folders of completions.
std::string bash_completions(const CLI::App& app);
std::string zsh_completions(const CLI::App& app);
std::string fish_completions(const CLI::App& app);

/// Adds the commands `man` and `completions`, which no help lists; the build runs them. The result is what runs
/// the one that was given.
Action add_manual(CLI::App& app);

}  // namespace its::cli
