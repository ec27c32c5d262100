#pragma once

#include <cstddef>
#include <optional>
#include <string_view>

namespace its::formats {

/// One tag of an XML document: <name a="1">, <name/> or </name>. Prefixes of names are left out.
struct XmlTag {
    std::string_view name;
    std::string_view attributes;  ///< the text between the name and the end
    bool opens = true;            ///< false: an end tag
    bool closes = false;          ///< an end tag, or <name/>

    /// The value of an attribute, or nothing.
    std::optional<std::string_view> attribute(std::string_view wanted) const;
};

/// Takes the next attribute from `rest`, at first a tag's attributes: false at the end. Values are as they
/// stand: entities in them are not replaced.
bool next_attribute(std::string_view& rest, std::string_view& name, std::string_view& value);

/// Walks through the tags of an XML document; texts, comments and instructions are skipped. Nothing is kept and
/// nothing expands, so time is linear and no memory is taken.
class XmlTags {
public:
    explicit XmlTags(std::string_view xml) : xml_(xml) {}

    /// False at the end.
    /// \throws InputError if a tag has no end, or at a document type, which could define entities.
    bool next(XmlTag& tag);

private:
    std::string_view xml_;
    std::size_t at_ = 0;
};

}  // namespace its::formats
