#include "its/wrap.h"

#include <nanobind/stl/optional.h>
#include <nanobind/stl/string.h>

#include "arrays.h"
#include "calls.h"
#include "module.h"
#include "options.h"

namespace its::python {

namespace {

nb::dict dict_of(const WrapReport& report) {
    nb::dict dict;
    dict["side"] = text(name(report.side));
    dict["clearance"] = report.clearance;
    dict["slack"] = report.slack;
    dict["sign"] = text(name(report.sign));
    dict["empty"] = report.empty;
    dict["reason"] = report.reason;
    dict["lowest"] = report.lowest;
    dict["highest"] = report.highest;
    dict["mesh_components"] = report.mesh_components;
    dict["components"] = report.components;
    dict["volume"] = report.volume;
    dict["mesh_volume"] = nb::cast(report.mesh_volume);
    dict["cells"] = report.cells;
    dict["passes"] = report.passes;
    dict["to_mesh"] = nb::cast(report.to_mesh);
    dict["from_mesh"] = nb::cast(report.from_mesh);
    dict["seconds"] = report.seconds.total;
    return dict;
}

nb::tuple wrapped(const AnyArray& vertices, const std::optional<AnyArray>& faces, const nb::dict& given,
                  int threads, const nb::object& observer) {
    const MeshView mesh = mesh_view(vertices, faces);
    WrapOptions options;
    take(given, "clearance", options.clearance);
    take(given, "slack", options.slack);
    take_choice(given, "side", options.side, parse_wrap_side);
    take(given, "measure", options.measure);
    take(given, "max_memory", options.max_memory);
    bool single = false;
    take(given, "single", single);
    if (single) options.coordinates = Coordinates::single;
    Wrap result = watched({observer, threads}, [&](const Run& run) {
        options.run = run;
        return wrap(mesh, options);
    });
    return nb::make_tuple(arrays_of(std::move(result.mesh)), dict_of(result.report));
}

}  // namespace

void bind_wrap(nb::module_& module) {
    module.def("wrap", wrapped, nb::arg("vertices"), nb::arg("faces").none(), nb::arg("options"),
               nb::arg("threads"), nb::arg("observer").none(),
               nb::sig("def wrap(vertices: numpy.typing.NDArray[typing.Any], faces: "
                       "numpy.typing.NDArray[typing.Any] | None, options: dict[str, typing.Any], threads: int, "
                       "observer: collections.abc.Callable[[str, float], bool] | None) -> "
                       "tuple[tuple[numpy.typing.NDArray[numpy.float64], "
                       "numpy.typing.NDArray[numpy.uint32]], dict[str, typing.Any]]"));
}

}  // namespace its::python
