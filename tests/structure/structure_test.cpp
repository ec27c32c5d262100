#include "structure/structure.h"

#include <fmt/core.h>
#include <fmt/ranges.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <initializer_list>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

namespace its::structure {
namespace {

namespace fs = std::filesystem;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

const fs::path root = ITS_SOURCE_DIR;

/// A tree of files that is gone after the test.
class FakeTree {
public:
    FakeTree(std::initializer_list<std::pair<const char*, const char*>> files) {
        for (const auto& [name, text] : files) {
            fs::create_directories((path / name).parent_path());
            std::ofstream(path / name) << text;
        }
    }
    ~FakeTree() { fs::remove_all(path); }
    FakeTree(const FakeTree&) = delete;
    FakeTree& operator=(const FakeTree&) = delete;

    const fs::path path = [] {
        std::string pattern = (fs::temp_directory_path() / "its_structure_XXXXXX").string();
        return fs::path(mkdtemp(pattern.data()));
    }();
};

/// Whether the compiler takes a file that includes this header and nothing else.
bool compiles_alone(const fs::path& include_folder, const std::string& header, const char* messages = "") {
    const std::string command = fmt::format(
        "'{}' -std=c++20 -fsyntax-only -Wall -Wextra -Werror -I'{}' -include '{}' -x c++ /dev/null {}",
        ITS_CXX_COMPILER, include_folder.string(), header, messages);
    return std::system(command.c_str()) == 0;
}

TEST(Structure, LibraryIncludesPointDown) {
    EXPECT_THAT(check_library(root), IsEmpty());
}

/// All names in the verifier's objects, defined there or elsewhere.
std::vector<std::string> verifier_symbols() {
    std::string command = ITS_NM;
    std::ifstream objects(ITS_VERIFY_OBJECTS);
    for (std::string object; std::getline(objects, object);)
        if (!object.empty()) command += fmt::format(" '{}'", object);
    std::vector<std::string> symbols;
    FILE* const pipe = popen(command.c_str(), "r");
    if (pipe == nullptr) return symbols;
    std::string text;
    char buffer[4096];
    for (std::size_t n = 0; (n = std::fread(buffer, 1, sizeof(buffer), pipe)) > 0;) text.append(buffer, n);
    EXPECT_EQ(pclose(pipe), 0);
    std::istringstream words(text);
    for (std::string word; words >> word;)
        if (word.compare(0, 2, "_Z") == 0) symbols.push_back(word);
    return symbols;
}

TEST(Structure, TheVerifierCallsNoCodeOfTheBuilder) {
    const std::vector<std::string> symbols = verifier_symbols();
    EXPECT_GT(symbols.size(), 500u);
    EXPECT_THAT(check_verifier_symbols(symbols), IsEmpty());
}

TEST(Structure, PublicHeadersIncludeOnlyPublicOnes) {
    EXPECT_THAT(check_public_headers(root), IsEmpty());
}

TEST(Structure, ToolsAndExamplesUsePublicHeadersOnly) {
    EXPECT_THAT(check_users(root), IsEmpty());
}

TEST(Structure, OneVersion) {
    EXPECT_THAT(check_version(root), IsEmpty());
}

TEST(Structure, LibraryIsSilent) {
    EXPECT_THAT(check_silence(root), IsEmpty());
}

TEST(Structure, PlatformsAreNamedInOneRoom) {
    EXPECT_THAT(check_platform(root), IsEmpty());
}

TEST(Structure, LibraryDoesNotSpeakOfTheCommandLine) {
    EXPECT_THAT(check_wording(root), IsEmpty());
}

TEST(Structure, EachPublicHeaderCompilesAlone) {
    int headers = 0;
    for (const auto& entry : fs::directory_iterator(root / "include" / "its")) {
        EXPECT_TRUE(compiles_alone(root / "include", "its/" + entry.path().filename().string()))
            << entry.path();
        ++headers;
    }
    EXPECT_GE(headers, 7);
}

TEST(Structure, EachTypeOnceAndInItsNamespace) {
    EXPECT_THAT(check_types(root), IsEmpty());
}

TEST(Structure, PublicHeadersExportWhatTheyDeclare) {
    for (const auto& entry : fs::directory_iterator(root / "include" / "its")) {
        std::ifstream stream(entry.path());
        int exported = 0, other = 0;
        for (std::string line; std::getline(stream, line);) {
            exported += line.starts_with("namespace ITS_API its {") ? 1 : 0;
            other += line.starts_with("namespace its") ? 1 : 0;
        }
        const std::string name = entry.path().filename().string();
        EXPECT_EQ(exported, name == "version.h" || name == "export.h" ? 0 : 1) << name;
        EXPECT_EQ(other, 0) << name << ": what is not within \"namespace ITS_API its {\" stays hidden";
    }
}

// The checker itself: each rule, broken once.

TEST(Checker, AcceptsWhatPointsDown) {
    const FakeTree tree(
        {{"include/its/base.h", ""},
         {"include/its/mesh.h", "#include <vector>\n#include \"its/base.h\"\n"},
         {"src/base/parallel.h", "#include <mutex>\n#include \"its/base.h\"\n"},
         {"src/octree/octree.h", "#include \"its/mesh.h\"\n"},
         {"src/octree/octree.cpp", "#include \"octree/octree.h\"\n#include \"base/parallel.h\"\n"},
         {"cli/common.h", "#include <CLI/CLI.hpp>\n#include \"its/mesh.h\"\n"},
         {"cli/main.cpp", "#include \"common.h\"\n"}});
    EXPECT_THAT(check_library(tree.path), IsEmpty());
    EXPECT_THAT(check_public_headers(tree.path), IsEmpty());
    EXPECT_THAT(check_users(tree.path), IsEmpty());
    EXPECT_THAT(check_silence(tree.path), IsEmpty());
}

TEST(Checker, FindsAnIncludeThatPointsUp) {
    const FakeTree tree(
        {{"src/field/field.h", ""}, {"src/octree/a.cpp", "\n  #  include \"field/field.h\"\n"}});
    EXPECT_THAT(
        check_library(tree.path),
        ElementsAre(HasSubstr("src/octree/a.cpp:2: octree includes \"field/field.h\": field is above it")));
}

TEST(Checker, FindsAPublicHeaderOfAHigherModule) {
    const FakeTree tree{{"include/its/shell.h", ""}, {"src/mesh/a.cpp", "#include \"its/shell.h\"\n"}};
    EXPECT_THAT(check_library(tree.path), ElementsAre(HasSubstr("shell is above it")));
}

TEST(Checker, FindsASibling) {
    const FakeTree tree{{"src/query/query.h", ""}, {"src/surface/a.cpp", "#include \"query/query.h\"\n"}};
    EXPECT_THAT(check_library(tree.path), ElementsAre(HasSubstr("query is beside it")));
}

TEST(Checker, FindsASecondParallelLayer) {
    const FakeTree tree{{"src/base/parallel.h", "#include <oneapi/tbb/parallel_for.h>\n"},
                        {"src/surface/a.cpp", "#include <oneapi/tbb/parallel_sort.h>\n"}};
    EXPECT_THAT(check_library(tree.path), ElementsAre(HasSubstr("the one parallel layer")));
}

TEST(Checker, FindsPlatformsOutsideTheirRoom) {
    const FakeTree tree{{"src/base/platform/a.h", "#include <unistd.h>\n"},
                        {"src/mesh/a.cpp", "#include <sys/mman.h>\n__attribute__((noinline)) int f();\n"},
                        {"cli/platform.cpp", "#include <unistd.h>\n"},
                        {"cli/a.cpp", "\n#include <unistd.h>\n"}};
    EXPECT_THAT(check_platform(tree.path), ElementsAre(HasSubstr("src/mesh/a.cpp:1: names <sys/"),
                                                       HasSubstr("src/mesh/a.cpp:2: names __attribute__"),
                                                       HasSubstr("cli/a.cpp:2: names <uni")));
}

TEST(Checker, FindsIncludesThatAreNotModuleAndFile) {
    const FakeTree tree(
        {{"src/mesh/a.h", ""},
         {"src/mesh/a.cpp", "#include \"a.h\"\n#include \"mesh/../mesh/a.h\"\n#include <its/mesh.h>\n"},
         {"src/stray.cpp", ""}});
    EXPECT_THAT(check_library(tree.path), ElementsAre(HasSubstr("a.cpp:1"), HasSubstr("a.cpp:2"),
                                                      HasSubstr("a.cpp:3"), HasSubstr("no known module")));
}

TEST(Checker, FindsAVerifierThatSharesCodeWithTheBuilder) {
    const FakeTree tree(
        {{"src/geometry/bernstein.h", ""},
         {"src/geometry/vec3.h", ""},
         {"src/verify/a.cpp", "#include \"geometry/vec3.h\"\n#include \"geometry/bernstein.h\"\n"}});
    EXPECT_THAT(check_library(tree.path), ElementsAre(HasSubstr("a.cpp:2: verify includes")));
}

TEST(Checker, FindsCallsOfTheBuilderInTheVerifier) {
    // its::verifier::View::group, its::Stage::advance, its::operator+(its::Vec3, its::Vec3),
    // its::ThinShell::data() const, a lambda of its::verifier::judge, std::vector<its::octree::Level>::size.
    EXPECT_THAT(
        check_verifier_symbols({"_ZNK3its8verifier4View5groupEiRKSt5arrayIjLm3EE", "_ZN3its5Stage7advanceEm",
                                "_ZN3itsplENS_4Vec3ES0_", "_ZN3its5shell6Access4dataERKNS_9ThinShellE",
                                "_ZZN3its8verifier5judgeEvENKUlvE_clEv",
                                "_ZNKSt6vectorIN3its6octree5LevelESaIS2_EE4sizeEv", "main"}),
        IsEmpty());
    EXPECT_THAT(
        check_verifier_symbols({"_ZNK3its6octree5RanksixEm", "_ZN3its6octree13morton_encodeERKSt5arrayIjLm3EE",
                                "_ZN3its5buildERKNS_4MeshERKNS_12BuildOptionsEPNS_10BuildTimesE",
                                "_ZNK3its9ThinShell8gradientERKNS_4Vec3E",
                                "_ZZN3its5signs11apply_signsEvENKUlvE_clEv", "_ZTVN3its5field5FieldE"}),
        ElementsAre(HasSubstr("its::octree::Ranks"), HasSubstr("its::octree::morton_encode"),
                    HasSubstr("its::build"), HasSubstr("its::ThinShell::gradient"),
                    HasSubstr("its::signs::apply_signs"), HasSubstr("its::field::Field")));
}

TEST(Checker, FindsWhatAPublicHeaderMustNotInclude) {
    const FakeTree tree(
        {{"include/its/shell.h", ""},
         {"include/its/mesh.h",
          "#include <Eigen/Core>\n#include <math.h>\n#include \"mesh/x.h\"\n#include \"its/shell.h\"\n"},
         {"src/mesh/x.h", ""}});
    EXPECT_THAT(check_public_headers(tree.path), ElementsAre(HasSubstr("mesh.h:1"), HasSubstr("mesh.h:2"),
                                                             HasSubstr("mesh.h:3"), HasSubstr("mesh.h:4")));
}

TEST(Checker, FindsAToolThatUsesPrivateHeaders) {
    const FakeTree tree{{"src/octree/octree.h", ""},
                        {"cli/a.cpp", "#include \"octree/octree.h\"\n#include <octree/octree.h>\n"},
                        {"examples/b.cpp", "#include \"../src/octree/octree.h\"\n"}};
    EXPECT_THAT(check_users(tree.path),
                ElementsAre(HasSubstr("a.cpp:1"), HasSubstr("a.cpp:2"), HasSubstr("b.cpp:1")));
}

TEST(Checker, FindsASecondVersion) {
    const FakeTree tree{{"include/its/version.h", "#define ITS_VERSION \"3.2.1\"\n"},
                        {"CMakeLists.txt", "project(its VERSION 3.2.1)\n"},
                        {"cli/main.cpp", "// 13.2.1 and 3.2.10 are other numbers\n"}};
    EXPECT_THAT(check_version(tree.path), ElementsAre(HasSubstr("CMakeLists.txt:1: states the version 3.2.1")));
    const FakeTree none{{"include/its/version.h", "\n"}};
    EXPECT_THAT(check_version(none.path), ElementsAre(HasSubstr("no ITS_VERSION")));
}

TEST(Checker, FindsALibraryThatPrints) {
    const FakeTree tree{{"src/mesh/a.cpp", "\nvoid f() { std::cerr << 1; }\n"}};
    EXPECT_THAT(check_silence(tree.path), ElementsAre(HasSubstr("a.cpp:2: uses std::cerr")));
}

TEST(Checker, FindsWordsOfTheCommandLine) {
    const FakeTree tree{{"src/base/a.cpp",
                         "f(\"n\"); --count;  // as --sign\n"
                         "throw Error(\"use --sign\");\n"
                         "throw Error(\"rebuild it with `its build`\");\n"}};
    EXPECT_THAT(check_wording(tree.path), ElementsAre(HasSubstr("a.cpp:2:"), HasSubstr("a.cpp:3:")));
}

TEST(Checker, FindsTwoTypesOfOneName) {
    const FakeTree tree{
        {"include/its/shell.h", "namespace ITS_API its {\nclass Patch;\nstruct Shell {};\n}\n"},
        {"src/query/a.h",
         "namespace its::query {\n/* struct No {}; */ struct Patch {\n struct Inner {};\n};\n}\n"},
        {"src/query/b.cpp",
         "namespace its::query {\nnamespace {\nstruct Local {};\nenum class Local { a };\n}\nclass Patch final "
         "{};\n}\n"},
        {"src/query/c.cpp",
         "namespace its::query {\nnamespace {\nstruct Local {};\n}\nvoid f() { struct Patch {}; }\n}\n"},
        {"src/surface/a.h",
         "namespace its::surface {\ntemplate <class Patch, class Shell>\nstruct Patch {};\n}\n"}};
    EXPECT_THAT(check_types(tree.path),
                ElementsAre(HasSubstr(
                    "b.cpp:6: its::query::Patch is defined a second time; first at src/query/a.h:2")));
}

TEST(Checker, FindsPrivateCodeOutsideItsNamespace) {
    const FakeTree tree{
        {"src/query/a.h", "namespace its {\nint f();\n}\n"},
        {"src/query/b.cpp",
         "namespace its {\nusing namespace query;\nstruct Patch {};\nint g() { return 1; }\n}\n"},
        {"src/verify/c.h", "namespace its::verifier::detail {\nstruct Patch {};\n}\n"},
        {"src/base/d.h", "namespace its {\nstruct Patches {};\n}\n"}};
    EXPECT_THAT(check_types(tree.path),
                ElementsAre(HasSubstr("a.h:1: opens namespace its; private headers of query"),
                            HasSubstr("b.cpp:3: its::Patch is private")));
}

TEST(Checker, FindsAHeaderThatDoesNotCompileAlone) {
    const FakeTree tree{{"its/good.h", "#pragma once\nint f();\n"}, {"its/bad.h", "std::string f();\n"}};
    EXPECT_TRUE(compiles_alone(tree.path, "its/good.h"));
    EXPECT_FALSE(compiles_alone(tree.path, "its/bad.h", "2>/dev/null"));
}

}  // namespace
}  // namespace its::structure
