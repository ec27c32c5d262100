#include "arrays.h"

#include <cstddef>
#include <string>

namespace its::python {

namespace {

std::optional<NumberType> number_type(const nb::dlpack::dtype& type) {
    if (type.lanes != 1) return {};
    const char* prefix = nullptr;
    switch (nb::dlpack::dtype_code(type.code)) {
        case nb::dlpack::dtype_code::Float:
            prefix = "float";
            break;
        case nb::dlpack::dtype_code::Int:
            prefix = "int";
            break;
        case nb::dlpack::dtype_code::UInt:
            prefix = "uint";
            break;
        default:
            return {};
    }
    return parse_number_type(prefix + std::to_string(type.bits));
}

ArrayView view_of(const AnyArray& array, const char* what) {
    const std::optional<NumberType> type = number_type(array.dtype());
    if (!type || array.ndim() != 2 || array.shape(1) != 3)
        throw InputError(std::string(what) + ": an array of shape (n, 3) is needed");
    const auto size = std::ptrdiff_t(array.itemsize());
    return {array.data(), *type, array.shape(0), array.stride(0) * size, array.stride(1) * size};
}

template <class Number>
nb::object view_array(const ArrayView& array, nb::handle owner) {
    const auto size = std::ptrdiff_t{sizeof(Number)};
    return nb::cast(nb::ndarray<nb::numpy, const Number, nb::ndim<2>>(
        static_cast<const Number*>(array.data), {array.count, 3}, owner,
        {array.row_stride / size, array.column_stride / size}));
}

template <class Number, std::size_t columns, class Value>
void put(nb::dict& dict, const char* name, CornerValues<Value>&& attribute) {
    if (attribute.empty()) return;
    dict[name] = nb::make_tuple(array_of<Number, columns>(std::move(attribute.values)),
                                array_of<std::uint32_t, 3>(std::move(attribute.corners)));
}

template <class Number, std::size_t columns, class Value>
void get(const nb::dict& dict, const char* name, CornerValues<Value>& attribute) {
    if (!dict.contains(name)) return;
    const auto pair = nb::cast<nb::tuple>(dict[name]);
    const auto values = nb::cast<OutRows<const Number, columns>>(pair[0]);
    const auto corners = nb::cast<OutRows<const std::uint32_t, 3>>(pair[1]);
    const std::span<const Value> value_rows = rows_of<const Value>(values);
    const std::span<const Triangle> corner_rows = rows_of<const Triangle>(corners);
    attribute.values.assign(value_rows.begin(), value_rows.end());
    attribute.corners.assign(corner_rows.begin(), corner_rows.end());
}

}  // namespace

MeshView mesh_view(const AnyArray& vertices, const std::optional<AnyArray>& faces) {
    MeshView mesh(view_of(vertices, "vertices"));
    if (faces) mesh.triangles = view_of(*faces, "faces");
    return mesh;
}

nb::tuple arrays_of(Mesh&& mesh) {
    return nb::make_tuple(array_of<double, 3>(std::move(mesh.vertices)),
                          array_of<std::uint32_t, 3>(std::move(mesh.triangles)));
}

nb::tuple arrays_of(const MeshView& mesh, nb::handle owner) {
    return nb::make_tuple(view_array<double>(mesh.vertices, owner),
                          view_array<std::uint32_t>(mesh.triangles.value(), owner));
}

nb::dict attributes_dict(MeshAttributes&& attributes) {
    nb::dict dict;
    put<float, 4>(dict, "colours", std::move(attributes.colours));
    put<double, 2>(dict, "uv", std::move(attributes.texture));
    put<double, 3>(dict, "normals", std::move(attributes.normals));
    return dict;
}

MeshAttributes attributes_of(const nb::dict& dict) {
    MeshAttributes attributes;
    get<float, 4>(dict, "colours", attributes.colours);
    get<double, 2>(dict, "uv", attributes.texture);
    get<double, 3>(dict, "normals", attributes.normals);
    return attributes;
}

}  // namespace its::python
