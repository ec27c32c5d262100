#include "its/verify.h"

#include <nanobind/stl/optional.h>
#include <nanobind/stl/string.h>

#include "arrays.h"
#include "calls.h"
#include "its/verify_cage.h"
#include "module.h"
#include "options.h"
#include "shell.h"

namespace its::python {

namespace {

nb::dict dict_of(const VerifyCheck& check) {
    nb::dict dict;
    dict["name"] = check.name;
    dict["passed"] = check.passed;
    dict["complete"] = check.complete;
    dict["tested"] = check.tested;
    dict["violations"] = check.violations;
    dict["worst"] = check.worst;
    dict["detail"] = check.detail;
    return dict;
}

nb::list list_of(const std::vector<VerifyCheck>& checks) {
    nb::list list;
    for (const VerifyCheck& check : checks) list.append(dict_of(check));
    return list;
}

nb::dict dict_of(const VerifyReport& report) {
    nb::dict dict;
    dict["passed"] = report.passed();
    dict["checks"] = list_of(report.checks);
    dict["sampled_min"] = report.sampled_min;
    dict["sampled_max"] = report.sampled_max;
    dict["proven_min"] = report.proven_min;
    dict["proven_max"] = report.proven_max;
    return dict;
}

nb::dict verify_shell(const Shell& shell, const AnyArray& vertices, const std::optional<AnyArray>& faces,
                      const nb::dict& given, int threads, const nb::object& observer) {
    const MeshView mesh = mesh_view(vertices, faces);
    VerifyOptions options;
    take(given, "samples", options.samples);
    take(given, "seed", options.seed);
    take(given, "grid_samples", options.grid_samples);
    take(given, "complete", options.complete);
    return dict_of(watched({observer, threads}, [&](const Run& run) {
        options.run = run;
        return verify(shell.shell(), mesh, options);
    }));
}

nb::dict check_cage(const AnyArray& vertices, const std::optional<AnyArray>& faces,
                    const AnyArray& mesh_vertices, const std::optional<AnyArray>& mesh_faces,
                    const nb::dict& given, int threads, const nb::object& observer) {
    const MeshView cage = mesh_view(vertices, faces), mesh = mesh_view(mesh_vertices, mesh_faces);
    VerifyCageOptions options;
    take(given, "inner", options.inner);
    take(given, "clearance", options.clearance);
    take(given, "distance", options.distance);
    const VerifyCageReport report = watched({observer, threads}, [&](const Run& run) {
        options.run = run;
        return verify_cage(cage, mesh, options);
    });
    nb::dict dict;
    dict["passed"] = report.passed();
    dict["checks"] = list_of(report.checks);
    dict["nearest"] = report.nearest;
    dict["farthest"] = report.farthest;
    dict["cage_components"] = report.cage_components;
    dict["mesh_components"] = report.mesh_components;
    return dict;
}

}  // namespace

void bind_verify(nb::module_& module) {
    auto shell = nb::borrow<nb::class_<Shell>>(module.attr("Shell"));
    shell.def("verify", verify_shell, nb::arg("vertices"), nb::arg("faces").none(), nb::arg("options"),
              nb::arg("threads"), nb::arg("observer").none(),
              nb::sig("def verify(self, vertices: numpy.typing.NDArray[typing.Any], faces: "
                      "numpy.typing.NDArray[typing.Any] | None, options: dict[str, typing.Any], threads: "
                      "int, observer: collections.abc.Callable[[str, float], bool] | None) -> dict[str, "
                      "typing.Any]"));
    module.def(
        "verify_cage", check_cage, nb::arg("vertices"), nb::arg("faces").none(), nb::arg("mesh_vertices"),
        nb::arg("mesh_faces").none(), nb::arg("options"), nb::arg("threads"), nb::arg("observer").none(),
        nb::sig("def verify_cage(vertices: numpy.typing.NDArray[typing.Any], faces: "
                "numpy.typing.NDArray[typing.Any] | None, mesh_vertices: numpy.typing.NDArray[typing.Any], "
                "mesh_faces: numpy.typing.NDArray[typing.Any] | None, options: dict[str, typing.Any], threads: "
                "int, observer: collections.abc.Callable[[str, float], bool] | None) -> dict[str, "
                "typing.Any]"));
}

}  // namespace its::python
