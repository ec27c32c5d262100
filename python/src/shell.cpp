#include "shell.h"

#include <nanobind/stl/optional.h>
#include <nanobind/stl/shared_ptr.h>
#include <nanobind/stl/string.h>

#include <algorithm>
#include <cstddef>

#include "arrays.h"
#include "calls.h"
#include "its/shell_file.h"
#include "module.h"
#include "options.h"

/// Making shells, and what is known of them.
namespace its::python {

namespace {

using SharedShell = std::shared_ptr<Shell>;

BuildOptions build_options(const nb::dict& given) {
    BuildOptions options;
    take(given, "depth", options.depth);
    take(given, "thickness", options.thickness);
    take(given, "max_cells", options.max_cells);
    take(given, "max_depth", options.deepest);
    take_choice(given, "sign", options.sign, parse_sign_rule);
    take(given, "weld", options.weld);
    take(given, "turn_parts", options.turn_parts);
    take_choice(given, "extrema", options.extrema, parse_extrema);
    take(given, "max_memory", options.max_memory);
    return options;
}

SharedShell build_shell(const AnyArray& vertices, const std::optional<AnyArray>& faces, const nb::dict& given,
                        int threads, const nb::object& observer) {
    const MeshView mesh = mesh_view(vertices, faces);
    BuildOptions options = build_options(given);
    return watched({observer, threads}, [&](const Run& run) {
        options.run = run;
        return std::make_shared<Shell>(build(mesh, options));
    });
}

LoadOptions load_options(const nb::dict& given) {
    LoadOptions options;
    take_choice(given, "check", options.check, parse_load_check);
    take(given, "map", options.map);
    return options;
}

SharedShell load_shell(const nb::bytes& path, const nb::dict& given, int threads) {
    LoadOptions options = load_options(given);
    return watched({nb::none(), threads}, [&, path = std::string(path.c_str(), path.size())](const Run& run) {
        options.run = run;
        return std::make_shared<Shell>(load(path, options));
    });
}

SharedShell decode_shell(const nb::bytes& bytes, const nb::dict& given, int threads) {
    LoadOptions options = load_options(given);
    const std::span<const std::byte> span(reinterpret_cast<const std::byte*>(bytes.c_str()), bytes.size());
    return watched({nb::none(), threads}, [&](const Run& run) {
        options.run = run;
        return std::make_shared<Shell>(decode(span, options));
    });
}

void save_shell(const Shell& shell, const nb::bytes& path, int threads) {
    watched({nb::none(), threads}, [&, path = std::string(path.c_str(), path.size())](const Run& run) {
        save(shell.shell(), path, run);
    });
}

std::vector<std::byte> encoded(const Shell& shell, int threads) {
    return watched({nb::none(), threads}, [&](const Run& run) { return encode(shell.shell(), run); });
}

nb::bytes encode_shell(const Shell& shell, int threads) {
    const std::vector<std::byte> bytes = encoded(shell, threads);
    return nb::bytes(bytes.data(), bytes.size());
}

/// Whether both have the same bytes in a file. Shells of other inputs never do.
bool same_shell(const Shell& a, const Shell& b) {
    const ShellInfo &x = a.shell().info(), &y = b.shell().info();
    if (&x == &y) return true;
    if (x.input_hash != y.input_hash || x.cells != y.cells || x.mesh_triangles != y.mesh_triangles)
        return false;
    return encoded(a, 0) == encoded(b, 0);
}

nb::dict info(const Shell& shell) {
    const ShellInfo& info = shell.shell().info();
    nb::dict dict;
    dict["depth"] = info.depth;
    dict["sign"] = text(name(info.sign));
    dict["sign_reason"] = info.sign_reason;
    dict["extrema"] = text(name(info.extrema));
    dict["mesh_closed"] = info.mesh_closed;
    dict["mesh_vertices"] = info.mesh_vertices;
    dict["mesh_triangles"] = info.mesh_triangles;
    dict["weld"] = info.weld;
    dict["scale"] = info.scale;
    dict["cell_width"] = info.cell_width;
    dict["root"] = tuple_of(info.root);
    dict["epsilon_inner"] = info.epsilon_inner;
    dict["epsilon_outer"] = info.epsilon_outer;
    dict["thickness"] = info.thickness();
    dict["rounding"] = info.rounding;
    dict["surface_cells"] = info.surface_cells;
    dict["cells"] = info.cells;
    dict["memory_bytes"] = info.memory_bytes;
    dict["thickness_asked"] = info.thickness_asked;
    dict["coarse_cells"] = info.coarse_cells;
    dict["adaptive"] = info.adaptive;
    dict["input_hash"] = nb::make_tuple(info.input_hash[0], info.input_hash[1]);
    return dict;
}

nb::tuple mesh(nb::handle self) {
    return arrays_of(nb::cast<const Shell&>(self).shell().mesh_view(), self);
}

}  // namespace

void bind_shell(nb::module_& module) {
    nb::class_<Shell>(module, "Shell")
        .def("info", info, nb::sig("def info(self) -> dict[str, typing.Any]"))
        .def("mesh", mesh,
             nb::sig("def mesh(self) -> tuple[numpy.typing.NDArray[numpy.float64], "
                     "numpy.typing.NDArray[numpy.uint32]]"))
        .def("save", save_shell, nb::arg("path"), nb::arg("threads"))
        .def("encode", encode_shell, nb::arg("threads"))
        .def("same", same_shell, nb::arg("other"));
    module.def("build", build_shell, nb::arg("vertices"), nb::arg("faces").none(), nb::arg("options"),
               nb::arg("threads"), nb::arg("observer").none(),
               nb::sig("def build(vertices: numpy.typing.NDArray[typing.Any], faces: "
                       "numpy.typing.NDArray[typing.Any] | None, options: dict[str, typing.Any], threads: "
                       "int, observer: collections.abc.Callable[[str, float], bool] | None) -> Shell"));
    module.def("load", load_shell, nb::arg("path"), nb::arg("options"), nb::arg("threads"),
               nb::sig("def load(path: bytes, options: dict[str, typing.Any], threads: int) -> Shell"));
    module.def("decode", decode_shell, nb::arg("bytes"), nb::arg("options"), nb::arg("threads"),
               nb::sig("def decode(bytes: bytes, options: dict[str, typing.Any], threads: int) -> Shell"));
}

}  // namespace its::python
