#pragma once

#include <algorithm>
#include <iterator>
#include <optional>
#include <string_view>

/// Tables of the names of an enum's values: behind each name() and parse_…() of the public headers.
namespace its {

template <class Value>
struct Named {
    Value value;
    std::string_view name;
};

/// "unknown" for a number that is no value of the enum.
template <class Value, std::size_t count>
constexpr std::string_view name_in(const Named<Value> (&names)[count], Value value) {
    const auto found = std::ranges::find(names, value, &Named<Value>::value);
    return found == std::end(names) ? "unknown" : found->name;
}

template <class Value, std::size_t count>
constexpr std::optional<Value> value_in(const Named<Value> (&names)[count], std::string_view name) {
    const auto found = std::ranges::find(names, name, &Named<Value>::name);
    return found == std::end(names) ? std::nullopt : std::optional(found->value);
}

}  // namespace its
