#pragma once

#include <memory>
#include <mutex>

#include "its/distance.h"
#include "its/query.h"
#include "its/shell.h"

namespace its::python {

/// A shell with what answers questions about it. Immutable but for the search tree over its mesh, which is made
/// when it is first needed.
class Shell {
public:
    explicit Shell(const ThinShell& shell) : shell_(shell), query_(shell) {}

    const ThinShell& shell() const { return shell_; }
    const Query& query() const { return query_; }

    /// \throws as ClosestPoints; then the next call tries again
    const ClosestPoints& closest(const Run& run) {
        const std::lock_guard lock(mutex_);
        if (!closest_) closest_ = std::make_unique<const ClosestPoints>(shell_.mesh_view(), run);
        return *closest_;
    }

private:
    ThinShell shell_;
    Query query_;
    std::mutex mutex_;
    std::unique_ptr<const ClosestPoints> closest_;
};

}  // namespace its::python
