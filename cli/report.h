#pragma once

#include <cstdint>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "its/mesh.h"
#include "its/shell.h"

/// How results are printed: tables for people, JSON for programs, one line for each message.
namespace its::cli {

using Json = nlohmann::ordered_json;

/// The text without control characters, and in less than 300 bytes: of long words, which are paths, the end.
std::string message_line(std::string_view text);
/// "its: KIND: TEXT" on standard error, in one line whatever the text.
void print_message(std::string_view kind, std::string_view text);

/// One JSON object on standard output.
void print_json(const Json& json);

/// Rows of a label and a value, printed with the values aligned.
class Table {
public:
    void row(std::string label, std::string value);
    void print() const;

private:
    std::vector<std::pair<std::string, std::string>> rows_;
};

std::string count_text(std::uint64_t count);  ///< 1234567 as 1,234,567
std::string bytes_text(std::uint64_t bytes);  ///< 1234567 as 1.23 MB
std::string seconds_text(double seconds);     ///< three digits and the unit: 12.3 ms, 1.23 s
std::string length_text(double length);       ///< six significant digits
std::string lower_bound_text(double length);  ///< the same, and no more than the length
std::string upper_bound_text(double length);  ///< the same, and no less
std::string yes_or_no(bool value);

/// The mesh and the shell, as `its build --json` and `its info --json` have them.
Json shell_json(const ThinShell& shell, const Run& run);
/// "the shell is 0.01 thick, not 0.005: 12 cells are too coarse, …", of a shell that is.
std::string coarse_text(const ShellInfo& info);

void add_shell_rows(Table& table, const ThinShell& shell, const Run& run);

/// Of UpAxis; null where it is not known.
Json up_json(UpAxis up);
/// The axis to show upwards, 0 to 2: the one that was asked for, else the file's, else z.
int upward_axis(const std::optional<int>& chosen, UpAxis of_file);

Json box_json(const Box& box);

}  // namespace its::cli
