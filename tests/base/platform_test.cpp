#include <fmt/format.h>
#include <gtest/gtest.h>

#include <fstream>
#include <iterator>
#include <string>
#include <string_view>
#include <system_error>

#include "base/platform/file.h"

namespace its::platform {
namespace {

namespace fs = std::filesystem;

struct Plain {
    using Input = plain::InputHandle;
    using Output = plain::OutputHandle;
};
struct Best {
    using Input = InputHandle;
    using Output = OutputHandle;
};

/// What must hold of files with and without POSIX.
template <class Handles>
class FileTest : public testing::Test {
protected:
    void SetUp() override { fs::create_directories(folder_); }
    void TearDown() override { fs::remove_all(folder_); }

    static void put(typename Handles::Output& file, std::string_view text) {
        file.write(std::as_bytes(std::span(text)));
    }
    static std::string get(const fs::path& path) {
        std::ifstream in(path, std::ios::binary);
        return {std::istreambuf_iterator<char>(in), {}};
    }
    template <class F>
    static std::error_code error_of(F&& call) {
        try {
            call();
        } catch (const std::system_error& error) {
            return error.code();
        }
        return {};
    }

    const fs::path folder_ = fs::temp_directory_path() / fmt::format("its-platform-{}", process_number());
};

using Both = testing::Types<Plain, Best>;
class Names {
public:
    template <class T>
    static std::string GetName(int) {  // NOLINT(readability-identifier-naming): GoogleTest's
        return std::is_same_v<T, Plain> ? "Plain" : "Best";
    }
};
TYPED_TEST_SUITE(FileTest, Both, Names);

TYPED_TEST(FileTest, WritesMovesAndReads) {
    const fs::path from = this->folder_ / "from", to = this->folder_ / "to";
    std::ofstream(to) << "old";
    {
        typename TypeParam::Output file(from);
        this->put(file, "hello ");
        this->put(file, "world");
        file.flush();
        EXPECT_EQ(this->get(to), "old");
        file.move(from, to);
    }
    EXPECT_FALSE(fs::exists(from));
    EXPECT_EQ(this->get(to), "hello world");

    const typename TypeParam::Input file(to);
    EXPECT_EQ(file.size(), 11u);
    std::string text(20, '.');
    EXPECT_EQ(file.read(std::as_writable_bytes(std::span(text).first(5))), 5u);
    EXPECT_EQ(file.read(std::as_writable_bytes(std::span(text).subspan(5))), 6u);
    EXPECT_EQ(file.read(std::as_writable_bytes(std::span(text))), 0u);
    EXPECT_EQ(text, "hello world.........");
    if (const auto map = file.map()) {
        EXPECT_EQ(std::string_view(static_cast<const char*>(map.get()), 11), "hello world");
    }
}

TYPED_TEST(FileTest, NeverWritesOverAFile) {
    const fs::path path = this->folder_ / "a";
    std::ofstream(path) << "old";
    EXPECT_EQ(this->error_of([&] { typename TypeParam::Output file(path); }), std::errc::file_exists);
    EXPECT_EQ(this->get(path), "old");
}

TYPED_TEST(FileTest, SaysWhatIsWrong) {
    EXPECT_EQ(this->error_of([&] { typename TypeParam::Input file(this->folder_ / "none"); }),
              std::errc::no_such_file_or_directory);
    EXPECT_EQ(this->error_of([&] { typename TypeParam::Input file(this->folder_); }), std::errc::not_supported);
    EXPECT_EQ(this->error_of([&] { typename TypeParam::Output file(this->folder_ / "none" / "a"); }),
              std::errc::no_such_file_or_directory);
}

#if __has_include(<unistd.h>)
TEST(PosixFile, IsAbandonedOnceItsWriterIsGone) {
    const fs::path path = fs::temp_directory_path() / fmt::format("its-lock-{}", process_number());
    {
        const posix::OutputHandle file(path);
        EXPECT_FALSE(posix::is_abandoned(path));
    }
    EXPECT_TRUE(posix::is_abandoned(path));
    fs::remove(path);
    EXPECT_FALSE(posix::is_abandoned(path));
}
#endif

}  // namespace
}  // namespace its::platform
