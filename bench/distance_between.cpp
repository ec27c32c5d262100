#include "distance_between.h"

#include <algorithm>

#include "octree/lattice.h"
#include "surface/measure.h"

namespace its::bench {

TwoDistances distances_between(const Mesh& a, const Mesh& b) {
    Box box = bounds(a);
    const Box other = bounds(b);
    for (int axis = 0; axis < 3; ++axis) {
        box.min[axis] = std::min(box.min[axis], other.min[axis]);
        box.max[axis] = std::max(box.max[axis], other.max[axis]);
    }
    const Lattice lattice = make_lattice(box, 8);
    return {measure_distance(a, b, lattice, {}), measure_distance(b, a, lattice, {})};
}

}  // namespace its::bench
