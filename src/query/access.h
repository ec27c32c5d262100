#pragma once

#include "its/query.h"
#include "query/index.h"
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
};
