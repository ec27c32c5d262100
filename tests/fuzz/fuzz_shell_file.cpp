#include <cstdint>
#include <cstring>
#include <memory>
#include <span>
#include <utility>
#include <vector>

#include "its/query.h"
#include "shell/access.h"
#include "shell_file/format.h"
#include "shell_file/shell_file.h"

namespace {

/// Asks everything that a quickly loaded shell may be asked: no answer need be right, none may do harm.
void use(its::shell::ShellData data) {
    const its::ThinShell shell = its::shell::Access::make(std::move(data));
    const its::Query query(shell);
    const its::Box& root = shell.info().root;
    for (const its::Vec3& v : shell.mesh().vertices) (void)query.classify(v);
    constexpr int n = 9;  // points on and between lattice planes
    for (int i = 0; i < n * n * n; ++i) {
        its::Vec3 p;
        for (int axis = 0, left = i; axis < 3; ++axis, left /= n)
            p[axis] = root.min[axis] + (root.max[axis] - root.min[axis]) * (left % n) / (n - 1);
        (void)query.classify(p);
        (void)query.classify_shell(p);
        (void)query.value(p);
        (void)query.gradient(p);
        (void)shell.value(p);
    }
}

}  // namespace

/// The reader of .its files, past its checksums: whatever decodes must be valid and, if it has the version that
/// is written, encode to the same bytes; what decodes without an examination of its numbers must be safe to
/// use.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    const auto input = std::as_bytes(std::span(data, size));
    std::vector<std::byte> file(input.begin(), input.end());
    its::shell_file::mend_checksums(file);
    try {
        use(its::shell_file::decode(file, "shell", its::LoadCheck::quick));
        const its::shell::ShellData full = its::shell_file::decode(file);
        std::uint32_t version = 0;
        std::memcpy(&version, file.data() + 8, sizeof(version));
        if (version == its::shell_file::version && its::shell_file::encode(full) != file) __builtin_trap();
    } catch (const its::InputError&) {
    }
    return 0;
}
