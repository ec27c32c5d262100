#include "its/surface.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "support/zoo.h"
#include "surface/cgal_judge.h"

namespace its {
namespace {

ThinShell build_at(const Mesh& mesh, int depth) {
    BuildOptions options;
    options.depth = depth;
    return build(mesh, options);
}

TEST(Surface, WrapsEveryMeshOfTheZoo) {
    for (const auto& entry : zoo::all())
        for (const int depth : {2, 4, 5}) {
            SCOPED_TRACE(entry.name + " K=" + std::to_string(depth));
            const ThinShell shell = build_at(entry.mesh, depth);
            const Surface outer = extract_surface(shell);
            EXPECT_EQ(judge::surface_defects(outer.mesh), "");
            EXPECT_TRUE(outer.report.certified) << outer.report.reason;
            EXPECT_GT(outer.report.margin, 0);
            EXPECT_EQ(judge::triangles_meeting(entry.mesh, outer.mesh), 0);
            EXPECT_EQ(judge::vertices_not_inside(entry.mesh, outer.mesh), 0);

            const Surface inner = extract_surface(shell, {.side = SurfaceSide::inner});
            if (inner.report.empty) continue;
            EXPECT_TRUE(inner.report.certified) << inner.report.reason;
            EXPECT_EQ(judge::surface_defects(inner.mesh), "");
            EXPECT_EQ(judge::triangles_meeting(entry.mesh, inner.mesh), 0);
            if (entry.closed_oriented && entry.name != "overlapping_spheres") {  // CGAL's sides are by parity
                EXPECT_EQ(judge::surface_not_inside(inner.mesh, entry.mesh), 0);
            }
        }
}

}  // namespace
}  // namespace its
