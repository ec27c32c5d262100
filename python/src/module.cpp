#include "module.h"

#include "its/version.h"

NB_MODULE(_its, module) {
    using namespace its::python;
    module.doc() = "The library behind the package its, which see: this module has no stable interface.";
    module.attr("version") = ITS_VERSION;
    bind_errors(module);
    bind_files(module);
    bind_meshes(module);
    bind_shell(module);
    bind_query(module);
    bind_surface(module);
    bind_simplify(module);
    bind_verify(module);
    bind_wrap(module);
#ifdef ITS_PAGE
    bind_page(module);
    module.attr("has_page") = true;
#else
    module.attr("has_page") = false;
#endif
}
