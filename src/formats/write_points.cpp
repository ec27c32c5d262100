#include <fmt/format.h>

#include <array>
#include <bit>
#include <charconv>
#include <cstring>

#include "base/output_file.h"
#include "formats/point_readers.h"
#include "formats/readers.h"

namespace its {
using namespace formats;

namespace {

static_assert(std::endian::native == std::endian::little, "numbers are written as they lie in memory");

/// The rows of a table, on their way into a file that appears complete or not at all.
class Rows {
public:
    explicit Rows(const std::filesystem::path& path) : file_(path) {}

    void text(std::string_view text) { buffer_.append(text); }
    /// The shortest text that reads back as the same number.
    void digits(double value) {
        std::array<char, 32> digits;
        const auto [end, error] = std::to_chars(digits.data(), digits.data() + digits.size(), value);
        buffer_.append(digits.data(), end);
    }
    template <class T>
    void raw(T value) {
        std::array<char, sizeof(T)> bytes;
        std::memcpy(bytes.data(), &value, sizeof(T));
        buffer_.append(bytes.data(), bytes.size());
    }
    void end_row() {
        constexpr std::size_t enough = std::size_t{1} << 20;
        if (buffer_.size() >= enough) flush();
    }
    void commit() {
        flush();
        file_.commit();
    }

private:
    void flush() {
        file_.write(std::as_bytes(std::span(buffer_)));
        buffer_.clear();
    }

    OutputFile file_;
    std::string buffer_;
};

struct Table {
    std::span<const Vec3> points;
    std::span<const std::int8_t> codes;
    std::span<const PointColumns> columns;

    template <class F>
    void for_values(std::size_t row, F&& fn) const {
        for (const PointColumns& c : columns)
            for (const double value : c.values.subspan(row * c.names.size(), c.names.size())) fn(value);
    }
    template <class F>
    void for_names(F&& fn) const {
        for (const PointColumns& c : columns)
            for (const std::string& name : c.names) fn(name);
    }
};

void write_npy(const Table& table, Rows& rows) {
    std::size_t width = 1;
    table.for_names([&](const std::string&) { ++width; });
    std::string header =
        width == 1
            ? fmt::format("{{'descr': '|i1', 'fortran_order': False, 'shape': ({},), }}", table.codes.size())
            : fmt::format("{{'descr': '<f8', 'fortran_order': False, 'shape': ({}, {}), }}", table.codes.size(),
                          width);
    constexpr std::size_t before = 10, alignment = 64;  // the data begin at a multiple of 64
    header.resize((before + header.size() + alignment) / alignment * alignment - before - 1, ' ');
    header += '\n';
    rows.text({"\x93NUMPY\x01\x00", 8});
    rows.raw(static_cast<std::uint16_t>(header.size()));
    rows.text(header);
    for (std::size_t i = 0; i < table.codes.size(); ++i) {
        if (width == 1)
            rows.raw(table.codes[i]);
        else
            rows.raw(double(table.codes[i]));
        table.for_values(i, [&](double value) { rows.raw(value); });
        rows.end_row();
    }
}

void write_lines(const Table& table, Rows& rows, std::string_view separator) {
    for (std::size_t i = 0; i < table.codes.size(); ++i) {
        for (int axis = 0; axis < 3; ++axis) {
            rows.digits(table.points[i][axis]);
            rows.text(separator);
        }
        rows.digits(table.codes[i]);
        table.for_values(i, [&](double value) {
            rows.text(separator);
            rows.digits(value);
        });
        rows.text("\n");
        rows.end_row();
    }
}

void write_csv(const Table& table, Rows& rows) {
    rows.text("x,y,z,code");
    table.for_names([&](const std::string& name) { rows.text("," + name); });
    rows.text("\n");
    write_lines(table, rows, ",");
}

void write_xyz(const Table& table, Rows& rows) {
    write_lines(table, rows, " ");
}

void write_ply(const Table& table, Rows& rows) {
    rows.text(
        fmt::format("ply\nformat binary_little_endian 1.0\nelement vertex {}\nproperty double x\nproperty "
                    "double y\nproperty double z\nproperty char code\n",
                    table.codes.size()));
    table.for_names([&](const std::string& name) { rows.text("property double " + name + "\n"); });
    rows.text("end_header\n");
    for (std::size_t i = 0; i < table.codes.size(); ++i) {
        for (int axis = 0; axis < 3; ++axis) rows.raw(table.points[i][axis]);
        rows.raw(table.codes[i]);
        table.for_values(i, [&](double value) { rows.raw(value); });
        rows.end_row();
    }
}

}  // namespace

void write_points(const std::filesystem::path& path, std::span<const Vec3> points,
                  std::span<const std::int8_t> codes, std::span<const PointColumns> columns) {
    check_points_extension(path);
    if (codes.size() != points.size())
        throw OptionError(fmt::format("{} codes for {} points", codes.size(), points.size()));
    for (const PointColumns& c : columns)
        if (c.values.size() != c.names.size() * points.size())
            throw OptionError(fmt::format("{} values in {} columns for {} points", c.values.size(),
                                          c.names.size(), points.size()));
    const std::string extension = lower_extension(path);
    Rows rows(path);
    (extension == ".npy"   ? write_npy
     : extension == ".csv" ? write_csv
     : extension == ".xyz" ? write_xyz
                           : write_ply)({points, codes, columns}, rows);
    rows.commit();
}

}  // namespace its
