#include "mesh/arrays.h"

#include <fmt/format.h>

#include <cstring>
#include <limits>
#include <type_traits>
#include <utility>

#include "base/names.h"
#include "its/memory.h"

namespace its {

namespace {

constexpr Named<NumberType> number_types[] = {
    {NumberType::float32, "float32"}, {NumberType::float64, "float64"}, {NumberType::int16, "int16"},
    {NumberType::uint16, "uint16"},   {NumberType::int32, "int32"},     {NumberType::uint32, "uint32"},
    {NumberType::int64, "int64"},     {NumberType::uint64, "uint64"}};

constexpr std::uint64_t largest_index = std::numeric_limits<std::uint32_t>::max();

template <class Number>
constexpr NumberType type_of() {
    if (std::is_same_v<Number, float>) return NumberType::float32;
    if (std::is_same_v<Number, double>) return NumberType::float64;
    constexpr bool is_signed = std::is_signed_v<Number>;
    switch (sizeof(Number)) {
        case 2:
            return is_signed ? NumberType::int16 : NumberType::uint16;
        case 4:
            return is_signed ? NumberType::int32 : NumberType::uint32;
        default:
            return is_signed ? NumberType::int64 : NumberType::uint64;
    }
}

template <class Number>
ArrayView packed(std::span<const Number> numbers) {
    if (numbers.size() % 3 != 0)
        throw InputError(
            fmt::format("an array of {} numbers: rows of three need a multiple of 3", numbers.size()));
    const auto size = std::ptrdiff_t{sizeof(Number)};
    return {numbers.data(), type_of<Number>(), numbers.size() / 3, 3 * size, size};
}

/// fn(row, x, y, z) for each row of an array of this type, wherever its numbers are aligned.
template <class Number, class F>
void for_rows(const ArrayView& array, F&& fn) {
    const auto* const first = static_cast<const std::byte*>(array.data);
    for (std::uint64_t i = 0; i < array.count; ++i) {
        const std::byte* const row = first + std::int64_t(i) * array.row_stride;
        Number numbers[3];
        for (int k = 0; k < 3; ++k) std::memcpy(&numbers[k], row + k * array.column_stride, sizeof(Number));
        fn(i, numbers[0], numbers[1], numbers[2]);
    }
}

/// Whether the rows lie as those of std::span<const Own> do.
template <class Own, class Number>
bool lies_like(const ArrayView& array) {
    return array.row_stride == sizeof(Own) && array.column_stride == sizeof(Number) &&
           reinterpret_cast<std::uintptr_t>(array.data) % alignof(Own) == 0;
}

void require_data(const ArrayView& array, const char* what) {
    if (array.data == nullptr && array.count > 0)
        throw InputError(fmt::format("{}: {} rows without data", what, array.count));
}

/// Room for `count` rows.
/// \throws MemoryError
template <class Own>
void reserve(std::vector<Own>& rows, std::uint64_t count, const char* what) {
    const std::uint64_t bytes = count <= rows.max_size() ? count * sizeof(Own) : ~std::uint64_t{0};
    require_memory(bytes, 0, fmt::format("a copy of {} {}", count, what), "give arrays that need no copy");
    rows.resize(count);
}

template <class Number>
void copy_vertices(const ArrayView& array, std::vector<Vec3>& copies) {
    for_rows<Number>(array, [&](std::uint64_t i, Number x, Number y, Number z) {
        copies[i] = {double(x), double(y), double(z)};
    });
}

std::span<const Vec3> native_vertices(const ArrayView& array, std::vector<Vec3>& copies) {
    require_data(array, "vertices");
    if (array.count > largest_index)
        throw InputError(
            fmt::format("the mesh has {} vertices; at most {} can be used", array.count, largest_index));
    if (array.type == NumberType::float64 && lies_like<Vec3, double>(array))
        return {static_cast<const Vec3*>(array.data), array.count};
    if (array.type != NumberType::float64 && array.type != NumberType::float32)
        throw InputError(fmt::format("vertices of type {}: they must be float32 or float64", name(array.type)));
    reserve(copies, array.count, "vertices");
    if (array.type == NumberType::float64)
        copy_vertices<double>(array, copies);
    else
        copy_vertices<float>(array, copies);
    return copies;
}

/// \throws InputError for an index that no Triangle can hold
template <class Number>
std::uint32_t checked_index(std::uint64_t triangle, Number index) {
    if (std::cmp_less(index, 0) || std::cmp_greater(index, largest_index))
        throw InputError(fmt::format("triangle {} uses vertex {}, which cannot exist", triangle, index));
    return std::uint32_t(index);
}

template <class Number>
std::span<const Triangle> native_triangles(const ArrayView& array, std::vector<Triangle>& copies) {
    constexpr bool same_bits = sizeof(Number) == sizeof(std::uint32_t);
    if (same_bits && lies_like<Triangle, Number>(array)) {
        if (std::is_signed_v<Number>)
            for_rows<Number>(array, [](std::uint64_t i, Number a, Number b, Number c) {
                for (const Number v : {a, b, c}) checked_index(i, v);
            });
        return {static_cast<const Triangle*>(array.data), array.count};
    }
    reserve(copies, array.count, "triangles");
    for_rows<Number>(array, [&](std::uint64_t i, Number a, Number b, Number c) {
        copies[i] = {checked_index(i, a), checked_index(i, b), checked_index(i, c)};
    });
    return copies;
}

std::span<const Triangle> native_triangles(const ArrayView& array, std::vector<Triangle>& copies) {
    require_data(array, "triangles");
    switch (array.type) {
        case NumberType::int16:
            return native_triangles<std::int16_t>(array, copies);
        case NumberType::uint16:
            return native_triangles<std::uint16_t>(array, copies);
        case NumberType::int32:
            return native_triangles<std::int32_t>(array, copies);
        case NumberType::uint32:
            return native_triangles<std::uint32_t>(array, copies);
        case NumberType::int64:
            return native_triangles<std::int64_t>(array, copies);
        case NumberType::uint64:
            return native_triangles<std::uint64_t>(array, copies);
        case NumberType::float32:
        case NumberType::float64:
            break;
    }
    throw InputError(fmt::format("triangles of type {}: they must be whole numbers", name(array.type)));
}

/// Triangle t has vertices 3t, 3t + 1, 3t + 2.
std::span<const Triangle> triangles_in_order(std::uint64_t vertices, std::vector<Triangle>& copies) {
    if (vertices % 3 != 0)
        throw InputError(fmt::format("{} vertices without triangles: they must be a multiple of 3", vertices));
    reserve(copies, vertices / 3, "triangles");
    for (std::uint32_t v = 0; Triangle & t : copies) t = {v, v + 1, v + 2}, v += 3;
    return copies;
}

}  // namespace

std::string_view name(NumberType type) {
    return name_in(number_types, type);
}

std::optional<NumberType> parse_number_type(std::string_view name) {
    return value_in(number_types, name);
}

ArrayView::ArrayView(std::span<const float> numbers) : ArrayView(packed(numbers)) {}
ArrayView::ArrayView(std::span<const double> numbers) : ArrayView(packed(numbers)) {}
ArrayView::ArrayView(std::span<const std::uint16_t> numbers) : ArrayView(packed(numbers)) {}
ArrayView::ArrayView(std::span<const std::int32_t> numbers) : ArrayView(packed(numbers)) {}
ArrayView::ArrayView(std::span<const std::uint32_t> numbers) : ArrayView(packed(numbers)) {}
ArrayView::ArrayView(std::span<const std::int64_t> numbers) : ArrayView(packed(numbers)) {}
ArrayView::ArrayView(std::span<const std::uint64_t> numbers) : ArrayView(packed(numbers)) {}

Mesh mesh::copy_of(const Arrays& arrays) {
    return {{arrays.vertices.begin(), arrays.vertices.end()},
            {arrays.triangles.begin(), arrays.triangles.end()}};
}

ITS_API mesh::Native::Native(const MeshView& view) {
    arrays_.vertices = native_vertices(view.vertices, copies_.vertices);
    arrays_.triangles = view.triangles ? native_triangles(*view.triangles, copies_.triangles)
                                       : triangles_in_order(view.vertices.count, copies_.triangles);
}

Mesh to_mesh(const MeshView& mesh) {
    return mesh::copy_of(mesh::Native(mesh));
}

}  // namespace its
