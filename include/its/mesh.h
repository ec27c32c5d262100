#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string_view>
#include <vector>

#include "its/base.h"

/// Triangle meshes and their attributes.
namespace ITS_API its {

/// The numbers that a result's coordinates are. It is made of them, not rounded to them afterwards: what is
/// proven of it then holds for a file that keeps no others.
enum class Coordinates : std::uint8_t {
    doubles,
    single,         ///< 32-bit numbers, as in STL
    single_offset,  ///< 32-bit numbers relative to the report's `origin`, as in GLB
};

/// Which axis of the coordinates points upwards, as far as a file's format says so.
enum class UpAxis : std::uint8_t { unknown, x, y, z };

using Triangle = std::array<std::uint32_t, 3>;

/// An indexed triangle mesh. Any triangles: open, non-manifold, degenerate, in any order. The surface M
/// is the union of its triangles; vertices that no triangle uses are not part of it.
struct Mesh {
    std::vector<Vec3> vertices;
    std::vector<Triangle> triangles;  ///< counter-clockwise seen from outside, where there is an outside
};

/// The type of the numbers of an array in memory, in the machine's byte order.
enum class NumberType : std::uint8_t { float32, float64, int16, uint16, int32, uint32, int64, uint64 };

/// "float32", "float64", "int16", …: numpy's names.
std::string_view name(NumberType type);
/// The type of that name; empty: there is none.
std::optional<NumberType> parse_number_type(std::string_view name);

/// Rows of three numbers in memory of somebody else: a numpy array of any order and strides, an attribute or
/// the index of a BufferGeometry, a vector of Vec3 or Triangle. Strides are in bytes; they may be negative, and
/// none needs to be a multiple of the number's size.
struct ArrayView {
    const void* data = nullptr;  ///< the first number of the first row
    NumberType type = NumberType::float64;
    std::uint64_t count = 0;  ///< of rows
    std::ptrdiff_t row_stride = 3 * sizeof(double), column_stride = sizeof(double);

    ArrayView() = default;
    ArrayView(const void* first, NumberType number_type, std::uint64_t rows, std::ptrdiff_t bytes_to_next_row,
              std::ptrdiff_t bytes_to_next_column)
        : data(first),
          type(number_type),
          count(rows),
          row_stride(bytes_to_next_row),
          column_stride(bytes_to_next_column) {}
    ArrayView(std::span<const Vec3> points)
        : ArrayView(points.data(), NumberType::float64, points.size(), 24, 8) {}
    ArrayView(std::span<const Triangle> triangles)
        : ArrayView(triangles.data(), NumberType::uint32, triangles.size(), 12, 4) {}

    // Numbers one after another, three a row. \throws InputError unless their count is a multiple of 3
    explicit ArrayView(std::span<const float> numbers);
    explicit ArrayView(std::span<const double> numbers);
    explicit ArrayView(std::span<const std::uint16_t> numbers);
    explicit ArrayView(std::span<const std::int32_t> numbers);
    explicit ArrayView(std::span<const std::uint32_t> numbers);
    explicit ArrayView(std::span<const std::int64_t> numbers);
    explicit ArrayView(std::span<const std::uint64_t> numbers);
};

/// A mesh in arrays of any layout, which belong to the caller and must stay as they are until the call that is
/// given it returns. Every function that reads a mesh takes one, and a Mesh becomes one by itself.
///
/// What is copied: nothing where vertices are float64 and triangles uint32, both without gaps (as in Mesh, and
/// in numpy arrays in C order of these types). Another array is copied into that layout for the time of the
/// call: 24 bytes a vertex, 12 bytes a triangle. Functions that keep a mesh beyond the call (build(),
/// ClosestPoints, ClosestSides) say so, and copy it besides.
///
/// A function that reads a mesh throws InputError for vertices that are no floating-point numbers, triangles
/// that are, rows without data, indices that no Triangle can hold (negative, or above 4,294,967,295), and a
/// number of vertices without triangles that is no multiple of 3; MemoryError if there is no room for a copy.
struct MeshView {
    ArrayView vertices;                  ///< x, y, z: float32 or float64; mesh units
    std::optional<ArrayView> triangles;  ///< integers from 0; empty: triangle t has vertices 3t, 3t + 1, 3t + 2

    MeshView() = default;
    MeshView(const Mesh& mesh)
        : vertices(std::span(mesh.vertices)), triangles(ArrayView(std::span(mesh.triangles))) {}
    explicit MeshView(const ArrayView& points) : vertices(points) {}
    MeshView(const ArrayView& points, const ArrayView& corners) : vertices(points), triangles(corners) {}
};

/// A copy of its own.
/// \throws as MeshView says
Mesh to_mesh(const MeshView& mesh);

/// Values at the corners of a mesh's triangles: corner k of triangle t has values[corners[t][k]]. Where
/// triangles meet, equal values mean that the attribute is continuous there, and different ones a seam.
template <class Value>
struct CornerValues {
    std::vector<Value> values;
    std::vector<Triangle> corners;  ///< as many as the mesh has triangles; empty: no such attribute

    bool empty() const { return corners.empty(); }
    const Value& at(std::size_t triangle, std::size_t corner) const {
        return values[corners[triangle][corner]];
    }
};

using Colour = std::array<float, 4>;         ///< red, green, blue (sRGB), alpha; in [0, 1]
using TexturePoint = std::array<double, 2>;  ///< u to the right, v upwards in the picture

/// What a mesh may have besides its shape. All values are finite.
struct MeshAttributes {
    CornerValues<Colour> colours;
    CornerValues<TexturePoint> texture;
    CornerValues<Vec3> normals;
    bool byte_colours = false;  ///< the file had colours of 8 bits; writers write such again

    bool empty() const { return colours.empty() && texture.empty() && normals.empty(); }
};

/// \throws InputError unless the attributes are of this mesh: their numbers in range, their values finite
void check_attributes(const MeshView& mesh, const MeshAttributes& attributes);

}  // namespace its
