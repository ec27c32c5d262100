#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <sstream>

#include "cli/program.h"
#include "its/version.h"
#include "support/zoo.h"

/// What is refused, and how: exit status 2, nothing on standard output, one line on standard error.
namespace its::cli_test {
namespace {

using testing::HasSubstr;
using testing::IsEmpty;
using testing::StartsWith;

const std::vector<std::string> commands = {"build",    "info",   "check",       "verify", "query",
                                           "simplify", "slice",  "surface",     "render", "view",
                                           "wrap",     "offset", "verify-cage", "batch"};

/// Those that this program was built with.
std::vector<std::string> present_commands() {
    std::vector<std::string> present;
    std::copy_if(commands.begin(), commands.end(), std::back_inserter(present), has_command);
    return present;
}

void expect_refused(const Result& result, const std::string& reason) {
    EXPECT_EQ(result.status, 2);
    EXPECT_THAT(result.out, IsEmpty());
    EXPECT_THAT(result.error, StartsWith("its: error: "));
    EXPECT_THAT(result.error, HasSubstr(reason));
    EXPECT_EQ(std::count(result.error.begin(), result.error.end(), '\n'), 1) << result.error;
}

TEST(Help, ListsTheCommandsThatExist) {
    const Result result = run({"--help"});
    EXPECT_EQ(result.status, 0);
    EXPECT_THAT(result.error, IsEmpty());
    for (const std::string& command : commands) EXPECT_THAT(result.out, HasSubstr("\n  " + command + " "));
}

TEST(Help, OfEachCommandHasAnExampleAndTheCommonOptions) {
    for (const std::string& command : present_commands()) {
        const Result result = run({command, "--help"});
        EXPECT_EQ(result.status, 0);
        for (const std::string& part : {"Example: its " + command, std::string("--json"),
                                        std::string("--threads"), std::string("--quiet")})
            EXPECT_THAT(result.out, HasSubstr(part)) << command;
    }
}

/// The names in the list of subcommands that `its --help` prints.
std::vector<std::string> listed_commands() {
    const std::string out = run({"--help"}).out;
    std::istringstream help(out.substr(out.find("Subcommands:")));
    std::vector<std::string> names;
    std::string line, name;
    std::getline(help, line);
    while (std::getline(help, line) && line.starts_with("  ")) {
        std::istringstream(line) >> name;
        names.push_back(name);
    }
    return names;
}

TEST(Help, IsACommandToo) {
    EXPECT_EQ(run({"help"}).out, run({"--help"}).out);
    for (const std::string& command : present_commands())
        EXPECT_EQ(run({"help", command}).out, run({command, "--help"}).out);
    expect_refused(run({"help", "nonsense"}), "unknown command 'nonsense'");
}

TEST(Help, OfEveryCommandIsInTheGuide) {
    const std::vector<std::string> common = {"-h,--help",  "-o,--output", "--json",
                                             "-q,--quiet", "--threads",   "--max-memory"};
    const std::string guide = content(std::filesystem::path(ITS_SOURCE_DIR) / "docs" / "cli.md");
    const std::vector<std::string> listed = listed_commands();
    EXPECT_THAT(listed, testing::UnorderedElementsAreArray(commands));
    for (const std::string& command : listed) {
        const std::size_t begin = guide.find("\n## its " + command + " ");
        ASSERT_NE(begin, std::string::npos) << command;
        const std::string section = guide.substr(begin, guide.find("\n## ", begin + 1) - begin);
        std::istringstream help(run({command, "--help"}).out);
        for (std::string line; std::getline(help, line);) {
            if (!line.starts_with("  -")) continue;
            const std::string option = line.substr(2, line.find(' ', 2) - 2);
            if (std::ranges::count(common, option) > 0) continue;
            EXPECT_THAT(section, HasSubstr("`" + option)) << command;
        }
    }
}

TEST(Help, Version) {
    EXPECT_EQ(run({"--version"}).out, "its " ITS_VERSION "\n");
    EXPECT_EQ(run({"-V"}).out, "its " ITS_VERSION "\n");
}

TEST(Usage, CommandsAreRequiredAndKnown) {
    expect_refused(run({}), "no command given");
    expect_refused(run({"biuld", "a.obj"}), "unknown command 'biuld'");
    expect_refused(run({"--json"}), "'--json' is no command");
    for (const std::string& command : present_commands()) {
        expect_refused(run({command}), "required");
        if (command != "batch")  // takes the words of another command
            expect_refused(run({command, "a", "b", "c", "d", "-o", "e"}), "see its " + command + " --help");
        expect_refused(run({command, "a", "--colour"}), "--colour");
        expect_refused(run({command, "a", "--threads", "many"}), "--threads");
        expect_refused(run({command, "a", "--threads", "-1"}), "--threads");
    }
}

TEST(Usage, OptionsOutOfRange) {
    const Workshop shop;
    const std::string mesh = shop.add("a.obj", zoo::tetrahedron());
    const std::string out = shop.path("a.its");
    for (const char* depth : {"17", "-1", "3.5", "deep", "", "99999999999999999999"})
        expect_refused(run({"build", mesh, "-o", out, "--depth", depth}), "--depth");
    for (const char* size : {"0", "-5M", "2X", "M", "2GG", "nan", "inf", "1e30", ""})
        expect_refused(run({"build", mesh, "-o", out, "--max-memory", size}), "--max-memory");
    expect_refused(run({"build", mesh, "-o", out, "--sign", "odd"}),
                   "winding, generalized, even-odd, unsigned");
    expect_refused(run({"build", mesh, "-o", out, "--extrema", "x"}), "certified, candidates");
    expect_refused(run({"build", mesh, "-o", out, "--solver", "x"}), "direct, lscg");
    if (has_command("slice")) {
        expect_refused(run({"slice", out, "-o", shop.path("a.png"), "--axis", "w"}), "x, y, z");
        expect_refused(run({"slice", out, "-o", shop.path("a.png"), "--at", "1.5"}), "--at");
        expect_refused(run({"slice", out, "-o", shop.path("a.png"), "--size", "9"}), "--size");
    }
    expect_refused(run({"verify", out, mesh, "--samples", "0"}), "--samples");
    EXPECT_THAT(shop.names(), testing::ElementsAre("a.obj"));
}

TEST(Input, MissingFilesAndFolders) {
    const Workshop shop;
    const std::string mesh = shop.add("a.obj", zoo::tetrahedron());
    const std::string gone = shop.path("gone.obj");
    for (const std::string& wrong : {gone, shop.path("")}) {
        expect_refused(run({"check", wrong}), wrong);
        expect_refused(run({"build", wrong, "-o", shop.path("a.its")}), wrong);
        expect_refused(run({"info", wrong}), wrong);
        expect_refused(run({"verify", wrong, mesh}), wrong);
        if (has_command("slice")) expect_refused(run({"slice", wrong, "-o", shop.path("a.png")}), wrong);
    }
    EXPECT_THAT(shop.names(), testing::ElementsAre("a.obj"));
}

TEST(Input, WithoutPermission) {
    const Workshop shop;
    const std::string mesh = shop.add("a.obj", zoo::tetrahedron());
    EXPECT_EQ(run_without_privileges({"check", mesh}).status, 0);
    std::filesystem::permissions(mesh, std::filesystem::perms::none);
    expect_refused(run_without_privileges({"check", mesh}), mesh);
    expect_refused(run_without_privileges({"build", mesh, "-o", shop.path("a.its")}), mesh);
    expect_refused(run_without_privileges({"info", mesh}), mesh);
}

TEST(Input, NotAMeshNotAShell) {
    const Workshop shop;
    const std::string mesh = shop.add("a.obj", zoo::tetrahedron());
    const std::string text = shop.add("text.its", std::string("its shell? no, only words\n"));
    const std::string empty = shop.add("empty.obj", std::string());
    for (const std::string& wrong : {text, empty, mesh}) expect_refused(run({"info", wrong}), wrong);
    expect_refused(run({"check", text}), text);
    expect_refused(run({"check", empty}), empty);
    expect_refused(run({"verify", text, mesh}), text);
}

TEST(Output, MissingFolderFolderInPlaceOrInput) {
    const Workshop shop;
    const std::string mesh = shop.add("a.obj", zoo::tetrahedron());
    const std::string before = content(mesh);
    const std::string missing = shop.path("no/such/folder/a.its");
    expect_refused(run({"build", mesh, "-o", missing}), missing);
    expect_refused(run({"build", mesh, "-o", shop.path("")}), "folder");
    expect_refused(run({"build", mesh, "-o", mesh}), "same file");
    EXPECT_EQ(content(mesh), before);
    EXPECT_THAT(shop.names(), testing::ElementsAre("a.obj"));
}

TEST(Output, FolderWithoutPermission) {
    const Workshop shop;
    const std::string mesh = shop.add("a.obj", zoo::tetrahedron());
    std::filesystem::create_directory(shop / "closed");
    std::filesystem::permissions(shop / "closed", std::filesystem::perms::owner_read);
    expect_refused(run_without_privileges({"build", mesh, "-o", shop.path("closed/a.its")}), "closed");
}

TEST(Output, ExistingFileIsUntouchedByFailure) {
    const Workshop shop;
    const std::string mesh = shop.add("a.obj", zoo::tetrahedron());
    const std::string broken = shop.add("broken.obj", std::string("v 0 0\nf 1 2 3\n"));
    const std::string shell = shop.add("a.its", std::string("keep me"));
    const std::string picture = shop.add("a.png", std::string("keep me too"));
    expect_refused(run({"build", broken, "-o", shell}), broken);
    expect_refused(run({"build", mesh, "-o", shell, "--depth", "10", "--max-memory", "41M"}), "depth");
    if (has_command("slice")) expect_refused(run({"slice", shell, "-o", picture}), shell);
    EXPECT_EQ(content(shell), "keep me");
    EXPECT_EQ(content(picture), "keep me too");
    EXPECT_THAT(shop.names(), testing::ElementsAre("a.its", "a.obj", "a.png", "broken.obj"));
}

}  // namespace
}  // namespace its::cli_test
