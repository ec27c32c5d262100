#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <optional>
#include <string>
#include <string_view>

#include "formats/point_readers.h"
#include "formats/text.h"

namespace its::formats {

namespace {

/// Calls fn(line, number) for each line that is not empty or a comment; number counts from 1.
template <class F>
void for_lines(std::string_view bytes, F&& fn) {
    Text text(bytes);
    for (std::uint64_t number = 1; !text.at_end(); ++number) {
        const std::string_view line = text.line();
        Text content(line);
        content.skip_space();
        if (!content.at_end() && content.peek() != '#') fn(line, number);
    }
}

std::string_view trimmed(std::string_view field) {
    while (!field.empty() && Text::is_space(field.front())) field.remove_prefix(1);
    while (!field.empty() && Text::is_space(field.back())) field.remove_suffix(1);
    if (field.size() >= 2 && field.front() == '"' && field.back() == '"')
        field = field.substr(1, field.size() - 2);
    return field;
}

/// A whole field that is one number. Its decimal sign may be a comma, where that separates no fields.
std::optional<double> number_in(std::string_view field) {
    field = trimmed(field);
    std::string with_point;
    if (const std::size_t comma = field.find(','); comma != std::string_view::npos) {
        if (field.find_first_of(".,", comma + 1) != std::string_view::npos ||
            field.substr(0, comma).find('.') != std::string_view::npos)
            return {};  // of thousands, or more than one number
        with_point = field;
        with_point[comma] = '.';
        field = with_point;
    }
    Text text(field);
    const auto value = text.number();
    return text.at_end() ? value : std::nullopt;
}

/// fn(column, field) for each field of a line; a field in quotes may have separators.
template <class F>
void for_fields(std::string_view line, char separator, F&& fn) {
    for (std::size_t column = 0;; ++column) {
        std::size_t begin = line.find_first_not_of(" \t");
        if (begin != std::string_view::npos && line[begin] == '"')
            begin = std::min(line.find('"', begin + 1), line.size());  // no second quote: the rest is one field
        else
            begin = 0;
        const std::size_t end = line.find(separator, begin);
        fn(column, line.substr(0, end));
        if (end == std::string_view::npos) return;
        line.remove_prefix(end + 1);
    }
}

/// What separates the fields of a file, by its first line: semicolons or tabs, since commas may then be decimal
/// signs, or commas.
char separator_of(std::string_view line) {
    for (const char c : {';', '\t'}) {
        bool found = false;
        for_fields(line, c, [&](std::size_t column, std::string_view) { found |= column > 0; });
        if (found) return c;
    }
    return ',';
}

using Columns = std::array<std::size_t, 3>;

/// Where x, y and z are, by the names in a first line; the first three columns if it does not name them.
Columns named_columns(std::string_view line, char separator) {
    constexpr std::size_t none = ~std::size_t{0};
    Columns columns = {none, none, none};
    for_fields(line, separator, [&](std::size_t column, std::string_view field) {
        const std::string_view name = trimmed(field);
        for (std::size_t axis = 0; axis < 3; ++axis)
            if (same_word(name, std::string_view("xyz").substr(axis, 1)) && columns[axis] == none)
                columns[axis] = column;
    });
    return columns[0] == none || columns[1] == none || columns[2] == none ? Columns{0, 1, 2} : columns;
}

/// The point in a line of fields; nothing if a coordinate is missing or no number.
std::optional<Vec3> point_in(std::string_view line, char separator, const Columns& columns) {
    Vec3 point;
    unsigned found = 0;
    for_fields(line, separator, [&](std::size_t column, std::string_view field) {
        for (std::size_t axis = 0; axis < 3; ++axis) {
            if (columns[axis] != column) continue;
            const auto value = number_in(field);
            if (value) point[int(axis)] = *value, found |= 1u << axis;
        }
    });
    return found == 7 ? std::optional(point) : std::nullopt;
}

/// Whether a field looks like a number, even if it is none that we read ("1.234,5").
bool like_number(std::string_view field) {
    field = trimmed(field);
    if (Text(field).number()) return true;  // nan and inf, too
    const std::size_t first = field.find_first_not_of("+-.,");
    return first != std::string_view::npos && field[first] >= '0' && field[first] <= '9';
}

/// A line of names has no field that begins with a number.
bool has_names(std::string_view line, char separator) {
    bool names = true;
    for_fields(line, separator,
               [&](std::size_t, std::string_view field) { names = names && !like_number(field); });
    return names;
}

}  // namespace

std::vector<Vec3> parse_csv(std::string_view bytes) {
    std::vector<Vec3> points;
    Columns columns = {0, 1, 2};
    char separator = 0;
    for_lines(bytes, [&](std::string_view line, std::uint64_t number) {
        if (separator == 0) {
            separator = separator_of(line);
            if (has_names(line, separator)) {
                columns = named_columns(line, separator);
                return;
            }
        }
        const auto point = point_in(line, separator, columns);
        if (!point)
            throw InputError(fmt::format("line {}: numbers are expected in columns {}, {} and {}", number,
                                         columns[0] + 1, columns[1] + 1, columns[2] + 1));
        points.push_back(*point);
    });
    return points;
}

std::vector<Vec3> parse_xyz(std::string_view bytes) {
    std::vector<Vec3> points;
    for_lines(bytes, [&](std::string_view line, std::uint64_t number) {
        Text text(line);
        Vec3 point;
        for (int axis = 0; axis < 3; ++axis) {
            text.skip_space();
            const auto value = text.number();
            if (!value) throw InputError(fmt::format("line {}: three numbers are expected", number));
            point[axis] = *value;
        }
        points.push_back(point);
    });
    return points;
}

}  // namespace its::formats
