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
/// are.
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

}  // namespace
}  // namespace its::structure
