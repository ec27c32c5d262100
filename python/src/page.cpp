#include "its/page.h"

#include <nanobind/stl/string.h>

#include "calls.h"
#include "module.h"
#include "options.h"
#include "shell.h"

namespace its::python {

namespace {

std::string page(const Shell& shell, const nb::dict& given, int threads, const nb::object& observer) {
    ViewOptions options;
    take(given, "title", options.title);
    take(given, "up", options.up);
    take(given, "resolution", options.resolution);
    take(given, "max_triangles", options.max_triangles);
    take(given, "max_memory", options.max_memory);
    return watched({observer, threads}, [&](const Run& run) {
        options.run = run;
        return view_page(shell.shell(), options);
    });
}

}  // namespace

void bind_page(nb::module_& module) {
    auto shell = nb::borrow<nb::class_<Shell>>(module.attr("Shell"));
    shell.def("page", page, nb::arg("options"), nb::arg("threads"), nb::arg("observer").none(),
              nb::sig("def page(self, options: dict[str, typing.Any], threads: int, observer: "
                      "collections.abc.Callable[[str, float], bool] | None) -> str"));
}

}  // namespace its::python
