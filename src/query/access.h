#pragma once

#include <memory>
#include <mutex>

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
            made_ =
                std::make_unique<winding::MeshWinding>(index.shell.mesh.vertices, index.shell.mesh.triangles,
                                                       index.shell.info.sign == SignRule::winding);
        });
        return *made_;
    }

private:
    mutable std::once_flag once_;
    mutable std::unique_ptr<winding::MeshWinding> made_;  ///< where the index has none
};
