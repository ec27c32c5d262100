#include "its/points.h"

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <bit>
#include <cmath>
#include <cstring>
#include <fstream>
#include <functional>
#include <iterator>
#include <limits>
#include <random>

#include "formats/point_readers.h"
#include "formats/readers.h"

namespace its {
namespace {

namespace fs = std::filesystem;

constexpr double nan = std::numeric_limits<double>::quiet_NaN();
constexpr double infinity = std::numeric_limits<double>::infinity();

std::string npy(const std::string& type, const std::string& shape, const std::string& data,
                bool fortran = false) {
    std::string header = fmt::format("{{'descr': '{}', 'fortran_order': {}, 'shape': {}, }}", type,
                                     fortran ? "True" : "False", shape);
    header.resize((header.size() + 11) / 64 * 64 + 64 - 11, ' ');
    header += '\n';
    std::string bytes("\x93NUMPY\x01\x00", 8);
    bytes += char(header.size() & 255);
    bytes += char(header.size() >> 8);
    return bytes + header + data;
}

template <class T>
std::string raw(std::initializer_list<T> values, bool big = false) {
    std::string bytes;
    for (const T value : values) {
        std::string one(sizeof(T), '\0');
        std::memcpy(one.data(), &value, sizeof(T));
        if (big) std::reverse(one.begin(), one.end());
        bytes += one;
    }
    return bytes;
}

const std::vector<Vec3> two = {{1, 2, 3}, {4, 5, 6}};

template <class T>
void expect_type(const std::string& name) {
    for (const bool big : {false, true}) {
        const std::string type = (sizeof(T) == 1 ? "|" : big ? ">" : "<") + name;
        EXPECT_EQ(formats::parse_npy(npy(type, "(2, 3)", raw<T>({1, 2, 3, 4, 5, 6}, big))), two) << type;
        EXPECT_EQ(formats::parse_npy(npy(type, "(2, 3)", raw<T>({1, 4, 2, 5, 3, 6}, big), true)), two) << type;
    }
}

TEST(Npy, EveryType) {
    expect_type<double>("f8");
    expect_type<float>("f4");
    expect_type<std::int8_t>("i1");
    expect_type<std::int16_t>("i2");
    expect_type<std::int32_t>("i4");
    expect_type<std::int64_t>("i8");
    expect_type<std::uint8_t>("u1");
    expect_type<std::uint16_t>("u2");
    expect_type<std::uint32_t>("u4");
    expect_type<std::uint64_t>("u8");
    // binary16: 1, −2, 0.5; 65504, the smallest normal and subnormal; −0, ∞, NaN.
    const auto half = formats::parse_npy(
        npy("<f2", "(3,3)",
            raw<std::uint16_t>({0x3c00, 0xc000, 0x3800, 0x7bff, 0x0400, 0x0001, 0x8000, 0x7c00, 0x7e00})));
    EXPECT_EQ(half[0], (Vec3{1, -2, 0.5}));
    EXPECT_EQ(half[1], (Vec3{65504, 0x1p-14, 0x1p-24}));
    EXPECT_EQ(half[2].y, infinity);
    EXPECT_TRUE(std::signbit(half[2].x) && std::isnan(half[2].z));
}

TEST(Npy, HeadersOfOtherWriters) {
    const std::string data = raw<double>({1, 2, 3, 4, 5, 6});
    const auto with = [&](const std::string& dictionary,
                          const std::string& version = std::string("\x01\x00", 2)) {
        const bool wide = version[0] != 1;
        std::string bytes = "\x93NUMPY" + version;
        bytes += char(dictionary.size());
        bytes += '\0';
        if (wide) bytes += std::string(2, '\0');
        return bytes + dictionary + data;
    };
    EXPECT_EQ(formats::parse_npy(with("{\"shape\":(2,3),\"fortran_order\":False,\"descr\":\"<f8\"}")), two);
    EXPECT_EQ(
        formats::parse_npy(with("{'shape': (2, 3,), 'descr': '=f8', 'fortran_order': False}\n", "\x02\x01")),
        two);
    EXPECT_EQ(formats::parse_npy(with("{'shape': (2, 3), 'descr': '<f8', 'fortran_order': False,}\n",
                                      std::string("\x03\x00", 2))),
              two);
}

/// The message of the InputError.
template <class F>
std::string refusal(F&& fn) {
    try {
        fn();
    } catch (const InputError& error) {
        return error.what();
    }
    ADD_FAILURE() << "bad points were read";
    return "";
}

TEST(Npy, Refusals) {
    const std::string data = raw<double>({1, 2, 3, 4, 5, 6});
    const auto says = [](const std::string& bytes, const std::string& part) {
        EXPECT_NE(refusal([&] { formats::parse_npy(bytes); }).find(part), std::string::npos) << part;
    };
    says("", "not a .npy");
    says("PK\x03\x04", "not a .npy");
    says(npy("<f8", "(2, 2)", data), "(2, 2)");
    says(npy("<f8", "(6,)", data), "(6)");
    says(npy("<f8", "(2, 3)", data.substr(1)), "47 bytes");
    says(npy("<f8", "(3, 3)", data), "claims 3");
    says(npy("<f8", "(1, 3)", data), "claims 1");
    says(npy("<f8", "(6148914691236517206, 3)", data), "claims");  // times 24: 16 mod 2⁶⁴
    says(npy("<f8", "(99999999999999999999, 3)", data), "header");
    says(npy("<c16", "(2, 3)", data), "c16");
    says(npy("|O", "(2, 3)", data), "'|O'");
    says(npy("", "(2, 3)", data), "type ''");
    says(npy("<f8", "(2, -3)", data), "header");
    EXPECT_TRUE(formats::parse_npy(npy("<f8", "(0, 3)", "")).empty());
}

TEST(Csv, WithAndWithoutNames) {
    EXPECT_EQ(formats::parse_csv("1,2,3\n4,5,6\n"), two);
    EXPECT_EQ(formats::parse_csv("x,y,z\r\n1,2,3\r\n4,5,6"), two);
    EXPECT_EQ(formats::parse_csv("\xef\xbb\xbf# c\n\n\"Z\";name; \"x\" ;y\n3;a;1;2\n\n# c\n6;b; 4 ;+5\n"), two);
    EXPECT_EQ(formats::parse_csv("id\tname\tother\n1\t2\t3\n4\t5e0\t6.0\textra\n"), two);
    EXPECT_EQ(formats::parse_csv("").size(), 0u);
    const auto odd = formats::parse_csv("nan,inf,-inf\n1e999,-1e-999,0\n");
    EXPECT_TRUE(std::isnan(odd[0].x));
    EXPECT_EQ(odd[0].z, -infinity);
    EXPECT_EQ(odd[1].x, infinity);
}

TEST(Csv, NamesTheLine) {
    EXPECT_EQ(refusal([] { formats::parse_csv("x,y,z\n1,2,3\n1,2\n"); }),
              "line 3: numbers are expected in columns 1, 2 and 3");
    EXPECT_EQ(refusal([] { formats::parse_csv("z,y,x\n\n1,2,x\n"); }),
              "line 3: numbers are expected in columns 3, 2 and 1");
    EXPECT_EQ(refusal([] { formats::parse_csv("1 2 3\n"); }).substr(0, 7), "line 1:");
    EXPECT_EQ(refusal([] { formats::parse_csv("1,2,3\nx,y,z\n"); }).substr(0, 7), "line 2:");
    EXPECT_EQ(refusal([] { formats::parse_csv("1,2,3 4\n"); }).substr(0, 7), "line 1:");
}

TEST(Xyz, Lines) {
    EXPECT_EQ(formats::parse_xyz("1 2 3\n # c\n\t4   5 6 0.5 red\n"), two);
    EXPECT_EQ(refusal([] { formats::parse_xyz("1 2 3\n\n4 5\n"); }), "line 3: three numbers are expected");
    EXPECT_EQ(refusal([] { formats::parse_xyz("1,2,3\n"); }), "line 1: three numbers are expected");
}

TEST(PlyPoints, TextAndBinary) {
    EXPECT_EQ(formats::parse_ply_points(
                  "ply\nformat ascii 1.0\nelement vertex 2\nproperty float z\nproperty uchar red\nproperty "
                  "list uchar int k\nproperty float x\nproperty int y\nend_header\n3 9 2 8 8 1 2\n6 9 0 4 5"),
              two);
    const std::string header =
        "ply\nformat binary_big_endian 1.0\nelement face 1\nproperty list uchar uchar i\nelement vertex "
        "2\nproperty "
        "double x\nproperty double y\nproperty double z\nend_header\n";
    const std::string body = std::string("\x02\x00\x01", 3) + raw<double>({1, 2, 3, 4, 5, 6}, true);
    EXPECT_EQ(formats::parse_ply_points(header + body), two);
    EXPECT_NE(refusal([&] {
                  formats::parse_ply_points(header + body.substr(0, body.size() - 1));
              }).find("number 2 of 2"),
              std::string::npos);
    EXPECT_EQ(refusal([] { formats::parse_ply_points("solid"); }), "is not a PLY file");
    EXPECT_EQ(refusal([] { formats::parse_ply_points("ply\nformat ascii 1.0\nend_header\n"); }),
              "has no element 'vertex'");
    refusal(
        [] { formats::parse_ply_points("ply\nformat ascii 1.0\nelement vertex 1000000000000\nend_header\n"); });
}

// ---- files ----

struct Case {
    std::string extension;
    std::function<std::vector<Vec3>(std::string_view)> parse;
};
const std::vector<Case> cases = {{".npy", formats::parse_npy},
                                 {".csv", formats::parse_csv},
                                 {".xyz", formats::parse_xyz},
                                 {".ply", formats::parse_ply_points}};

class PointFiles : public testing::Test {
protected:
    void SetUp() override {
        folder_ = fs::temp_directory_path() / fmt::format("its-points-{}", ::getpid());
        fs::remove_all(folder_);
        fs::create_directories(folder_);
    }
    void TearDown() override { fs::remove_all(folder_); }

    std::string content(const fs::path& path) const {
        std::ifstream in(path, std::ios::binary);
        return {std::istreambuf_iterator<char>(in), {}};
    }

    fs::path folder_;
    const std::vector<Vec3> points_ = {{0.1, -2.5e-300, 3}, {1e300, nan, -infinity}, {-0.0, 1.0 / 3, 5}};
    const std::vector<std::int8_t> codes_ = {-1, 2, 1};
    const std::vector<double> value_ = {0.1, nan, 1.0 / 3}, pair_ = {1, 2, 3, 4, 5, 6};
};

bool same_bits(const Vec3& a, const Vec3& b) {
    for (int axis = 0; axis < 3; ++axis)
        if (!(std::isnan(a[axis]) && std::isnan(b[axis])) &&
            std::bit_cast<std::uint64_t>(a[axis]) != std::bit_cast<std::uint64_t>(b[axis]))
            return false;
    return true;
}

TEST_F(PointFiles, TextAndPlyReadBackAsTheSameBits) {
    const PointColumns columns[] = {{{"value"}, value_}, {{"a", "b"}, pair_}};
    for (const std::string extension : {".csv", ".xyz", ".ply", ".PLY"}) {
        const fs::path path = folder_ / ("p" + extension);
        write_points(path, points_, codes_, columns);
        const std::vector<Vec3> back = read_points(path);
        ASSERT_EQ(back.size(), points_.size());
        for (std::size_t i = 0; i < back.size(); ++i)
            EXPECT_TRUE(same_bits(back[i], points_[i])) << extension << i;
    }
    EXPECT_EQ(content(folder_ / "p.csv"),
              "x,y,z,code,value,a,b\n0.1,-2.5e-300,3,-1,0.1,1,2\n1e+300,nan,-inf,2,nan,3,4\n"
              "-0,0.3333333333333333,5,1,0.3333333333333333,5,6\n");
    EXPECT_EQ(content(folder_ / "p.xyz").substr(0, 26), "0.1 -2.5e-300 3 -1 0.1 1 2");
    EXPECT_NE(content(folder_ / "p.ply").find("property int code\n"), std::string::npos)
        << "some programs do not know char";
}

TEST_F(PointFiles, NanHasNoSignInText) {
    write_points(folder_ / "p.csv", std::vector<Vec3>{{1, -nan, 2}}, std::vector<std::int8_t>{2});
    EXPECT_EQ(content(folder_ / "p.csv"), "x,y,z,code\n1,nan,2,2\n");
}

TEST_F(PointFiles, NpyOfCodesAndOfColumns) {
    write_points(folder_ / "codes.npy", points_, codes_);
    const std::string codes = content(folder_ / "codes.npy");
    EXPECT_EQ(codes.size(), 128u + 3);
    EXPECT_NE(codes.find("'descr': '|i1', 'fortran_order': False, 'shape': (3,)"), std::string::npos);
    EXPECT_EQ(codes.substr(128), std::string("\xff\x02\x01"));
    const PointColumns columns[] = {{{"a", "b"}, pair_}};
    write_points(folder_ / "table.npy", points_, codes_, columns);  // of three columns: can be read as points
    EXPECT_EQ(read_points(folder_ / "table.npy"), (std::vector<Vec3>{{-1, 1, 2}, {2, 3, 4}, {1, 5, 6}}));
}

TEST_F(PointFiles, Refusals) {
    EXPECT_THROW(read_points(folder_ / "missing.npy"), FileError);
    EXPECT_THROW(read_points(folder_ / "a.las"), OptionError);
    EXPECT_THROW(write_points(folder_ / "a.las", points_, codes_), OptionError);
    EXPECT_THROW(write_points(folder_ / "a.csv", points_, std::span(codes_).first(2)), OptionError);
    const PointColumns columns[] = {{{"a", "b"}, value_}};
    EXPECT_THROW(write_points(folder_ / "a.csv", points_, codes_, columns), OptionError);
    EXPECT_TRUE(fs::is_empty(folder_));
    std::ofstream(folder_ / "bad.csv") << "1,2,3\n4,5\n";
    try {
        read_points(folder_ / "bad.csv");
        ADD_FAILURE();
    } catch (const InputError& error) {
        EXPECT_EQ(error.what(),
                  (folder_ / "bad.csv").string() + ": line 2: numbers are expected in columns 1, 2 and 3");
    }
}

/// Every cut and every changed byte: an InputError, or points that are no more than the bytes can hold.
TEST_F(PointFiles, CutAndDamagedFiles) {
    std::mt19937_64 random(20240);
    std::vector<Vec3> points(8);
    for (Vec3& p : points)
        for (int axis = 0; axis < 3; ++axis) p[axis] = std::uniform_real_distribution(-1.0, 1.0)(random);
    const std::vector<std::int8_t> codes(points.size(), 1);
    std::vector<double> pairs(2 * points.size(), 0.5);
    const PointColumns columns[] = {{{"a", "b"}, pairs}};
    for (const Case& c : cases) {
        const fs::path path = folder_ / ("p" + c.extension);
        write_points(path, points, codes, columns);
        const std::string good = content(path);
        int refused = 0;
        const auto check = [&](std::string_view bytes) {
            try {
                EXPECT_LE(c.parse(bytes).size(), bytes.size());
            } catch (const InputError&) {
                ++refused;
            }
        };
        for (std::size_t n = 0; n < good.size(); ++n) check(std::string(good, 0, n));
        EXPECT_GT(refused, 0) << c.extension;
        for (std::size_t i = 0; i < good.size(); ++i)
            for (const char byte :
                 {'\0', '\n', '9', ',', '(', '\x7f', char(0xff), char(good[i] ^ 1), char(good[i] ^ 128)}) {
                std::string bad = good;
                bad[i] = byte;
                check(bad);
            }
    }
}

}  // namespace
}  // namespace its
