#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <bit>
#include <charconv>
#include <cmath>
#include <cstring>
#include <limits>
#include <optional>
#include <string>

#include "base/quote.h"
#include "formats/point_readers.h"
#include "formats/text.h"

namespace its::formats {

namespace {

/// What the header of a .npy file says. https://numpy.org/doc/stable/reference/generated/numpy.lib.format.html
struct Header {
    std::string_view type;  ///< such as "<f8"
    bool fortran = false;
    std::vector<std::uint64_t> shape;
};

/// Reads the Python dictionary that the header is: three known keys, in any order.
class Dictionary {
public:
    explicit Dictionary(std::string_view text) : text_(text) {}

    Header parse() {
        Header header;
        unsigned seen = 0;
        expect('{');
        while (!take('}')) {
            const std::string_view key = quoted();
            expect(':');
            if (key == "descr")
                header.type = type(), seen |= 1;
            else if (key == "fortran_order")
                header.fortran = truth(), seen |= 2;
            else if (key == "shape")
                header.shape = tuple(), seen |= 4;
            else
                fail();
            if (!take(',')) {
                expect('}');
                break;
            }
        }
        skip();
        if (!text_.empty() || seen != 7) fail();
        return header;
    }

private:
    [[noreturn]] static void fail() { throw InputError("the .npy header is damaged"); }

    void skip() {
        while (!text_.empty() && (text_[0] == ' ' || text_[0] == '\n')) text_.remove_prefix(1);
    }
    bool take(char c) {
        skip();
        if (!text_.starts_with(c)) return false;
        text_.remove_prefix(1);
        return true;
    }
    void expect(char c) {
        if (!take(c)) fail();
    }
    std::string_view quoted() {
        const char quote = take('"') ? '"' : '\'';
        if (quote == '\'') expect('\'');
        const std::size_t end = text_.find(quote);
        if (end == std::string_view::npos) fail();
        const std::string_view found = text_.substr(0, end);
        text_.remove_prefix(end + 1);
        return found;
    }
    /// A simple type; a list of fields, or a pair with a shape, is one of records.
    std::string_view type() {
        if (take('[') || take('('))
            throw InputError(
                "is a structured array: its elements have fields; save one of numbers, of shape (n, 3)");
        return quoted();
    }
    bool truth() {
        skip();
        for (const std::string_view word : {"True", "False"}) {
            if (!text_.starts_with(word)) continue;
            text_.remove_prefix(word.size());
            return word == "True";
        }
        fail();
    }
    std::vector<std::uint64_t> tuple() {
        std::vector<std::uint64_t> numbers;
        expect('(');
        while (!take(')')) {
            skip();
            std::uint64_t number = 0;
            const auto [stop, error] = std::from_chars(text_.data(), text_.data() + text_.size(), number);
            if (error != std::errc{}) fail();
            text_.remove_prefix(std::size_t(stop - text_.data()));
            numbers.push_back(number);
            if (!take(',')) {
                expect(')');
                break;
            }
        }
        return numbers;
    }

    std::string_view text_;
};

/// A number of IEEE binary16.
double half(std::uint16_t bits) {
    const int exponent = bits >> 10 & 31, fraction = bits & 1023;
    const double size = exponent == 31  ? (fraction ? std::numeric_limits<double>::quiet_NaN()
                                                    : std::numeric_limits<double>::infinity())
                        : exponent == 0 ? std::ldexp(fraction, -24)
                                        : std::ldexp(1024 + fraction, exponent - 25);
    return bits >> 15 ? -size : size;
}

/// The number at `at`, of which the most significant byte comes first if `swap`.
template <class T>
double number(const char* at, bool swap) {
    std::array<char, sizeof(T)> raw;
    std::memcpy(raw.data(), at, sizeof(T));
    if (swap) std::reverse(raw.begin(), raw.end());
    return double(std::bit_cast<T>(raw));
}
double number_of_half(const char* at, bool swap) {
    std::uint16_t bits = 0;
    std::memcpy(&bits, at, 2);
    return half(swap ? std::uint16_t(bits << 8 | bits >> 8) : bits);
}

struct Type {
    std::size_t bytes;
    double (*read)(const char*, bool);
};

/// Of "f8", "i4", …
std::optional<Type> type_of(std::string_view name) {
    static constexpr std::pair<std::string_view, Type> types[] = {
        {"f8", {8, number<double>}},        {"f4", {4, number<float>}},
        {"f2", {2, number_of_half}},        {"i1", {1, number<std::int8_t>}},
        {"i2", {2, number<std::int16_t>}},  {"i4", {4, number<std::int32_t>}},
        {"i8", {8, number<std::int64_t>}},  {"u1", {1, number<std::uint8_t>}},
        {"u2", {2, number<std::uint16_t>}}, {"u4", {4, number<std::uint32_t>}},
        {"u8", {8, number<std::uint64_t>}}};
    for (const auto& [known, type] : types)
        if (known == name) return type;
    return {};
}

/// The dictionary's text and the bytes after it.
std::pair<std::string_view, std::string_view> split(std::string_view bytes) {
    if (!bytes.starts_with("\x93NUMPY")) throw InputError("is not a .npy file");
    const auto byte = [&](std::size_t i) { return std::uint64_t(static_cast<unsigned char>(bytes[i])); };
    const std::uint64_t version = bytes.size() > 7 ? byte(6) : 0;
    const std::size_t begin = version == 1 ? 10 : 12;
    if (bytes.size() < begin) throw InputError("the .npy header is cut short");
    if (version < 1 || version > 3)
        throw InputError(fmt::format("is of .npy version {}, which is not known", version));
    std::uint64_t length = 0;
    for (std::size_t i = begin - 1; i >= 8; --i) length = length << 8 | byte(i);
    if (length > bytes.size() - begin) throw InputError("the .npy header is cut short");
    return {bytes.substr(begin, length), bytes.substr(begin + length)};
}

}  // namespace

std::vector<Vec3> parse_npy(std::string_view bytes) {
    const auto [dictionary, data] = split(bytes);
    const Header header = Dictionary(dictionary).parse();
    const char order = header.type.empty() ? '?' : header.type[0];
    const std::optional<Type> type = type_of(header.type.substr(std::min<std::size_t>(1, header.type.size())));
    if (!type || std::string_view("<>|=").find(order) == std::string_view::npos)
        throw InputError(
            fmt::format("has elements of type '{}'; integers and floating point of up to 8 bytes are "
                        "read",
                        quotable(header.type, 40)));
    if (header.shape.size() != 2 || header.shape[1] != 3)
        throw InputError(fmt::format("has the shape ({}); points are (n, 3)",
                                     quotable(fmt::format("{}", fmt::join(header.shape, ", ")))));
    const std::uint64_t count = header.shape[0], row = 3 * type->bytes;
    if (data.size() % row != 0 || data.size() / row != count)
        throw InputError(fmt::format("claims {} points, which take {} bytes each, and has {} bytes of data",
                                     count, row, data.size()));
    const bool swap = order == '>' && type->bytes > 1;
    const std::uint64_t step = header.fortran ? count : 1, next = header.fortran ? 1 : 3;
    std::vector<Vec3> points(count);
    for (std::uint64_t i = 0; i < count; ++i)
        for (int axis = 0; axis < 3; ++axis)
            points[i][axis] =
                type->read(data.data() + type->bytes * (next * i + step * std::uint64_t(axis)), swap);
    return points;
}

}  // namespace its::formats
