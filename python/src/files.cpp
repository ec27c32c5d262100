#include "its/mesh_file.h"

#include <nanobind/stl/optional.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/vector.h>

#include "arrays.h"
#include "calls.h"
#include "module.h"
#include "options.h"

/// Files of meshes. Paths are bytes, as os.fsencode() makes them.
namespace its::python {

namespace {

std::string path_of(const nb::bytes& path) {
    return {path.c_str(), path.size()};
}

nb::object axis_of(UpAxis up) {
    if (up == UpAxis::unknown) return nb::none();
    return nb::str(up == UpAxis::x ? "x" : up == UpAxis::y ? "y" : "z");
}

UpAxis parse_axis(const std::string& axis) {
    if (axis.empty()) return UpAxis::unknown;
    if (axis == "x") return UpAxis::x;
    if (axis == "y") return UpAxis::y;
    if (axis == "z") return UpAxis::z;
    throw OptionError("up '" + axis + "': choose x, y or z");
}

nb::dict read(const nb::bytes& path, bool attributes, const nb::object& observer) {
    MeshFile file = watched({observer}, [path = path_of(path), attributes](const Run&) {
        return read_mesh(path, {.attributes = attributes});
    });
    nb::dict result;
    result["mesh"] = arrays_of(std::move(file.mesh));
    result["format"] = file.format;
    result["warnings"] = file.warnings;
    result["attributes"] = attributes_dict(std::move(file.attributes));
    result["up"] = axis_of(file.up);
    return result;
}

std::vector<std::string> write(const nb::bytes& path, const AnyArray& vertices,
                               const std::optional<AnyArray>& faces, const nb::dict& attributes, bool single,
                               const std::string& up) {
    const MeshView mesh = mesh_view(vertices, faces);
    const MeshAttributes values = attributes_of(attributes);
    const WriteOptions options{.single = single, .up = parse_axis(up)};
    return watched({nb::none()},
                   [&, path = path_of(path)](const Run&) { return write_mesh(mesh, values, path, options); });
}

}  // namespace

void bind_files(nb::module_& module) {
    module.def("read", read, nb::arg("path"), nb::arg("attributes"), nb::arg("observer").none(),
               nb::sig("def read(path: bytes, attributes: bool, observer: collections.abc.Callable[[str, "
                       "float], bool] | None) -> dict[str, typing.Any]"));
    module.def("write", write, nb::arg("path"), nb::arg("vertices"), nb::arg("faces").none(),
               nb::arg("attributes"), nb::arg("single"), nb::arg("up"),
               nb::sig("def write(path: bytes, vertices: numpy.typing.NDArray[typing.Any], faces: "
                       "numpy.typing.NDArray[typing.Any] | None, attributes: dict[str, typing.Any], single: "
                       "bool, up: str) -> list[str]"));
}

}  // namespace its::python
