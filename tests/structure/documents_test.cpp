#include <fmt/core.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <string>
#include <string_view>
#include <vector>

/// The documents (*.md of the root and below docs/) wrap at 112 columns; tables, code and pictures are as they
/// are. Tags of comments, such as \throws, begin their line.
namespace its::structure {
namespace {

namespace fs = std::filesystem;
using testing::ElementsAre;
using testing::IsEmpty;

constexpr std::size_t columns = 112;

/// Characters of a UTF-8 text: bytes that do not continue one.
std::size_t width(std::string_view text) {
    return std::size_t(std::count_if(text.begin(), text.end(),
                                     [](char c) { return (static_cast<unsigned char>(c) & 0xc0) != 0x80; }));
}

/// Whether a line of prose is too wide although it could have been broken in time.
bool breaks_too_late(const std::string& line) {
    const std::size_t indent = line.find_first_not_of(' ');
    return width(line) > columns && width(line.substr(0, line.find(' ', indent))) <= columns;
}

/// Numbers of the lines that do not wrap.
std::vector<int> wide_lines(std::istream& document) {
    std::vector<int> wide;
    bool code = false;
    int number = 0;
    for (std::string line; std::getline(document, line);) {
        ++number;
        const std::string_view text =
            std::string_view(line).substr(std::min(line.find_first_not_of(' '), line.size()));
        if (text.starts_with("```")) code = !code;
        const bool prose = !code && !text.starts_with("|") && !text.starts_with("![");
        if (prose && breaks_too_late(line)) wide.push_back(number);
    }
    return wide;
}

TEST(Documents, Wrap) {
    const fs::path root = ITS_SOURCE_DIR;
    std::vector<fs::path> files;
    for (const auto& entry : fs::directory_iterator(root)) files.push_back(entry.path());
    for (const auto& entry : fs::recursive_directory_iterator(root / "docs")) files.push_back(entry.path());
    std::erase_if(files, [](const fs::path& file) { return file.extension() != ".md"; });
    EXPECT_GT(files.size(), 20u);
    for (const fs::path& file : files) {
        std::ifstream stream(file);
        EXPECT_THAT(wide_lines(stream), IsEmpty())
            << file << " has lines of more than " << columns << " columns";
    }
}

TEST(Documents, OnlyProseMustWrap) {
    const std::string words = std::string(60, 'x') + " " + std::string(60, 'x');
    std::string accents;  // 112 characters in 168 bytes
    for (int i = 0; i < 56; ++i) accents += "é ";
    std::stringstream page("| " + words + " |\n" + std::string(113, 'x') + "\n```\n" + words + "\n```\n" +
                           accents + "\n" + words + "\n");
    EXPECT_THAT(wide_lines(page), ElementsAre(7));
}

/// Numbers of the lines with a tag of a comment that is not at its line's beginning.
std::vector<int> tags_within_lines(std::istream& code) {
    std::vector<int> found;
    int number = 0;
    for (std::string line; std::getline(code, line);) {
        ++number;
        const std::size_t text = line.find_first_not_of(' ');
        if (text == std::string::npos || line.compare(text, 4, "/// ") != 0) continue;
        for (const char* tag : {" \\throws ", " \\param "})
            if (line.find(tag, text + 4) != std::string::npos) found.push_back(number);
    }
    return found;
}

TEST(Comments, TagsBeginTheirLines) {
    const fs::path root = ITS_SOURCE_DIR;
    int files = 0;
    for (const char* folder : {"include", "src", "cli", "python/src", "tests", "tools", "bench"})
        for (const auto& entry : fs::recursive_directory_iterator(root / folder)) {
            if (entry.path().extension() != ".h" && entry.path().extension() != ".cpp") continue;
            ++files;
            std::ifstream stream(entry.path());
            EXPECT_THAT(tags_within_lines(stream), IsEmpty()) << entry.path();
        }
    EXPECT_GT(files, 200);
}

TEST(Comments, TagsAreFound) {
    std::stringstream code(
        "/// \\throws A\n    /// Text. \\throws B\n// \\throws C\n/// \\param x  \\param y  z\n");
    EXPECT_THAT(tags_within_lines(code), ElementsAre(2, 4));
}

}  // namespace
}  // namespace its::structure
