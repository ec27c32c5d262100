#include "base/quote.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <functional>

#include "base/file_error.h"
#include "its/base.h"

namespace its {
namespace {

using testing::EndsWith;
using testing::HasSubstr;
using testing::StartsWith;

TEST(Quote, KeepsWhatIsShort) {
    EXPECT_EQ(quotable("abc"), "abc");
    EXPECT_EQ(quotable_end("abc", 3), "abc");
    EXPECT_EQ(quotable("a\nb\x7f"), "a b ");
    EXPECT_EQ(shown("a/b.obj"), "a/b.obj");
    EXPECT_EQ(shown(std::string(longest_name, 'a')), std::string(longest_name, 'a'));
}

TEST(Quote, CutsNoCharacterInTwo) {
    std::string accents;
    for (int i = 0; i < 100; ++i) accents += "é";
    for (std::size_t most = 4; most < 40; ++most) {
        const std::string begin = quotable(accents, most), end = quotable_end(accents, most);
        EXPECT_LE(begin.size(), most);
        EXPECT_LE(end.size(), most);
        EXPECT_EQ(begin.size() % 2, 1) << "whole characters and three points";
        EXPECT_EQ(end.size() % 2, 1);
    }
}

TEST(Quote, ShowsTheEndOfLongNames) {
    const std::string path = std::string(4000, 'a') + "/part.obj";
    EXPECT_EQ(shown(path).size(), longest_name);
    EXPECT_THAT(shown(path), StartsWith("..."));
    EXPECT_THAT(shown(path), EndsWith("a/part.obj"));
}

TEST(Quote, ErrorsOfTheSystemNameFilesShortly) {
    const std::string path = std::string(4000, 'a') + "/part.obj";
    try {
        naming_file(path, "cannot open",
                    [] { throw std::system_error(std::make_error_code(std::errc::filename_too_long)); });
        FAIL();
    } catch (const FileError& error) {
        EXPECT_LT(std::string(error.what()).size(), 300);
        EXPECT_THAT(error.what(), HasSubstr("a/part.obj: cannot open: "));
    }
}

}  // namespace
}  // namespace its
