#include <fmt/format.h>
#include <algorithm>
#include <array>
#include <bit>
#include <charconv>
#include <cmath>
#include <cstring>
#include <limits>
#include <span>
#include <string>

#include "base/output_file.h"
#include "geometry/vec3.h"
#include "its/mesh.h"
#include "mesh/readers.h"

namespace its {

namespace {

/// Text and numbers, buffered on their way into a file that appears complete or not at all.
class NewFile {
public:
    explicit NewFile(const std::filesystem::path& path) : file_(path) { buffer_.reserve(capacity + 256); }

    NewFile& operator<<(std::string_view text) {
        buffer_.append(text);
        if (buffer_.size() >= capacity) flush();
        return *this;
    }
    /// The shortest text that reads back as the same number.
    NewFile& operator<<(double value) { return *this << number(value); }
    NewFile& operator<<(std::uint64_t value) { return *this << number(value); }

    /// The bytes of a number, least significant first.
    template <class T>
    NewFile& raw(T value) {
        std::array<char, sizeof(T)> bytes;
        std::memcpy(bytes.data(), &value, sizeof(T));
        if constexpr (std::endian::native == std::endian::big) std::reverse(bytes.begin(), bytes.end());
        return *this << std::string_view(bytes.data(), bytes.size());
    }

    /// Gives the file its name. \throws FileError if any byte could not be written (a full disk).
    void commit() {
        flush();
        file_.commit();
    }

private:
    static constexpr std::size_t capacity = std::size_t{1} << 20;

    template <class T>
    std::string_view number(T value) {
        const auto [end, error] = std::to_chars(text_, text_ + sizeof text_, value);
        return {text_, std::size_t(end - text_)};
    }
    void flush() {
        file_.write(std::as_bytes(std::span(buffer_)));
        buffer_.clear();
    }

    OutputFile file_;
    std::string buffer_;
    char text_[32];
};

void write_obj(const Mesh& mesh, NewFile& file) {
    for (const Vec3& v : mesh.vertices) file << "v " << v.x << " " << v.y << " " << v.z << "\n";
    for (const auto& [a, b, c] : mesh.triangles) {
        file << "f " << std::uint64_t{a} + 1 << " " << std::uint64_t{b} + 1 << " " << std::uint64_t{c} + 1
             << "\n";
    }
}

void write_off(const Mesh& mesh, NewFile& file) {
    file << "OFF\n"
         << std::uint64_t{mesh.vertices.size()} << " " << std::uint64_t{mesh.triangles.size()} << " 0\n";
    for (const Vec3& v : mesh.vertices) file << v.x << " " << v.y << " " << v.z << "\n";
    for (const auto& [a, b, c] : mesh.triangles) {
        file << "3 " << std::uint64_t{a} << " " << std::uint64_t{b} << " " << std::uint64_t{c} << "\n";
    }
}

void write_ply(const Mesh& mesh, NewFile& file) {
    // Signed indices are what most programs expect; they do for all but the largest meshes.
    const bool small = mesh.vertices.size() <= std::size_t{std::numeric_limits<std::int32_t>::max()};
    file << "ply\nformat binary_little_endian 1.0\nelement vertex " << std::uint64_t{mesh.vertices.size()}
         << "\nproperty double x\nproperty double y\nproperty double z\nelement face "
         << std::uint64_t{mesh.triangles.size()} << "\nproperty list uchar " << (small ? "int" : "uint")
         << " vertex_indices\nend_header\n";
    for (const Vec3& v : mesh.vertices) file.raw(v.x).raw(v.y).raw(v.z);
    for (const auto& [a, b, c] : mesh.triangles) file.raw(std::uint8_t{3}).raw(a).raw(b).raw(c);
}

/// Coordinates are rounded to 32 bits: the format has no others.
void write_stl(const Mesh& mesh, NewFile& file) {
    if (mesh.triangles.size() > std::numeric_limits<std::uint32_t>::max()) {
        throw InputError("an STL file holds at most 4294967295 triangles; write .ply instead");
    }
    std::string header = "binary STL";  // must not begin with "solid"
    header.resize(80, ' ');
    file << header;
    file.raw(std::uint32_t(mesh.triangles.size()));
    const auto put = [&](Vec3 v) { file.raw(float(v.x)).raw(float(v.y)).raw(float(v.z)); };
    for (const Triangle& t : mesh.triangles) {
        const Vec3 a = mesh.vertices[t[0]], b = mesh.vertices[t[1]], c = mesh.vertices[t[2]];
        const Vec3 n = cross(b - a, c - a);
        const double length = norm(n);
        put(length > 0 && std::isfinite(length) ? (1 / length) * n : Vec3{});
        put(a), put(b), put(c);
        file.raw(std::uint16_t{0});
    }
}

/// \throws InputError on what would make a file that cannot be read back.
void check(const Mesh& mesh, bool single_precision) {
    const double limit =
        single_precision ? double{std::numeric_limits<float>::max()} : std::numeric_limits<double>::max();
    for (std::size_t i = 0; i < mesh.vertices.size(); ++i) {
        const Vec3 v = mesh.vertices[i];
        for (int axis = 0; axis < 3; ++axis) {
            if (!(std::abs(v[axis]) <= limit)) {
                throw InputError(
                    fmt::format("cannot write vertex {}: its coordinate {} is beyond {}", i, v[axis],
                                single_precision ? "the 32-bit numbers of STL; use .ply" : "all numbers"));
            }
        }
    }
    for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
        for (const std::uint32_t v : mesh.triangles[i]) {
            if (v >= mesh.vertices.size()) {
                throw InputError(fmt::format("cannot write triangle {}: it uses vertex {} of {}", i, v,
                                             mesh.vertices.size()));
            }
        }
    }
}

}  // namespace

void write_mesh(const Mesh& mesh, const std::filesystem::path& path) {
    const std::string extension = lower_extension(path);
    void (*writer)(const Mesh&, NewFile&) = extension == ".obj"   ? write_obj
                                            : extension == ".stl" ? write_stl
                                            : extension == ".ply" ? write_ply
                                            : extension == ".off" ? write_off
                                                                  : nullptr;
    if (writer == nullptr) {
        throw OptionError(
            fmt::format("cannot write '{}': the extension must be .obj, .stl, .ply or .off", path.string()));
    }
    check(mesh, writer == write_stl);
    NewFile file(path);
    writer(mesh, file);
    file.commit();
}

}  // namespace its
