#include "geometry/fan_batch.h"

#include "geometry/bernstein.h"

namespace its::geometry {

ITS_CLONES void bound(FanBatch& batch) {
    for (int i = 0; i < FanBatch::lanes; ++i) {
        const double corners[8] = {batch.corner[0][i], batch.corner[1][i], batch.corner[2][i],
                                   batch.corner[3][i], batch.corner[4][i], batch.corner[5][i],
                                   batch.corner[6][i], batch.corner[7][i]};
        const Sample p = sample(corners, {batch.p[0][i], batch.p[1][i], batch.p[2][i]});
        const Sample q = sample(corners, {batch.q[0][i], batch.q[1][i], batch.q[2][i]});
        const Sample r = sample(corners, {batch.r[0][i], batch.r[1][i], batch.r[2][i]});
        const Bounds b = bernstein_bounds(corners, p, q, r);
        batch.lower[i] = b.lower;
        batch.upper[i] = b.upper;
        batch.least[i] = b.least;
        batch.most[i] = b.most;
    }
}

}  // namespace its::geometry
