#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <span>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>
#include <vector>

#include "base/output_file.h"

namespace its::formats {

/// Text and numbers, buffered on their way into a file or into memory.
class Sink {
public:
    virtual ~Sink() = default;
    Sink(const Sink&) = delete;
    Sink& operator=(const Sink&) = delete;

    Sink& operator<<(std::string_view text) {
        buffer_.append(text);
        if (buffer_.size() >= capacity) flush();
        return *this;
    }
    /// The shortest text that reads back as the same number.
    Sink& operator<<(double value) { return *this << number(value); }
    Sink& operator<<(float value) { return *this << number(value); }
    Sink& operator<<(std::uint64_t value) { return *this << number(value); }

    /// The bytes of a number, least significant first.
    template <class T>
    Sink& raw(T value) {
        std::array<char, sizeof(T)> bytes;
        std::memcpy(bytes.data(), &value, sizeof(T));
        if constexpr (std::endian::native == std::endian::big) std::reverse(bytes.begin(), bytes.end());
        return *this << std::string_view(bytes.data(), bytes.size());
    }

protected:
    Sink() { buffer_.reserve(capacity + 256); }
    void flush() {
        put(std::as_bytes(std::span(buffer_)));
        buffer_.clear();
    }

private:
    static constexpr std::size_t capacity = std::size_t{1} << 20;

    template <class T>
    std::string_view number(T value) {
        if constexpr (std::is_floating_point_v<T>)
            if (std::isnan(value)) return "nan";  // without the sign that it may have
        const auto [end, error] = std::to_chars(text_, text_ + sizeof text_, value);
        return {text_, std::size_t(end - text_)};
    }
    virtual void put(std::span<const std::byte> bytes) = 0;

    std::string buffer_;
    char text_[32];
};

/// A file that appears complete or not at all.
class NewFile final : public Sink {
public:
    explicit NewFile(const std::filesystem::path& path) : file_(path) {}

    /// Hands over what is buffered.
    /// \throws FileError if any byte could not be written (a full disk).
    OutputFile& complete() {
        flush();
        return file_;
    }

    /// Gives the file its name.
    /// \throws FileError
    void commit() { complete().commit(); }

private:
    void put(std::span<const std::byte> bytes) override { file_.write(bytes); }

    OutputFile file_;
};

class Memory final : public Sink {
public:
    /// All that came. May be called once.
    std::vector<std::byte> take() {
        flush();
        return std::move(bytes_);
    }

private:
    void put(std::span<const std::byte> bytes) override {
        bytes_.insert(bytes_.end(), bytes.begin(), bytes.end());
    }

    std::vector<std::byte> bytes_;
};

}  // namespace its::formats
