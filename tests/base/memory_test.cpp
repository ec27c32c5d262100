#include "its/memory.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <fstream>
#include <initializer_list>
#include <string>
#include <utility>

#include "base/platform/file.h"
#include "base/platform/memory.h"
#include "its/base.h"

namespace its {
namespace {

namespace fs = std::filesystem;

constexpr std::uint64_t mb = 1'000'000;

/// What a process would read of its limits: text files below a folder that is gone after the test.
class Memory : public testing::Test {
protected:
    void SetUp() override { put({{"proc/meminfo", "MemTotal: 16000000 kB\nMemAvailable:    8000000 kB\n"}}); }
    void TearDown() override { fs::remove_all(root_); }

    void put(std::initializer_list<std::pair<const char*, std::string>> files) const {
        for (const auto& [name, text] : files) {
            fs::create_directories((root_ / name).parent_path());
            std::ofstream(root_ / name) << text;
        }
    }
    void mount_version_2(const std::string& group, const std::string& mounted = "/") const {
        put({{"proc/self/cgroup", "0::" + group + "\n"},
             {"proc/self/mountinfo", "30 23 0:26 / /proc rw - proc proc rw\n31 23 0:27 " + mounted +
                                         " /sys/fs/cgroup rw,nosuid shared:4 - cgroup2 cgroup2 rw\n"}});
    }
    std::optional<std::uint64_t> available() const { return platform::available_memory(root_); }

    const fs::path root_ = fs::temp_directory_path() / fmt::format("its-memory-{}", platform::process_number());
};

TEST_F(Memory, IsUnknownWhereNothingSaysIt) {
    EXPECT_EQ(platform::available_memory(root_ / "nothing"), std::nullopt);
}

TEST_F(Memory, IsWhatTheSystemHas) {
    EXPECT_EQ(available(), std::uint64_t{8'000'000} * 1024);
    put({{"proc/meminfo", "MemAvailableButNot: 5 kB\nMemAvailable: 7 kB\n"}});
    EXPECT_EQ(available(), 7 * 1024u);
}

TEST_F(Memory, OfVersion2IsTheLeastOnTheWayToTheRoot) {
    mount_version_2("/user.slice/run.scope/job");
    EXPECT_EQ(available(), std::uint64_t{8'000'000} * 1024);  // nothing there has a limit
    put({{"sys/fs/cgroup/user.slice/memory.max", "max\n"},
         {"sys/fs/cgroup/user.slice/run.scope/memory.max", fmt::format("{}\n", 500 * mb)},
         {"sys/fs/cgroup/user.slice/run.scope/memory.current", fmt::format("{}\n", 100 * mb)},
         {"sys/fs/cgroup/user.slice/run.scope/job/memory.max", fmt::format("{}\n", 600 * mb)},
         {"sys/fs/cgroup/user.slice/run.scope/job/memory.current", fmt::format("{}\n", 50 * mb)},
         {"sys/fs/cgroup/other/memory.max", "1000\n"}});
    EXPECT_EQ(available(), 400 * mb);
    put({{"sys/fs/cgroup/user.slice/run.scope/job/memory.max", fmt::format("{}\n", 60 * mb)}});
    EXPECT_EQ(available(), 10 * mb);
    put({{"sys/fs/cgroup/user.slice/run.scope/job/memory.high", fmt::format("{}\n", 55 * mb)}});
    EXPECT_EQ(available(), 5 * mb);
}

TEST_F(Memory, ThatIsUsedUpIsNoneAndNotUnknown) {
    mount_version_2("/");
    put({{"sys/fs/cgroup/memory.max", "1000000\n"}, {"sys/fs/cgroup/memory.current", "1000000\n"}});
    EXPECT_EQ(available(), 0u);
    put({{"sys/fs/cgroup/memory.current", "1000001\n"}});
    EXPECT_EQ(available(), 0u);
}

TEST_F(Memory, ThatCachesFilesIsFree) {
    mount_version_2("/");
    put({{"sys/fs/cgroup/memory.max", fmt::format("{}\n", 500 * mb)},
         {"sys/fs/cgroup/memory.current", fmt::format("{}\n", 490 * mb)},
         {"sys/fs/cgroup/memory.stat",
          fmt::format("anon 7\nfile {}\ninactive_file {}\nactive_file {}\n", 400 * mb, 300 * mb, 50 * mb)}});
    EXPECT_EQ(available(), 360 * mb);
}

TEST_F(Memory, OfAContainerThatSeesItsOwnGroupOnly) {
    mount_version_2("/docker/abc/job", "/docker/abc");  // the host's names, of which one part is mounted
    put({{"sys/fs/cgroup/memory.max", fmt::format("{}\n", 300 * mb)},
         {"sys/fs/cgroup/memory.current", "0\n"},
         {"sys/fs/cgroup/job/memory.max", fmt::format("{}\n", 200 * mb)}});
    EXPECT_EQ(available(), 200 * mb);
    mount_version_2("/elsewhere", "/docker/abc");
    EXPECT_EQ(available(), 300 * mb);
    mount_version_2("/../other");
    EXPECT_EQ(available(), 300 * mb);
}

TEST_F(Memory, OfVersion1IsRead) {
    put({{"proc/self/cgroup", "5:cpu,cpuacct:/wrong\n4:memory:/slurm/job_7\n0::/\n"},
         {"proc/self/mountinfo",
          "30 23 0:26 / /sys/fs/cgroup/cpu rw - cgroup cgroup rw,cpu,cpuacct\n"
          "31 23 0:27 / /sys/fs/cgroup/memory rw - cgroup cgroup rw,memory\n"},
         {"sys/fs/cgroup/memory/memory.limit_in_bytes", "9223372036854771712\n"},
         {"sys/fs/cgroup/memory/memory.usage_in_bytes", "5000\n"},
         {"sys/fs/cgroup/memory/slurm/job_7/memory.limit_in_bytes", fmt::format("{}\n", 800 * mb)},
         {"sys/fs/cgroup/memory/slurm/job_7/memory.usage_in_bytes", fmt::format("{}\n", 700 * mb)},
         {"sys/fs/cgroup/memory/slurm/job_7/memory.stat",
          fmt::format("inactive_file 1\ntotal_inactive_file {}\ntotal_active_file {}\n", 200 * mb, 100 * mb)}});
    EXPECT_EQ(available(), 400 * mb);
}

TEST_F(Memory, OfTheProcessIsLimitedByUlimit) {
    const std::string head = "Limit                     Soft Limit           Hard Limit           Units\n";
    put({{"proc/self/status", "Name: its\nVmSize:   1000 kB\nVmData:   100 kB\n"},
         {"proc/self/limits",
          head + "Max data size             unlimited            unlimited            bytes\n"
                 "Max address space         3024000              unlimited            bytes\n"}});
    EXPECT_EQ(available(), 2'000'000u);
    put({{"proc/self/limits",
          head + "Max data size             202400               unlimited            bytes\n"
                 "Max address space         3024000              unlimited            bytes\n"}});
    EXPECT_EQ(available(), 100'000u);
}

TEST(MemoryLimit, ThatIsAskedForHolds) {
    EXPECT_EQ(memory_limit(1234), 1234u);
    EXPECT_GT(memory_limit(0), 0u);
    EXPECT_NO_THROW(require_memory(1234, 1234, "this", "do less"));
    try {
        require_memory(1'250'000, 1234, "this", "do less");
        FAIL();
    } catch (const MemoryError& error) {
        EXPECT_STREQ(error.what(), "this needs about 1.2 MB of memory, more than the 1.2 kB allowed; do less");
    }
}

#if __has_include(<unistd.h>)
TEST(MemoryLimit, OfThisMachineIsKnown) {
    const std::optional<std::uint64_t> available = available_memory();
    ASSERT_TRUE(available);
    EXPECT_GT(*available, mb);
}
#endif

}  // namespace
}  // namespace its
