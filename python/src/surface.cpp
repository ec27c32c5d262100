#include "its/surface.h"

#include <nanobind/stl/optional.h>
#include <nanobind/stl/string.h>

#include "arrays.h"
#include "calls.h"
#include "module.h"
#include "options.h"
#include "shell.h"

namespace its::python {

namespace {

nb::dict dict_of(const SurfaceReport& report) {
    nb::dict dict;
    dict["side"] = text(name(report.side));
    dict["level"] = report.level;
    dict["empty"] = report.empty;
    dict["certified"] = report.certified;
    dict["margin"] = report.margin;
    dict["lowest"] = report.lowest;
    dict["highest"] = report.highest;
    dict["reason"] = report.reason;
    dict["components"] = report.components;
    dict["components_enclosed"] = report.components_enclosed;
    dict["thickness_wanted"] = report.thickness_wanted;
    dict["depth_wanted"] = report.depth_wanted;
    dict["cell_width"] = report.cell_width;
    dict["cells"] = report.cells;
    return dict;
}

nb::tuple surface(const Shell& shell, const nb::dict& given, int threads, const nb::object& observer) {
    SurfaceOptions options;
    take_choice(given, "side", options.side, parse_surface_side);
    take(given, "level", options.level);
    take(given, "resolution", options.resolution);
    take(given, "certify", options.certify);
    take(given, "max_memory", options.max_memory);
    Surface surface = watched({observer, threads}, [&](const Run& run) {
        options.run = run;
        return extract_surface(shell.shell(), options);
    });
    return nb::make_tuple(arrays_of(std::move(surface.mesh)), dict_of(surface.report));
}

}  // namespace

void bind_surface(nb::module_& module) {
    auto shell = nb::borrow<nb::class_<Shell>>(module.attr("Shell"));
    shell.def("surface", surface, nb::arg("options"), nb::arg("threads"), nb::arg("observer").none(),
              nb::sig("def surface(self, options: dict[str, typing.Any], threads: int, observer: "
                      "collections.abc.Callable[[str, float], bool] | None) -> "
                      "tuple[tuple[numpy.typing.NDArray[numpy.float64], "
                      "numpy.typing.NDArray[numpy.uint32]], dict[str, typing.Any]]"));
}

}  // namespace its::python
