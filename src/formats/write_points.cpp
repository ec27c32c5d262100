#include <fmt/format.h>

#include "formats/point_readers.h"
#include "formats/readers.h"
#include "formats/sink.h"

namespace its {
using namespace formats;

namespace {

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

void write_npy(const Table& table, NewFile& file) {
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
    file << std::string_view("\x93NUMPY\x01\x00", 8);
    file.raw(static_cast<std::uint16_t>(header.size()));
    file << header;
    for (std::size_t i = 0; i < table.codes.size(); ++i) {
        if (width == 1)
            file.raw(table.codes[i]);
        else
            file.raw(double(table.codes[i]));
        table.for_values(i, [&](double value) { file.raw(value); });
    }
}

void write_lines(const Table& table, NewFile& file, std::string_view separator) {
    for (std::size_t i = 0; i < table.codes.size(); ++i) {
        for (int axis = 0; axis < 3; ++axis) file << table.points[i][axis] << separator;
        file << double(table.codes[i]);
        table.for_values(i, [&](double value) { file << separator << value; });
        file << "\n";
    }
}

void write_csv(const Table& table, NewFile& file) {
    file << "x,y,z,code";
    table.for_names([&](const std::string& name) { file << "," << name; });
    file << "\n";
    write_lines(table, file, ",");
}

void write_xyz(const Table& table, NewFile& file) {
    write_lines(table, file, " ");
}

void write_ply(const Table& table, NewFile& file) {
    file << "ply\nformat binary_little_endian 1.0\nelement vertex " << std::uint64_t{table.codes.size()}
         << "\nproperty double x\nproperty double y\nproperty double z\nproperty int code\n";
    table.for_names([&](const std::string& name) { file << "property double " << name << "\n"; });
    file << "end_header\n";
    for (std::size_t i = 0; i < table.codes.size(); ++i) {
        for (int axis = 0; axis < 3; ++axis) file.raw(table.points[i][axis]);
        file.raw(std::int32_t{table.codes[i]});
        table.for_values(i, [&](double value) { file.raw(value); });
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
    NewFile file(path);
    (extension == ".npy"   ? write_npy
     : extension == ".csv" ? write_csv
     : extension == ".xyz" ? write_xyz
                           : write_ply)({points, codes, columns}, file);
    file.commit();
}

}  // namespace its
