#include "shell_file/shell_file.h"

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <sys/resource.h>
#include <unistd.h>

#include <bit>
#include <csignal>
#include <cstring>
#include <fstream>
#include <functional>
#include <iterator>
#include <limits>
#include <random>

#include "its/inspect.h"
#ifdef ITS_PICTURE
#include "its/picture.h"
#endif
#include "its/shell_file.h"
#include "its/verify.h"
#include "shell/access.h"
#include "shell/validate.h"
#include "shell_file/hand_made.h"
#include "support/edit.h"

namespace its {
namespace {

namespace fs = std::filesystem;
using Bytes = std::vector<std::byte>;
using test::edit;
using test::one_level;
using test::two_levels;

Bytes read_file(const fs::path& path) {
    std::ifstream in(path, std::ios::binary);
    const std::string text{std::istreambuf_iterator<char>(in), {}};
    const auto bytes = std::as_bytes(std::span(text));
    return {bytes.begin(), bytes.end()};
}

template <class T>
bool same_bits(const T& a, const T& b) {
    return a.size() == b.size() && (a.empty() || std::memcmp(a.data(), b.data(), a.size() * sizeof(a[0])) == 0);
}

void expect_same(const shell::ShellData& a, const shell::ShellData& b) {
    EXPECT_TRUE(same_bits(a.mesh.vertices, b.mesh.vertices));
    EXPECT_TRUE(same_bits(a.mesh.triangles, b.mesh.triangles));
    EXPECT_EQ(a.lattice.depth, b.lattice.depth);
    EXPECT_EQ(a.lattice.width, b.lattice.width);
    EXPECT_EQ(a.lattice.base, b.lattice.base);
    EXPECT_EQ(a.octree.depth, b.octree.depth);
    ASSERT_EQ(a.octree.levels.size(), b.octree.levels.size());
    ASSERT_EQ(a.field.values.size(), b.field.values.size());
    for (std::size_t k = 0; k < a.octree.levels.size(); ++k) {
        EXPECT_EQ(a.octree.levels[k].parent, b.octree.levels[k].parent);
        EXPECT_EQ(a.octree.levels[k].mask, b.octree.levels[k].mask);
        EXPECT_TRUE(same_bits(a.field.values[k], b.field.values[k]));
        EXPECT_EQ(a.sides.inside[k], b.sides.inside[k]);
    }
    EXPECT_TRUE(same_bits(a.surface.lower, b.surface.lower));
    EXPECT_TRUE(same_bits(a.surface.upper, b.surface.upper));
    EXPECT_EQ(a.surface.lists.offset, b.surface.lists.offset);
    EXPECT_EQ(a.surface.lists.bytes, b.surface.lists.bytes);
    EXPECT_EQ(a.sides.winding, b.sides.winding);
    EXPECT_EQ(a.epsilon_inner, b.epsilon_inner);
    EXPECT_EQ(a.epsilon_outer, b.epsilon_outer);
    const ShellInfo &i = a.info, &j = b.info;
    EXPECT_EQ(i.depth, j.depth);
    EXPECT_EQ(i.sign, j.sign);
    EXPECT_EQ(i.sign_reason, j.sign_reason);
    EXPECT_EQ(i.extrema, j.extrema);
    EXPECT_EQ(i.solver, j.solver);
    EXPECT_EQ(i.mesh_closed, j.mesh_closed);
    EXPECT_EQ(i.mesh_vertices, j.mesh_vertices);
    EXPECT_EQ(i.mesh_triangles, j.mesh_triangles);
    EXPECT_EQ(i.scale, j.scale);
    EXPECT_EQ(i.cell_width, j.cell_width);
    EXPECT_EQ(i.root.min, j.root.min);
    EXPECT_EQ(i.root.max, j.root.max);
    EXPECT_EQ(i.epsilon_inner, j.epsilon_inner);
    EXPECT_EQ(i.epsilon_outer, j.epsilon_outer);
    EXPECT_EQ(i.rounding, j.rounding);
    EXPECT_EQ(i.surface_cells, j.surface_cells);
    EXPECT_EQ(i.cells, j.cells);
    EXPECT_EQ(i.memory_bytes, j.memory_bytes);
}

/// The message of the InputError that decode() throws; a failure and "" if it throws none.
std::string refusal(std::span<const std::byte> bytes) {
    try {
        shell_file::decode(bytes);
    } catch (const InputError& error) {
        return error.what();
    }
    ADD_FAILURE() << "a damaged file was read";
    return "";
}

class ShellFile : public testing::Test {
protected:
    void SetUp() override {
        folder_ = fs::temp_directory_path() / fmt::format("its-io-{}", ::getpid());
        fs::remove_all(folder_);
        fs::create_directories(folder_);
    }
    void TearDown() override { fs::remove_all(folder_); }
    void put(const fs::path& path, std::span<const std::byte> bytes) {
        std::ofstream(path, std::ios::binary)
            .write(reinterpret_cast<const char*>(bytes.data()), std::streamsize(bytes.size()));
    }
    std::size_t files() const {
        return std::size_t(std::distance(fs::directory_iterator(folder_), fs::directory_iterator()));
    }
    static ThinShell shell(shell::ShellData data) { return shell::Access::make(std::move(data)); }

    fs::path folder_;
};

TEST_F(ShellFile, RoundTripKeepsEveryBit) {
    for (const shell::ShellData& data : {one_level(), two_levels()}) {
        save(shell(data), folder_ / "a.its");
        const ThinShell loaded = load(folder_ / "a.its");
        expect_same(data, shell::Access::data(loaded));
        save(loaded, folder_ / "b.its");
        EXPECT_EQ(read_file(folder_ / "a.its"), read_file(folder_ / "b.its"));
        EXPECT_EQ(read_file(folder_ / "a.its"), shell_file::encode(data));
        EXPECT_EQ(files(), 2u);
    }
}

TEST_F(ShellFile, ArraysLieWhereTheyCanBeMapped) {
    const Bytes bytes = shell_file::encode(two_levels());
    EXPECT_EQ(bytes.size() % 64, 0u);
    std::uint32_t sections = 0;
    std::memcpy(&sections, bytes.data() + 28, 4);
    EXPECT_EQ(sections, 10u + 5 * 2);
    for (std::uint32_t i = 0; i < sections; ++i) {
        std::uint64_t offset = 0;
        std::memcpy(&offset, bytes.data() + 64 + 48 * i + 8, 8);
        EXPECT_EQ(offset % 64, 0u);
    }
}

TEST_F(ShellFile, CutAnywhereIsRefused) {
    const Bytes bytes = shell_file::encode(two_levels());
    for (std::size_t n = 0; n < bytes.size(); ++n) refusal(std::span(bytes).first(n));
    Bytes longer = bytes;
    longer.resize(bytes.size() + 64);
    EXPECT_NE(refusal(longer).find("bytes"), std::string::npos);
}

TEST_F(ShellFile, CutFilesOnDiskAreRefused) {
    const Bytes bytes = shell_file::encode(one_level());
    for (std::size_t n = 0; n < bytes.size(); n += 61) {
        put(folder_ / "cut.its", std::span(bytes).first(n));
        EXPECT_THROW(load(folder_ / "cut.its"), InputError) << n;
    }
}

TEST_F(ShellFile, AnyFlippedBitIsNoticed) {
    Bytes bytes = shell_file::encode(one_level());
    ASSERT_NO_THROW(shell_file::decode(bytes));
    for (std::size_t i = 0; i < bytes.size(); ++i)
        for (int bit = 0; bit < 8; ++bit) {
            bytes[i] ^= std::byte(1 << bit);
            refusal(bytes);
            bytes[i] ^= std::byte(1 << bit);
        }
}

/// Writes every kind of tempting number at every 4-byte place, mends the checksums and decodes. Anything that
/// still decodes must be valid, and must encode to the same bytes again.
TEST_F(ShellFile, TamperedWithMendedChecksumsNeverHarms) {
    const Bytes good = shell_file::encode(two_levels());
    const std::uint64_t values[] = {0,
                                    1,
                                    0xff,
                                    0x7fffffff,
                                    0xffffffff,
                                    std::uint64_t{1} << 32,
                                    std::uint64_t{1} << 61,
                                    std::numeric_limits<std::int64_t>::max(),
                                    std::numeric_limits<std::uint64_t>::max(),
                                    std::bit_cast<std::uint64_t>(std::numeric_limits<double>::quiet_NaN()),
                                    std::bit_cast<std::uint64_t>(1e300)};
    int accepted = 0, refused = 0;
    for (std::size_t i = 0; i + 8 <= good.size(); i += 4)
        for (const std::uint64_t value : values)
            for (const std::size_t bytes : {4, 8}) {
                Bytes file = good;
                std::memcpy(file.data() + i, &value, bytes);
                shell_file::mend_checksums(file);
                try {
                    const shell::ShellData data = shell_file::decode(file);
                    EXPECT_TRUE(shell_file::encode(data) == file) << i;
                    ++accepted;
                } catch (const InputError&) {
                    ++refused;
                }
            }
    EXPECT_GT(accepted, 1000);  // harmless changes, as of a value of f: the checksums really were mended
    EXPECT_GT(refused, 1000);
}

TEST_F(ShellFile, RandomBytesBehindTheHeader) {
    std::mt19937_64 random(20240);
    const Bytes good = shell_file::encode(two_levels());
    for (int round = 0; round < 20000; ++round) {
        Bytes file = good;
        for (std::uint64_t n = random() % 4 + 1; n > 0; --n)
            file[random() % file.size()] = std::byte(random() % 3 == 0 ? 0xff : random());
        shell_file::mend_checksums(file);
        try {
            shell::validate(shell_file::decode(file));
        } catch (const InputError&) {
        }
    }
}

/// Reads all that a shell has and all that is computed from it.
double use(shell::ShellData data) {
    const octree::Lattice lattice = data.lattice;
    const ThinShell thin = shell::Access::make(std::move(data));
    double sum = double(thin.grid_points()) + double(thin.mesh().triangles.size());
    const auto side = std::int64_t{lattice.cells()};
    for (std::int64_t i = 0; i < (2 * side + 1) * (2 * side + 1) * (2 * side + 1); ++i) {
        const std::int64_t n = 2 * side + 1;
        const Vec3 p = lattice.position({i % n / 2, i / n % n / 2, i / n / n / 2});
        sum += thin.value(p) + thin.gradient(p).x;
    }
    const octree::Level& level = shell::Access::data(thin).octree.levels[0];
    for (std::uint64_t g = 0; g < level.groups(); ++g)
        for (int child = 0; child < 8; ++child)
            for (const std::uint32_t t : shell::Access::data(thin).triangles(g, child))
                sum += double(shell::Access::data(thin).mesh.triangles[t][0]);
#ifdef ITS_PICTURE
    (void)slice(thin, {.axis = 2, .at = 0.5, .size = 64, .cells = true, .run = {.threads = 1}});
#endif
    (void)verify(thin, thin.mesh(), {.samples = 10, .seed = 1, .grid_samples = 10, .run = {.threads = 1}});
    return sum;
}

/// A quick load does not see damage in the numbers; nothing that uses them may read beyond arrays (which the
/// sanitizers would see) or hang.
TEST_F(ShellFile, QuicklyLoadedDamageNeverHarms) {
    std::mt19937_64 random(20240);
    const Bytes good = shell_file::encode(two_levels());
    ASSERT_NO_THROW(use(shell_file::decode(good, "shell", LoadCheck::quick)));
    int accepted = 0, unseen = 0;
    for (int round = 0; round < 5000; ++round) {
        Bytes file = good;
        for (std::uint64_t n = random() % 4 + 1; n > 0; --n) {
            const std::size_t at = random() % file.size();
            const std::size_t length = std::min<std::size_t>(random() % 2 ? 1 : 8, file.size() - at);
            for (std::size_t i = at; i < at + length; ++i)
                file[i] = std::byte(random() % 3 == 0 ? 0xff : random());
        }
        if (round % 2) shell_file::mend_checksums(file);
        try {
            shell::ShellData data = shell_file::decode(file, "shell", LoadCheck::quick);
            ++accepted;
            try {
                shell::validate(data);
            } catch (const InputError&) {
                ++unseen;
            }
            try {
                use(std::move(data));
            } catch (const InputError&) {  // of verify, as for a mesh that is not the shell's
            }
        } catch (const InputError&) {
        }
    }
    EXPECT_GT(accepted, 300);
    EXPECT_GT(unseen, 40);
}

TEST_F(ShellFile, QuickLoadReadsTheRestOnly) {
    Bytes bytes = shell_file::encode(two_levels());
    // The last section has the values of the coarsest level: its last bytes are their upper bits.
    bytes[bytes.size() - 64 + 8] ^= std::byte(1);
    put(folder_ / "a.its", bytes);
    EXPECT_THROW(load(folder_ / "a.its"), InputError);
    EXPECT_THROW(load(folder_ / "a.its", {.map = false}), InputError);
    EXPECT_NO_THROW(load(folder_ / "a.its", {.check = LoadCheck::quick}));
}

TEST_F(ShellFile, AMappedShellOutlivesItsName) {
    save(shell(two_levels()), folder_ / "a.its");
    const ThinShell mapped = load(folder_ / "a.its", {.check = LoadCheck::quick});
    save(shell(one_level()), folder_ / "a.its");
    expect_same(two_levels(), shell::Access::data(mapped));
    fs::remove(folder_ / "a.its");
    expect_same(two_levels(), shell::Access::data(mapped));
}

TEST_F(ShellFile, HugeClaimsTakeNoMemory) {
    // Offsets in the file: header 64 bytes; section i at 64 + 48·i; its bytes at +16, its count at +24.
    const std::uint64_t huge = std::uint64_t{1} << 60;
    for (int section = 0; section < 8 + 3; ++section) {
        Bytes file = shell_file::encode(one_level());
        std::byte* const place = file.data() + 64 + 48 * section;
        std::uint64_t element = 0;
        std::memcpy(&element, place + 32, 8);
        const std::uint64_t bytes = huge * element;
        std::memcpy(place + 16, &bytes, 8);
        std::memcpy(place + 24, &huge, 8);
        shell_file::mend_checksums(file);
        EXPECT_NE(refusal(file).find("section table"), std::string::npos);
    }
    Bytes file = shell_file::encode(one_level());
    const std::uint32_t sections = 0xffffffff;
    std::memcpy(file.data() + 28, &sections, 4);
    shell_file::mend_checksums(file);
    refusal(file);
}

TEST_F(ShellFile, SaysWhatIsWrong) {
    Bytes file = shell_file::encode(one_level());
    const std::uint32_t version = 77;
    std::memcpy(file.data() + 8, &version, 4);
    EXPECT_NE(refusal(file).find("version 77"), std::string::npos);
    const std::string text = "solid not a shell, but the beginning of an STL file";
    EXPECT_EQ(refusal(std::as_bytes(std::span(text))), "shell: is not an .its file");
}

TEST_F(ShellFile, SaveFailures) {
    const ThinShell thin = shell(one_level());
    EXPECT_THROW(save(thin, folder_ / "missing" / "a.its"), FileError);
    EXPECT_THROW(save(thin, folder_), FileError);
    EXPECT_THROW(save(thin, "/dev/full"), FileError);
    EXPECT_TRUE(fs::is_character_file("/dev/full"));
    EXPECT_EQ(files(), 0u);
}

TEST_F(ShellFile, AFullDiskLeavesTheOldFile) {
    save(shell(one_level()), folder_ / "a.its");
    const Bytes old = read_file(folder_ / "a.its");
    rlimit before{};
    ::getrlimit(RLIMIT_FSIZE, &before);
    const auto handler = std::signal(SIGXFSZ, SIG_IGN);
    const rlimit small{1000, before.rlim_max};
    ::setrlimit(RLIMIT_FSIZE, &small);
    EXPECT_THROW(save(shell(two_levels()), folder_ / "a.its"), FileError);
    ::setrlimit(RLIMIT_FSIZE, &before);
    std::signal(SIGXFSZ, handler);
    EXPECT_EQ(read_file(folder_ / "a.its"), old);
    EXPECT_EQ(files(), 1u);
}

TEST_F(ShellFile, LoadFailures) {
    EXPECT_THROW(load(folder_ / "missing.its"), FileError);
    EXPECT_THROW(load(folder_), FileError);
    EXPECT_THROW(load("/dev/zero"), FileError);
    put(folder_ / "empty.its", {});
    EXPECT_THROW(load(folder_ / "empty.its"), InputError);
}

/// All versions stay readable. Each file was written by save(two_levels()) when the version was made; to make
/// one for a new version, set ITS_WRITE_GOLDEN to its path.
TEST_F(ShellFile, OldFilesStayReadable) {
    if (const char* path = std::getenv("ITS_WRITE_GOLDEN")) save(shell(two_levels()), path);
    const fs::path folder = fs::path(ITS_SOURCE_DIR) / "tests/shell_file/data";
    for (const char* name : {"two_levels_v1.its", "two_levels_v2.its", "two_levels_v3.its"}) {
        for (const bool map : {true, false})
            expect_same(two_levels(),
                        shell::Access::data(load(folder / name, {.check = LoadCheck::full, .map = map})));
    }
    EXPECT_EQ(shell_file::encode(two_levels()), read_file(folder / "two_levels_v3.its"));
}

TEST_F(ShellFile, RemembersWhichAxisIsUp) {
    for (const UpAxis up : {UpAxis::unknown, UpAxis::x, UpAxis::y, UpAxis::z}) {
        shell::ShellData data = two_levels();
        data.info.up = up;
        save(shell(data), folder_ / "a.its");
        EXPECT_EQ(load(folder_ / "a.its").info().up, up);
        EXPECT_EQ(read_file(folder_ / "a.its") == shell_file::encode(two_levels()), up == UpAxis::unknown)
            << "where it is not known the bytes are those from before there was such a number";
    }
}

// ---- validate() ----

struct Damage {
    const char* says;  ///< part of the message
    std::function<void(shell::ShellData&)> harm;
};

TEST(Validate, AcceptsSoundShells) {
    EXPECT_NO_THROW(shell::validate(one_level()));
    EXPECT_NO_THROW(shell::validate(two_levels()));
}

TEST(Validate, NamesTheBrokenInvariant) {
    const double nan = std::numeric_limits<double>::quiet_NaN();
    const double infinity = std::numeric_limits<double>::infinity();
    const Damage damages[] = {
        {"unknown", [](auto& s) { s.info.up = UpAxis(4); }},
        {"depth", [](auto& s) { s.lattice.depth = -1; }},
        {"depth", [](auto& s) { s.lattice.depth = 17; }},
        {"cell width", [&](auto& s) { s.lattice.width = nan; }},
        {"cell width", [](auto& s) { s.lattice.width = 0; }},
        {"cell width", [](auto& s) { s.lattice.width = 1e-200; }},
        {"not exact", [](auto& s) { s.lattice.width = 1.1; }},
        {"not exact", [](auto& s) { s.lattice.base[1] = std::int64_t{1} << 53; }},
        {"not exact", [](auto& s) { s.lattice.base[1] = std::numeric_limits<std::int64_t>::min(); }},
        {"not exact", [](auto& s) { s.lattice.base[1] = std::numeric_limits<std::int64_t>::max(); }},
        {"vertex 1", [&](auto& s) { edit(s.mesh.vertices)[1].y = infinity; }},
        {"vertex 4", [&](auto& s) { edit(s.mesh.vertices)[4].x = nan; }},
        {"triangle 1", [](auto& s) { edit(s.mesh.triangles)[1][2] = 5; }},
        {"triangle 1", [](auto& s) { edit(s.mesh.vertices)[3].z = 4.5; }},
        {"no triangles", [](auto& s) { edit(s.mesh.triangles)->clear(); }},
        {"sides", [](auto& s) { s.sides.inside.pop_back(); }},
        {"sides", [](auto& s) { edit(s.sides.inside[0])->pop_back(); }},
        {"winding numbers",
         [](auto& s) {
             s.sides.winding = {0, 0, 0};
         }},
        {"sides of group 1",
         [](auto& s) {
             s.sides.winding = {0, -1, 2, 0};
         }},
        {"levels", [](auto& s) { s.octree.levels.pop_back(); }},
        {"levels", [](auto& s) { s.octree.depth = 2; }},
        {"level 0",
         [](auto& s) {
             auto parent = edit(s.octree.levels[0].parent);
             std::swap(parent[0], parent[1]);
         }},
        {"level 0", [](auto& s) { edit(s.octree.levels[0].parent)[1] = 0; }},
        {"level 0", [](auto& s) { edit(s.octree.levels[0].parent)[1] = 8; }},
        {"level 0", [](auto& s) { edit(s.octree.levels[0].mask)->push_back(0); }},
        {"level 1", [](auto& s) { edit(s.octree.levels[1].mask)[0] = 0b1000001; }},
        {"level 1", [](auto& s) { s.octree.levels[1] = octree::Level(); }},
        {"level 1", [](auto& s) { s.octree.levels[1] = octree::Level({1}, {0b11}); }},
        {"level 1", [](auto& s) { s.octree.levels[1] = octree::Level({0}, {0b1}); }},
        {"no cell",
         [](auto& s) {
             s.octree.levels[0] = octree::Level({0, 7}, {0, 0});
         }},
        {"field", [](auto& s) { s.field.values.pop_back(); }},
        {"level 0 has", [](auto& s) { edit(s.field.values[0])->pop_back(); }},
        {"level 1: value 26", [&](auto& s) { edit(s.field.values[1])[26] = nan; }},
        {"level 0: value 7", [](auto& s) { edit(s.field.values[0])[7] = 1e38; }},
        {"level 0: value 7", [](auto& s) { edit(s.field.values[0])[7] = -2.01 * s.lattice.cells(); }},
        {"surface cell 0", [](auto& s) { edit(s.surface.lower)[0] = -1e30f; }},
        {"surface cell 1", [](auto& s) { edit(s.surface.upper)[1] = 2.01f * float(s.lattice.cells()); }},
        {"larger than distances", [](auto& s) { s.epsilon_outer = 1e38; }},
        {"larger than distances", [](auto& s) { s.epsilon_inner = -2.01 * s.lattice.cells(); }},
        {"arrays of surface", [](auto& s) { edit(s.surface.lower)->pop_back(); }},
        {"arrays of surface", [](auto& s) { edit(s.surface.lists.offset)->push_back(9); }},
        {"surface cell 3", [](auto& s) { edit(s.surface.lower)[3] = 1; }},
        {"surface cell 2", [&](auto& s) { edit(s.surface.upper)[2] = float(nan); }},
        {"surface cell 2", [&](auto& s) { edit(s.surface.upper)[2] = float(infinity); }},
        {"lists of group 0", [](auto& s) { edit(s.surface.lists.offset)[1] = 1'000'000; }},
        {"lists of group 0", [](auto& s) { edit(s.surface.lists.offset)[1] += 1; }},
        {"fill", [](auto& s) { edit(s.surface.lists.offset)[2] += 1; }},
        {"fill", [](auto& s) { edit(s.surface.lists.offset)[0] = 1; }},
        {"lists of group 1", [](auto& s) { edit(s.surface.lists.bytes)->back() = 1; }},
        {"lists of group 1", [](auto& s) { edit(s.surface.lists.bytes)->back() = 128; }},
        {"ε₁", [](auto& s) { s.epsilon_inner = 1; }},
        {"ε₁", [&](auto& s) { s.epsilon_outer = nan; }},
        {"ε₁", [&](auto& s) { s.info.epsilon_outer = infinity; }},
        {"description", [](auto& s) { s.info.depth = 0; }},
        {"description", [](auto& s) { s.info.scale *= 2; }},
        {"description", [](auto& s) { s.info.surface_cells = 7; }},
        {"root cube", [](auto& s) { s.info.root.max.z = 5; }},
        {"rounding", [&](auto& s) { s.info.rounding = nan; }},
        {"unknown", [](auto& s) { s.info.sign = static_cast<SignRule>(99); }},
    };
    for (std::size_t i = 0; i < std::size(damages); ++i) {
        shell::ShellData shell = two_levels();
        damages[i].harm(shell);
        try {
            shell::validate(shell);
            ADD_FAILURE() << "damage " << i << " (" << damages[i].says << ") was not noticed";
        } catch (const InputError& error) {
            EXPECT_NE(std::string(error.what()).find(damages[i].says), std::string::npos)
                << "damage " << i << ": " << error.what();
        }
    }
}

}  // namespace
}  // namespace its
