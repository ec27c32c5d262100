#include "its/simplify.h"

#include <nanobind/stl/optional.h>
#include <nanobind/stl/string.h>

#include "arrays.h"
#include "calls.h"
#include "module.h"
#include "options.h"

namespace its::python {

namespace {

nb::dict dict_of(const SimplifyReport& report) {
    nb::dict dict;
    dict["faces_before"] = report.faces_before;
    dict["faces_after"] = report.faces_after;
    dict["vertices_before"] = report.vertices_before;
    dict["vertices_after"] = report.vertices_after;
    dict["collapses"] = report.collapses;
    dict["refused"] = report.refused;
    dict["stop"] = text(name(report.stop));
    dict["reason"] = text(reason(report.stop));
    dict["proven_bound"] = nb::cast(report.proven_bound);
    dict["seam_edges_before"] = report.seam_edges_before;
    dict["seam_edges_after"] = report.seam_edges_after;
    dict["in_shell"] = report.in_shell;
    return dict;
}

SimplifyOptions simplify_options(const nb::dict& given) {
    SimplifyOptions options;
    take_choice(given, "method", options.method, parse_simplify_method);
    take(given, "faces", options.faces);
    take(given, "tolerance", options.tolerance);
    take(given, "thickness", options.thickness);
    take(given, "depth", options.depth);
    take_choice(given, "sign", options.sign, parse_sign_rule);
    take(given, "turn_parts", options.turn_parts);
    take(given, "gamma", options.gamma);
    take(given, "no_self_intersections", options.no_self_intersections);
    take(given, "max_memory", options.max_memory);
    return options;
}

nb::tuple simplified(const AnyArray& vertices, const std::optional<AnyArray>& faces, const nb::dict& attributes,
                     const nb::dict& given, int threads, const nb::object& observer) {
    const MeshView mesh = mesh_view(vertices, faces);
    const MeshAttributes values = attributes_of(attributes);
    SimplifyOptions options = simplify_options(given);
    Simplified result = watched({observer, threads}, [&](const Run& run) {
        options.run = run;
        return simplify(mesh, values, options);
    });
    return nb::make_tuple(arrays_of(std::move(result.mesh)), attributes_dict(std::move(result.attributes)),
                          dict_of(result.report));
}

}  // namespace

void bind_simplify(nb::module_& module) {
    module.def("simplify", simplified, nb::arg("vertices"), nb::arg("faces").none(), nb::arg("attributes"),
               nb::arg("options"), nb::arg("threads"), nb::arg("observer").none(),
               nb::sig("def simplify(vertices: numpy.typing.NDArray[typing.Any], faces: "
                       "numpy.typing.NDArray[typing.Any] | None, attributes: dict[str, typing.Any], "
                       "options: dict[str, typing.Any], threads: int, observer: "
                       "collections.abc.Callable[[str, float], bool] | None) -> "
                       "tuple[tuple[numpy.typing.NDArray[numpy.float64], "
                       "numpy.typing.NDArray[numpy.uint32]], dict[str, typing.Any], dict[str, typing.Any]]"));
}

}  // namespace its::python
