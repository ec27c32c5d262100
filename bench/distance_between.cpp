#include "distance_between.h"

#include "surface/measure.h"

namespace its::bench {

TwoDistances distances_between(const Mesh& a, const Mesh& b) {
    return {measure_distance(view(a), view(b), {}), measure_distance(view(b), view(a), {})};
}

}  // namespace its::bench
