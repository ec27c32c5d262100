#include "parts.h"

#include <fmt/core.h>

#include <algorithm>

namespace its::cli {

namespace {

constexpr std::size_t most_rows = 20;  // of a table; --json has all

std::string position_text(const Vec3& p) {
    return fmt::format("({:.6g}, {:.6g}, {:.6g})", p.x, p.y, p.z);
}

std::string_view fault_text(PartFault fault) {
    return fault == PartFault::inside_out ? "inside out" : "faces as the part around it";
}

std::string part_text(const WrongPart& part) {
    return fmt::format("{}{}: {} to {}, volume {:.6g}, {} triangles from number {}", fault_text(part.fault),
                       part.overlaps ? ", and overlaps others" : "", position_text(part.bounds.min),
                       position_text(part.bounds.max), part.volume, count_text(part.triangles),
                       part.first_triangle);
}

}  // namespace

bool goes_by_directions(SignRule rule) {
    return rule == SignRule::winding || rule == SignRule::generalized;
}

Json parts_json(const PartsReport& parts) {
    Json json;
    json["closed"] = parts.closed;
    json["nested"] = parts.nested;
    json["overlapping"] = parts.overlapping;
    json["to_turn"] = parts.to_turn;
    json["wrong"] = Json::array();
    for (const WrongPart& part : parts.wrong)
        json["wrong"].push_back({{"fault", name(part.fault)},
                                 {"triangles", part.triangles},
                                 {"first_triangle", part.first_triangle},
                                 {"bounds", box_json(part.bounds)},
                                 {"volume", part.volume},
                                 {"depth", part.depth},
                                 {"overlaps", part.overlaps}});
    return json;
}

void add_part_rows(Table& table, const PartsReport& parts) {
    if (parts.closed > 1)
        table.row("Closed parts",
                  fmt::format("{}: {} lie in others, {} overlap others", count_text(parts.closed),
                              count_text(parts.nested), count_text(parts.overlapping)));
    for (std::size_t i = 0; i < std::min(parts.wrong.size(), most_rows); ++i)
        table.row("Wrong part", part_text(parts.wrong[i]));
    if (parts.wrong.size() > most_rows)
        table.row("", fmt::format("and {} more; --json has all", count_text(parts.wrong.size() - most_rows)));
}

void warn_of_parts(const std::string& file, const PartsReport& parts, bool turned) {
    if (parts.wrong.empty() || (turned && parts.to_turn > 0)) return;
    const std::string what =
        parts.wrong.size() == 1
            ? fmt::format("a closed part faces the wrong way: {}", part_text(parts.wrong.front()))
            : fmt::format("{} closed parts face the wrong way, the first: {}", parts.wrong.size(),
                          part_text(parts.wrong.front()));
    print_message("warning", fmt::format("{}: {}; {}", file, what,
                                         parts.to_turn > 0 ? "--turn-parts turns parts around by nesting"
                                                           : "--turn-parts cannot tell what is meant"));
}

}  // namespace its::cli
