#include "its/verify.h"

#include "verify/checks.h"

namespace its {

VerifyReport verify(const ThinShell& shell, const Mesh& mesh, const VerifyOptions& options) {
    return verifier::judge(
        shell.data(), [&shell](const Vec3& p) { return shell.value(p); }, mesh, options);
}

}  // namespace its
