#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdlib>
#include <sstream>

#include "cli/program.h"

/// The manual page and the shells' completions, which the program writes itself.
namespace its::cli_test {
namespace {

using testing::HasSubstr;
using testing::IsEmpty;

bool is_installed(const std::string& program) {
    return std::system(("command -v " + program + " >/dev/null 2>&1").c_str()) == 0;
}

/// Runs a command of the shell; what it prints on both outputs, without the last line's end.
std::string output_of(const Workshop& shop, const std::string& command) {
    const std::string file = shop.path("output");
    EXPECT_EQ(std::system(("{ " + command + "; } >'" + file + "' 2>&1").c_str()), 0)
        << command << content(file);
    std::string text = content(file);
    while (text.ends_with('\n')) text.pop_back();
    return text;
}

/// All long options that a command's help names.
std::vector<std::string> long_options(const std::string& command) {
    std::istringstream help(run({command, "--help"}).out);
    std::vector<std::string> options;
    for (std::string line; std::getline(help, line);) {
        const std::size_t at = line.find("--");
        if (line.starts_with("  -") && at < 8)
            options.push_back(line.substr(at, line.find_first_of(" ,", at) - at));
    }
    return options;
}

const std::vector<std::string> all_commands = {"build", "check", "query", "simplify", "surface", "verify"};

TEST(Manual, HasEveryCommandAndOption) {
    const Result page = run({"man"});
    EXPECT_EQ(page.status, 0);
    EXPECT_THAT(page.error, IsEmpty());
    for (const std::string& command : all_commands) {
        EXPECT_THAT(page.out, HasSubstr(".SS \"its \\&" + command + "\"\n"));
        EXPECT_THAT(long_options(command), testing::SizeIs(testing::Ge(4u)));
        for (std::string option : long_options(command)) {
            for (std::size_t at = 0; (at = option.find('-', at)) != std::string::npos; at += 2)
                option.insert(at, "\\");
            EXPECT_THAT(page.out, HasSubstr("\\fB\\&" + option + "\\fR")) << command;
        }
    }
    EXPECT_THAT(run({"--help"}).out, testing::Not(HasSubstr("completions")));
}

TEST(Manual, IsSetWithoutWarnings) {
    if (!is_installed("man")) GTEST_SKIP() << "man is not installed";
    const Workshop shop;
    const std::string page = shop.add("its.1", run({"man"}).out);
    EXPECT_EQ(output_of(shop, "LC_ALL=C.UTF-8 man --warnings -l '" + page + "' >/dev/null"), "");
    EXPECT_THAT(output_of(shop, "LC_ALL=C.UTF-8 MANWIDTH=80 man -l '" + page + "' | cat"),
                HasSubstr("--depth"));
}

/// What bash offers for these words, the last of which is being written.
std::string bash_offers(const Workshop& shop, const std::string& words) {
    return output_of(shop, "bash -c 'source \"" + shop.path("its.bash") + "\"; COMP_WORDS=(" + words +
                               "); COMP_CWORD=$((${#COMP_WORDS[@]} - 1)); _its; echo \"${COMPREPLY[*]}\"'");
}

TEST(Completions, OfBash) {
    if (!is_installed("bash")) GTEST_SKIP() << "bash is not installed";
    const Workshop shop;
    shop.add("its.bash", run({"completions", "bash"}).out);
    EXPECT_EQ(output_of(shop, "bash -n '" + shop.path("its.bash") + "'"), "");
    EXPECT_EQ(bash_offers(shop, "its bu"), "build");
    EXPECT_THAT(bash_offers(shop, "its \"\""), HasSubstr("simplify"));
    EXPECT_EQ(bash_offers(shop, "its build a.obj --dep"), "--depth");
    EXPECT_THAT(bash_offers(shop, "its build a.obj --sign \"\""),
                HasSubstr("winding generalized even-odd unsigned"));
    EXPECT_EQ(bash_offers(shop, "its build a.obj --sign w"), "winding");
    EXPECT_EQ(bash_offers(shop, "its build a.obj --threads \"\""), "");
    EXPECT_EQ(bash_offers(shop, "its build \"\""), "");  // files, by bash itself
    for (const std::string& command : all_commands)
        for (const std::string& option : long_options(command))
            EXPECT_THAT(bash_offers(shop, "its " + command + " " + option), HasSubstr(option));
}

TEST(Completions, OfZshAndFish) {
    const Workshop shop;
    const std::string zsh = shop.add("_its", run({"completions", "zsh"}).out);
    const std::string fish = shop.add("its.fish", run({"completions", "fish"}).out);
    EXPECT_THAT(content(zsh), HasSubstr("--depth"));
    EXPECT_THAT(content(fish), HasSubstr("-l depth"));
    if (is_installed("zsh")) {
        EXPECT_EQ(output_of(shop, "zsh -n '" + zsh + "'"), "");
    }
    if (is_installed("fish")) {
        EXPECT_EQ(output_of(shop, "fish --no-execute '" + fish + "'"), "");
        EXPECT_THAT(output_of(shop, "fish -c 'source \"" + fish + "\"; complete -C \"its build --sign w\"'"),
                    HasSubstr("winding"));
    }
    EXPECT_EQ(run({"completions", "tcsh"}).status, 2);
}

}  // namespace
}  // namespace its::cli_test
