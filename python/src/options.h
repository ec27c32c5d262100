#pragma once

#include <nanobind/nanobind.h>
#include <nanobind/stl/string.h>

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include "its/base.h"

/// Options that Python gives: those that somebody has set, by name. All others keep the library's defaults.
namespace its::python {

namespace nb = nanobind;

/// The value of a Python number of that kind.
/// \throws OptionError for one out of range, or of another kind
template <class Value>
Value option_value(const nb::handle& given, const char* name) {
    Value value{};
    if (!nb::try_cast(given, value))
        throw OptionError(std::string(name) + ": " + nb::cast<std::string>(nb::repr(given)) +
                          " cannot be used");
    return value;
}

template <class Value>
void take(const nb::dict& given, const char* name, Value& option) {
    if (given.contains(name)) option = option_value<Value>(given[name], name);
}
template <class Value>
void take(const nb::dict& given, const char* name, std::optional<Value>& option) {
    if (given.contains(name)) option = option_value<Value>(given[name], name);
}

/// One of the library's names for the values of an enum.
/// \param parse  the library's parse_…()
template <class Option, class Parse>
void take_choice(const nb::dict& given, const char* name, Option& option, Parse parse) {
    if (!given.contains(name)) return;
    const auto text = option_value<std::string>(given[name], name);
    const auto value = parse(text);
    if (!value) throw OptionError(std::string(name) + " '" + text + "': there is none of this name");
    option = *value;
}

inline nb::str text(std::string_view text) {
    return nb::str(text.data(), text.size());
}
inline nb::tuple tuple_of(const Vec3& v) {
    return nb::make_tuple(v.x, v.y, v.z);
}
inline nb::tuple tuple_of(const Box& box) {
    return nb::make_tuple(tuple_of(box.min), tuple_of(box.max));
}

}  // namespace its::python
