#include "base/quote.h"

#include "its/export.h"

namespace its {

namespace {

std::string printable(std::string_view text) {
    std::string line(text);
    for (char& c : line) c = static_cast<unsigned char>(c) < 0x20 || c == 0x7f ? ' ' : c;
    return line;
}

/// Whether a character of UTF-8 goes on with this byte.
bool goes_on(char c) {
    return (static_cast<unsigned char>(c) & 0xc0) == 0x80;
}

}  // namespace

ITS_API std::string quotable(std::string_view text, std::size_t most) {
    if (text.size() <= most) return printable(text);
    std::size_t end = most - 3;
    while (end > 0 && goes_on(text[end])) --end;
    return printable(text.substr(0, end)) + "...";
}

ITS_API std::string quotable_end(std::string_view text, std::size_t most) {
    if (text.size() <= most) return printable(text);
    std::size_t begin = text.size() - (most - 3);
    while (begin < text.size() && goes_on(text[begin])) ++begin;
    return "..." + printable(text.substr(begin));
}

ITS_API std::string shown(const std::filesystem::path& path) {
    return quotable_end(path.string(), longest_name);
}

}  // namespace its
