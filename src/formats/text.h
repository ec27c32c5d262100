#pragma once

#include <algorithm>
#include <charconv>
#include <cstdint>
#include <limits>
#include <optional>
#include <string>
#include <string_view>
#include <system_error>

namespace its::formats {

/// Walks through a text; never beyond its end. A line ends at CR or LF, so CR LF is an empty line more.
class Text {
public:
    explicit Text(std::string_view text) : begin_(text.data()), at_(begin_), end_(begin_ + text.size()) {
        if (text.starts_with("\xef\xbb\xbf")) at_ += 3;  // byte order mark
    }

    bool at_end() const { return at_ == end_; }
    bool at_line_end() const { return at_ == end_ || *at_ == '\n' || *at_ == '\r'; }
    char peek() const { return at_ == end_ ? '\0' : *at_; }
    std::size_t bytes_left() const { return std::size_t(end_ - at_); }
    std::string_view rest() const { return {at_, bytes_left()}; }
    void advance() { ++at_; }

    /// Skips blanks within the line.
    void skip_blanks() {
        while (at_ != end_ && (*at_ == ' ' || *at_ == '\t' || *at_ == '\v' || *at_ == '\f')) ++at_;
    }
    /// Skips blanks and line ends.
    void skip_space() {
        while (at_ != end_ && is_space(*at_)) ++at_;
    }
    /// Skips blanks, line ends and comments (# to the end of the line).
    void skip_space_and_comments() {
        for (skip_space(); at_ != end_ && *at_ == '#'; skip_space()) skip_line();
    }
    /// Goes to the beginning of the next line.
    void skip_line() { line(); }
    /// The characters up to the next blank or line end.
    std::string_view word() {
        const char* const first = at_;
        while (at_ != end_ && !is_space(*at_)) ++at_;
        return {first, std::size_t(at_ - first)};
    }
    /// The line from here, without its end, which is skipped.
    std::string_view line() {
        const char* const first = at_;
        while (!at_line_end()) ++at_;
        const std::string_view found(first, std::size_t(at_ - first));
        if (at_ != end_) at_ += *at_ == '\r' && end_ - at_ > 1 && at_[1] == '\n' ? 2 : 1;
        return found;
    }

    /// A number that ends at a blank, a line end or a comment, in any of C's decimal forms, nan and inf
    /// included; too large ones are infinite, too small ones 0. Nothing is read where there is none.
    std::optional<double> number() {
        const char* const first = at_ != end_ && *at_ == '+' ? at_ + 1 : at_;
        double value = 0;
        auto [stop, error] = std::from_chars(first, end_, value);
        if (error == std::errc::invalid_argument || (stop != end_ && !is_space(*stop) && *stop != '#'))
            return {};
        if (stop != end_ && *stop == '#' && stop[-1] == '.') {  // 1.#QNAN, 1.#INF, … of old C libraries
            word();
            return std::numeric_limits<double>::quiet_NaN();
        }
        if (error == std::errc::result_out_of_range) value = out_of_range({first, std::size_t(stop - first)});
        at_ = stop;
        return value;
    }
    /// A whole number, and nothing about what follows it.
    std::optional<std::int64_t> integer() {
        const char* const first = at_ != end_ && *at_ == '+' ? at_ + 1 : at_;
        std::int64_t value = 0;
        const auto [stop, error] = std::from_chars(first, end_, value);
        if (error != std::errc{}) return {};
        at_ = stop;
        return value;
    }

    /// The number of the current line, from 1; for messages only: counts.
    std::uint64_t line_number() const { return std::uint64_t(std::count(begin_, at_, '\n')) + 1; }

    static bool is_space(char c) { return c == ' ' || (c >= '\t' && c <= '\r'); }

private:
    /// 0 or infinity for a number beyond the range of double: its first digit's place decides.
    static double out_of_range(std::string_view digits) {
        const double sign = digits.starts_with('-') ? -1.0 : 1.0;
        std::int64_t place = 0;  // of the first non-zero digit: 0 for units, −1 for tenths, …
        bool point = false, seen = false;
        std::size_t i = sign < 0 ? 1 : 0;
        for (; i < digits.size() && (digits[i] | 0x20) != 'e'; ++i) {
            if (digits[i] == '.') {
                point = true;
            } else if (seen) {
                place += point ? 0 : 1;
            } else {
                seen = digits[i] != '0';
                place -= point ? 1 : 0;
            }
        }
        bool negative = false;
        std::int64_t exponent = 0;
        if (i < digits.size()) {
            ++i;
            if (i < digits.size() && (digits[i] == '-' || digits[i] == '+')) negative = digits[i++] == '-';
            for (; i < digits.size(); ++i)
                exponent = std::min<std::int64_t>(exponent * 10 + (digits[i] - '0'), 1ll << 50);
        }
        const bool large = place + (negative ? -exponent : exponent) > 0;
        return large ? sign * std::numeric_limits<double>::infinity() : 0.0;
    }

    const char* begin_;
    const char* at_;
    const char* end_;
};

/// Whether two words are the same but for the case of ASCII letters; `lower` is in lower case.
inline bool same_word(std::string_view word, std::string_view lower) {
    return std::equal(word.begin(), word.end(), lower.begin(), lower.end(),
                      [](char a, char b) { return (a >= 'A' && a <= 'Z' ? char(a - 'A' + 'a') : a) == b; });
}

}  // namespace its::formats
