#include "formats/slicer_parts.h"

#include <fmt/format.h>

#include <algorithm>
#include <tuple>
#include <utility>

#include "base/quote.h"
#include "formats/text.h"
#include "formats/xml.h"

namespace its::formats {

namespace {

/// What a part is, if not a solid, by the words of either kind of slicer; else nothing.
std::string_view kind_of(std::string_view word) {
    constexpr std::string_view modifier = "a modifier, which is not printed",
                               negative = "a negative volume, which is not subtracted here",
                               blocker = "a support blocker, which is not printed",
                               enforcer = "a support enforcer, which is not printed";
    constexpr std::pair<std::string_view, std::string_view> kinds[] = {
        {"modifier_part", modifier},    {"ParameterModifier", modifier}, {"negative_part", negative},
        {"NegativeVolume", negative},   {"support_blocker", blocker},    {"SupportBlocker", blocker},
        {"support_enforcer", enforcer}, {"SupportEnforcer", enforcer}};
    for (const auto& [known, kind] : kinds)
        if (word == known) return kind;
    return {};
}

/// A whole number of an attribute; −1 for what is none.
std::int64_t number_in(const XmlTag& tag, std::string_view attribute) {
    const auto text = tag.attribute(attribute);
    if (!text) return -1;
    Text number(*text);
    number.skip_space();
    return std::max<std::int64_t>(number.integer().value_or(-1), -1);
}

}  // namespace

SlicerParts::SlicerParts(const std::vector<ArchiveFile>& files) {
    for (const ArchiveFile& file : files) {
        std::string name = file.name;
        for (char& c : name) c = c >= 'A' && c <= 'Z' ? char(c - 'A' + 'a') : c;
        if (name.starts_with("metadata/") &&
            (name.ends_with("model.config") || name.ends_with("model_settings.config")))
            read(file);
    }
    std::sort(parts_.begin(), parts_.end(), [](const Part& a, const Part& b) {
        return std::tie(a.object, a.component, a.first, a.end) <
               std::tie(b.object, b.component, b.first, b.end);
    });
}

void SlicerParts::read(const ArchiveFile& file) {
    std::int64_t object = -1;
    Part volume;
    XmlTags tags(file.bytes);
    for (XmlTag tag; tags.next(tag);) {
        if (tag.name == "object") {
            object = tag.opens ? number_in(tag, "id") : -1;
        } else if (tag.name == "part" && tag.opens && object >= 0) {
            const std::int64_t component = number_in(tag, "id");
            const std::string_view kind = kind_of(tag.attribute("subtype").value_or(""));
            if (component >= 0 && !kind.empty()) parts_.push_back({object, component, 0, 0, kind, &file});
        } else if (tag.name == "volume") {
            if (!volume.kind.empty()) parts_.push_back(volume);
            volume = {};
            const std::int64_t first = number_in(tag, "firstid"), last = number_in(tag, "lastid");
            if (tag.opens && object >= 0 && first >= 0 && last >= first)
                volume = {object, -1, std::uint64_t(first), std::uint64_t(last) + 1, {}, &file};
        } else if (tag.name == "metadata" && tag.opens && volume.object >= 0) {
            const std::string_view key = tag.attribute("key").value_or(""),
                                   value = tag.attribute("value").value_or("");
            if (key == "volume_type") volume.kind = kind_of(value);
            if (key == "modifier" && value == "1" && volume.kind.empty())
                volume.kind = kind_of("ParameterModifier");
        }
    }
}

std::size_t SlicerParts::first_of(std::int64_t object) const {
    const auto found =
        std::lower_bound(parts_.begin(), parts_.end(), object,
                         [](const Part& part, std::int64_t wanted) { return part.object < wanted; });
    return std::size_t(found - parts_.begin());
}

bool SlicerParts::leaves_out(std::int64_t object, std::int64_t component) {
    const auto found = std::lower_bound(
        parts_.begin(), parts_.end(), std::pair(object, component),
        [](const Part& part, const auto& wanted) { return std::pair(part.object, part.component) < wanted; });
    if (component < 0 || found == parts_.end() || found->object != object || found->component != component)
        return false;
    found->used = true;
    return true;
}

std::vector<std::string> SlicerParts::lines() const {
    constexpr std::size_t most = 16;
    std::vector<std::string> lines;
    std::size_t more = 0;
    for (const Part& part : parts_) {
        if (!part.used) continue;
        if (lines.size() == most) {
            ++more;
            continue;
        }
        const std::string what = part.component >= 0
                                     ? fmt::format("part {}", part.component)
                                     : fmt::format("triangles {} to {}", part.first, part.end - 1);
        lines.push_back(fmt::format("{} of object {} left out: {} calls it {}", what, part.object,
                                    quotable_end(part.file->name, 40), part.kind));
    }
    if (more > 0) lines.push_back(fmt::format("{} more such parts left out", more));
    return lines;
}

}  // namespace its::formats
