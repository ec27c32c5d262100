#pragma once

#include <nanobind/nanobind.h>

/// The parts of the module, one source file each. It has what the package its is made of, without conversions
/// and defaults: those are Python's.
namespace its::python {

namespace nb = nanobind;

void bind_errors(nb::module_& module);
void bind_files(nb::module_& module);
void bind_meshes(nb::module_& module);
void bind_page(nb::module_& module);
void bind_query(nb::module_& module);
void bind_shell(nb::module_& module);
void bind_simplify(nb::module_& module);
void bind_surface(nb::module_& module);
void bind_verify(nb::module_& module);
void bind_wrap(nb::module_& module);

}  // namespace its::python
