// In place of lscg.cpp where the library is built without Eigen.
#include "field/lscg.h"

namespace its::field {

bool has_lscg() {
    return false;
}

Field solve_lscg(const octree::Octree&, const Field&, double, const Progress&, LscgReport*) {
    throw OptionError("the solver LSCG is not part of this library, which was built without Eigen");
}

}  // namespace its::field
