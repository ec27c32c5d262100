#include "its/verify.h"

#include "base/parallel.h"
#include "its/stopwatch.h"
#include "shell/access.h"
#include "verify/checks.h"

namespace its {

VerifyReport verify(const ThinShell& shell, const MeshView& mesh, const VerifyOptions& options) {
    const Stopwatch watch;
    const Mesh copy = to_mesh(mesh);
    VerifyReport report = verifier::judge(
        shell::Access::data(shell), [&shell](const Vec3& p) { return shell.value(p); }, copy, options);
    report.seconds.total = watch.seconds();
    return report;
}

}  // namespace its
