#include "base/output_file.h"

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <csignal>
#include <fstream>
#include <iterator>
#include <string>
#include <thread>
#include <vector>

namespace its {
namespace {

namespace fs = std::filesystem;

class OutputFileTest : public testing::Test {
protected:
    void SetUp() override {
        folder_ = fs::temp_directory_path() / fmt::format("its-output-{}", ::getpid());
        fs::remove_all(folder_);
        fs::create_directories(folder_);
    }
    void TearDown() override { fs::remove_all(folder_); }

    static void put(const fs::path& path, std::string_view text) {
        OutputFile file(path);
        file.write(std::as_bytes(std::span(text)));
        file.commit();
    }
    static std::string get(const fs::path& path) {
        std::ifstream in(path, std::ios::binary);
        return {std::istreambuf_iterator<char>(in), {}};
    }
    std::size_t files() const {
        return std::size_t(std::distance(fs::directory_iterator(folder_), fs::directory_iterator()));
    }

    fs::path folder_;
};

TEST_F(OutputFileTest, CreatesAndReplaces) {
    put(folder_ / "a", "one");
    EXPECT_EQ(get(folder_ / "a"), "one");
    put(folder_ / "a", "two");
    EXPECT_EQ(get(folder_ / "a"), "two");
    EXPECT_EQ(files(), 1u);
}

TEST_F(OutputFileTest, WithoutCommitNothingChanges) {
    put(folder_ / "a", "old");
    {
        OutputFile file(folder_ / "a");
        file.write(std::as_bytes(std::span(std::string_view("new"))));
        EXPECT_EQ(files(), 2u);
    }
    EXPECT_EQ(get(folder_ / "a"), "old");
    EXPECT_EQ(files(), 1u);
}

TEST_F(OutputFileTest, KeepsPermissionsAndFollowsLinks) {
    put(folder_ / "a", "old");
    ::chmod((folder_ / "a").c_str(), 0600);
    fs::create_symlink("a", folder_ / "link");
    put(folder_ / "link", "new");
    EXPECT_TRUE(fs::is_symlink(folder_ / "link"));
    EXPECT_EQ(get(folder_ / "a"), "new");
    EXPECT_EQ(fs::status(folder_ / "a").permissions(), fs::perms(0600));
}

TEST_F(OutputFileTest, RefusesWhatIsNoRegularFile) {
    EXPECT_THROW(OutputFile{folder_}, FileError);
    EXPECT_THROW(OutputFile{fs::path("/dev/full")}, FileError);
    EXPECT_THROW(OutputFile{fs::path()}, FileError);
    EXPECT_THROW(OutputFile{folder_ / "missing" / "a"}, FileError);
    put(folder_ / "a", "file");
    EXPECT_THROW(OutputFile{folder_ / "a" / "b"}, FileError);
    EXPECT_EQ(files(), 1u);
}

TEST_F(OutputFileTest, ReadOnlyFolder) {
    if (::geteuid() == 0) GTEST_SKIP() << "the superuser may write anywhere";
    fs::permissions(folder_, fs::perms(0500));
    EXPECT_THROW(OutputFile{folder_ / "a"}, FileError);
    fs::permissions(folder_, fs::perms(0700));
}

TEST_F(OutputFileTest, AFullDiskLeavesTheOldFile) {
    put(folder_ / "a", "old");
    // A limit on file sizes fails in write(), as a full disk does.
    rlimit before{};
    ::getrlimit(RLIMIT_FSIZE, &before);
    const auto handler = std::signal(SIGXFSZ, SIG_IGN);
    const rlimit small{1000, before.rlim_max};
    ::setrlimit(RLIMIT_FSIZE, &small);
    EXPECT_THROW(put(folder_ / "a", std::string(5000, 'x')), FileError);
    ::setrlimit(RLIMIT_FSIZE, &before);
    std::signal(SIGXFSZ, handler);
    EXPECT_EQ(get(folder_ / "a"), "old");
    EXPECT_EQ(files(), 1u);
}

TEST_F(OutputFileTest, WhatAKilledWriterLeftIsRemovedByTheNextOfThatName) {
    put(folder_ / "a", "old");
    for (int i = 0; i < 2; ++i) {
        const pid_t child = ::fork();
        if (child == 0) {  // has no destructors run
            auto* const file = new OutputFile(folder_ / "a");
            file->write(std::as_bytes(std::span(std::string_view("half"))));
            ::kill(::getpid(), SIGKILL);
        }
        int status = 0;
        ::waitpid(child, &status, 0);
        ASSERT_TRUE(WIFSIGNALED(status));
        EXPECT_EQ(files(), 2u);  // the second writer has removed what the first left
    }
    put(folder_ / "b", "another name");
    EXPECT_EQ(files(), 3u);
    put(folder_ / "a", "new");
    EXPECT_EQ(get(folder_ / "a"), "new");
    EXPECT_EQ(files(), 2u);
}

TEST_F(OutputFileTest, WritersOfOneNameDoNotDisturbEachOther) {
    OutputFile one(folder_ / "a"), two(folder_ / "a");
    one.write(std::as_bytes(std::span(std::string_view("one"))));
    put(folder_ / "a", "three");
    two.write(std::as_bytes(std::span(std::string_view("two"))));
    one.commit();
    EXPECT_EQ(get(folder_ / "a"), "one");
    two.commit();
    EXPECT_EQ(get(folder_ / "a"), "two");
    EXPECT_EQ(files(), 1u);
}

TEST_F(OutputFileTest, ManyWritersAtOnce) {
    constexpr int writers = 8, rounds = 40;
    std::vector<std::thread> threads;
    for (int w = 0; w < writers; ++w)
        threads.emplace_back([&, w] {
            for (int i = 0; i < rounds; ++i) put(folder_ / "a", fmt::format("{:1000}", w));
        });
    for (std::thread& thread : threads) thread.join();
    EXPECT_EQ(get(folder_ / "a").size(), 1000u);
    EXPECT_EQ(files(), 1u);
}

TEST_F(OutputFileTest, LongNamesAreWritten) {
    const std::string name(255, 'n');
    put(folder_ / name, "text");
    EXPECT_EQ(get(folder_ / name), "text");
    EXPECT_EQ(files(), 1u);
}

TEST_F(OutputFileTest, AllFilesAreReplacedOrNone) {
    for (const bool first_is_new : {false, true}) {
        if (first_is_new)
            fs::remove(folder_ / "a");
        else
            put(folder_ / "a", "old");
        OutputFile a(folder_ / "a"), b(folder_ / "b");
        a.write(std::as_bytes(std::span(std::string_view("new"))));
        fs::create_directory(folder_ / "b");  // nothing can be renamed to it
        OutputFile* const both[] = {&a, &b};
        EXPECT_THROW(OutputFile::commit_all(both), FileError);
        EXPECT_EQ(get(folder_ / "a"), first_is_new ? "" : "old");
        EXPECT_EQ(fs::exists(folder_ / "a"), !first_is_new);
        fs::remove(folder_ / "b");
    }
    put(folder_ / "a", "old");
    {
        OutputFile a(folder_ / "a"), b(folder_ / "b");
        a.write(std::as_bytes(std::span(std::string_view("1"))));
        b.write(std::as_bytes(std::span(std::string_view("2"))));
        OutputFile* const both[] = {&a, &b};
        OutputFile::commit_all(both);
    }
    EXPECT_EQ(get(folder_ / "a"), "1");
    EXPECT_EQ(get(folder_ / "b"), "2");
    EXPECT_EQ(files(), 2u);
}

}  // namespace
}  // namespace its
