#include "formats/xml.h"

#include "its/base.h"

namespace its::formats {

namespace {

constexpr std::string_view blanks = " \t\r\n";

std::string_view without_prefix(std::string_view name) {
    return name.substr(name.find(':') + 1);  // npos + 1 = 0
}

/// The place of the '>' that is not in quotes.
std::size_t end_of_tag(std::string_view tag) {
    for (std::size_t at = 0;;) {
        at = tag.find_first_of(">\"'", at);
        if (at == std::string_view::npos || tag[at] == '>') return at;
        at = tag.find(tag[at], at + 1);
        if (at == std::string_view::npos) return at;
        ++at;
    }
}

}  // namespace

bool next_attribute(std::string_view& rest, std::string_view& name, std::string_view& value) {
    const std::size_t begin = rest.find_first_not_of(blanks);
    if (begin == std::string_view::npos) return false;
    rest.remove_prefix(begin);
    const std::size_t equals = rest.find('=');
    if (equals == std::string_view::npos) return false;
    name = rest.substr(0, equals);
    name = without_prefix(name.substr(0, name.find_first_of(blanks)));
    const std::size_t open = rest.find_first_of("\"'", equals);
    if (open == std::string_view::npos) return false;
    const std::size_t close = rest.find(rest[open], open + 1);
    if (close == std::string_view::npos) return false;
    value = rest.substr(open + 1, close - open - 1);
    rest.remove_prefix(close + 1);
    return true;
}

std::optional<std::string_view> XmlTag::attribute(std::string_view wanted) const {
    std::string_view rest = attributes, found, value;
    while (next_attribute(rest, found, value)) {
        if (found == wanted) return value;
    }
    return {};
}

bool XmlTags::next(XmlTag& tag) {
    for (;;) {
        at_ = xml_.find('<', at_);
        if (at_ == std::string_view::npos) return false;
        const std::string_view rest = xml_.substr(at_);
        std::string_view end = ">";
        if (rest.starts_with("<!--")) end = "-->";
        if (rest.starts_with("<![CDATA[")) end = "]]>";
        if (rest.starts_with("<?")) end = "?>";
        if (rest.starts_with("<!DOCTYPE")) throw InputError("its XML has a document type, which is not read");
        const std::size_t length = end == ">" ? end_of_tag(rest) : rest.find(end);
        if (length == std::string_view::npos) throw InputError("its XML has been cut");
        at_ += length + end.size();
        if (end != ">") continue;
        std::string_view inner = rest.substr(1, length - 1);
        tag.opens = !inner.starts_with('/');
        tag.closes = !tag.opens || inner.ends_with('/');
        if (!tag.opens) inner.remove_prefix(1);
        if (inner.ends_with('/')) inner.remove_suffix(1);
        const std::size_t name_end = inner.find_first_of(blanks);
        tag.name = without_prefix(inner.substr(0, name_end));
        tag.attributes = name_end == std::string_view::npos ? std::string_view() : inner.substr(name_end);
        return true;
    }
}

}  // namespace its::formats
