#pragma once

#include <string>

#include "its/inspect.h"
#include "report.h"

/// What is said about closed parts that face the wrong way.
namespace its::cli {

/// Whether it matters for the rule where triangles face.
bool goes_by_directions(SignRule rule);

Json parts_json(const PartsReport& parts);

/// How many closed parts there are, and the wrong ones by name, place, size and volume.
void add_part_rows(Table& table, const PartsReport& parts);

/// One warning, if any part faces the wrong way. `turned`: those that can be were turned around.
void warn_of_parts(const std::string& file, const PartsReport& parts, bool turned);

}  // namespace its::cli
