#pragma once

#include <nanobind/nanobind.h>
#include <nanobind/ndarray.h>

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "its/mesh.h"

/// Arrays of Python and of the library. What Python hands in has been prepared by its._arrays: here its type
/// and shape are only checked.
namespace its::python {

namespace nb = nanobind;

using AnyArray = nb::ndarray<nb::ro, nb::device::cpu>;
using Points = nb::ndarray<const double, nb::shape<-1, 3>, nb::c_contig, nb::device::cpu>;
template <class Number>
using Out = nb::ndarray<Number, nb::ndim<1>, nb::c_contig, nb::device::cpu>;
template <class Number, std::size_t columns>
using OutRows = nb::ndarray<Number, nb::shape<-1, nb::ssize_t(columns)>, nb::c_contig, nb::device::cpu>;

/// The arrays must exist as long as the view.
/// \throws InputError for a shape or type that no mesh has
MeshView mesh_view(const AnyArray& vertices, const std::optional<AnyArray>& faces);

inline std::span<const Vec3> points_of(const Points& points) {
    return {reinterpret_cast<const Vec3*>(points.data()), points.shape(0)};
}
template <class Row, class Array>
std::span<Row> rows_of(const Array& out) {
    return {reinterpret_cast<Row*>(out.data()), out.shape(0)};
}

/// A numpy array that owns the vector: nothing is copied.
template <class Number, std::size_t columns, class Row>
nb::object array_of(std::vector<Row>&& rows) {
    static_assert(sizeof(Row) == columns * sizeof(Number));
    auto owned = std::make_unique<std::vector<Row>>(std::move(rows));
    auto* const numbers = reinterpret_cast<Number*>(owned->data());
    const std::size_t count = owned->size();
    const nb::capsule owner(owned.release(),
                            [](void* p) noexcept { delete static_cast<std::vector<Row>*>(p); });
    return nb::cast(nb::ndarray<nb::numpy, Number, nb::ndim<2>>(numbers, {count, columns}, owner));
}

/// (vertices, faces).
nb::tuple arrays_of(Mesh&& mesh);
/// The same of a mesh that `owner` keeps alive: read-only.
nb::tuple arrays_of(const MeshView& mesh, nb::handle owner);

/// {"colours": (values, corners), …}: what there is of it.
nb::dict attributes_dict(MeshAttributes&& attributes);
/// \throws InputError for arrays of another kind
MeshAttributes attributes_of(const nb::dict& attributes);

}  // namespace its::python
