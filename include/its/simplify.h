#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include "its/base.h"
#include "its/mesh.h"
#include "its/shell.h"

/// Mesh simplification by edge collapses, with a proven bound on the error.
namespace its {

enum class SimplifyMethod : std::uint8_t {
    certified,  ///< every triangle is proven to stay near M, and M near the result
    vertex,     ///< the paper's: new vertices stay in the shell
    priority,   ///< the paper's: quadric error + γ f²
    qem,        ///< quadric errors alone
};

struct SimplifyOptions {
    SimplifyMethod method = SimplifyMethod::certified;
    std::optional<std::uint64_t> faces = {};
    std::optional<double> tolerance = {};
    std::optional<int> depth = {};
    double gamma = 1;
    int threads = 0;
    Progress progress = {};
};

struct SimplifyReport {
    std::uint64_t faces_before = 0, faces_after = 0;
    double tolerance = 0;
    double seconds = 0;
    std::uint64_t tests = 0;
};

struct Simplified {
    Mesh mesh;
    SimplifyReport report;
};

Simplified simplify(const Mesh& mesh, const SimplifyOptions& options = {});

}  // namespace its
