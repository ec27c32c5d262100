#include "its/verify.h"

#include <nanobind/stl/optional.h>
#include <nanobind/stl/string.h>

#include "arrays.h"
#include "calls.h"
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

nb::dict dict_of(const VerifyReport& report) {
    nb::dict dict;
    nb::list checks;
    for (const VerifyCheck& check : report.checks) checks.append(dict_of(check));
    dict["passed"] = report.passed();
    dict["checks"] = checks;
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

}  // namespace

void bind_verify(nb::module_& module) {
    auto shell = nb::borrow<nb::class_<Shell>>(module.attr("Shell"));
    shell.def("verify", verify_shell, nb::arg("vertices"), nb::arg("faces").none(), nb::arg("options"),
              nb::arg("threads"), nb::arg("observer").none(),
              nb::sig("def verify(self, vertices: numpy.typing.NDArray[typing.Any], faces: "
                      "numpy.typing.NDArray[typing.Any] | None, options: dict[str, typing.Any], threads: "
                      "int, observer: collections.abc.Callable[[str, float], bool] | None) -> dict[str, "
                      "typing.Any]"));
}

}  // namespace its::python
