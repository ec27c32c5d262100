#pragma once

#include <atomic>
#include <cstdint>
#include <mutex>
#include <optional>

#include "its/inspect.h"
#include "its/query.h"
#include "query/index.h"
#include "query/open_sides.h"
#include "shell/access.h"

namespace its::query {

/// The library's own way to what is behind a Query.
struct Access {
    static const QueryIndex& index(const Query& query);
};

}  // namespace its::query

struct its::Query::Data {
    explicit Data(const ThinShell& source) : shell(source), index(shell::Access::data(shell)) {}

    ThinShell shell;
    query::QueryIndex index;

    const winding::MeshWinding& winding() const {
        if (index.open) return index.open->winding();
        std::call_once(once_, [this] {
            const shell::MeshArrays& mesh = index.shell.mesh;
            made_.emplace(mesh.vertices, mesh.triangles, index.shell.info.sign == SignRule::winding);
            bytes_ = made_->memory_bytes();
        });
        return *made_;
    }
    /// Of what winding() made.
    std::uint64_t winding_bytes() const { return bytes_; }

private:
    mutable std::once_flag once_;
    mutable std::optional<winding::MeshWinding> made_;  ///< where the index has none
    mutable std::atomic<std::uint64_t> bytes_ = 0;
};
