#include "formats/gltf_data.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cstring>
#include <filesystem>
#include <optional>

#include "base/quote.h"
#include "formats/text.h"
#include "its/base.h"

namespace its::formats::gltf {

namespace {

constexpr int signed_byte = 5120, unsigned_byte = 5121, signed_short = 5122, unsigned_short = 5123,
              unsigned_int = 5125, real = 5126;

template <class T>
T load_number(const char* at) {
    T value;
    std::memcpy(&value, at, sizeof(T));
    if constexpr (std::endian::native == std::endian::big) {
        auto bytes = std::bit_cast<std::array<char, sizeof(T)>>(value);
        std::reverse(bytes.begin(), bytes.end());
        value = std::bit_cast<T>(bytes);
    }
    return value;
}

[[noreturn]] void bad_accessor(int index, std::string_view what) {
    throw InputError(fmt::format("glTF accessor {}: {}", index, what));
}

std::optional<unsigned> hex_digit(char c) {
    if (c >= '0' && c <= '9') return unsigned(c - '0');
    if ((c | 0x20) >= 'a' && (c | 0x20) <= 'f') return unsigned((c | 0x20) - 'a' + 10);
    return {};
}

/// Six bits of a character, in the alphabet of RFC 4648 or that for URLs; 64: none.
unsigned base64_digit(char c) {
    if (c >= 'A' && c <= 'Z') return unsigned(c - 'A');
    if (c >= 'a' && c <= 'z') return unsigned(c - 'a' + 26);
    if (c >= '0' && c <= '9') return unsigned(c - '0' + 52);
    if (c == '+' || c == '-') return 62;
    return c == '/' || c == '_' ? 63 : 64;
}

std::string decode_base64(std::string_view text) {
    std::string bytes;
    bytes.reserve(text.size() / 4 * 3 + 3);
    unsigned bits = 0, count = 0;
    while (text.ends_with('=')) text.remove_suffix(1);
    for (const char c : text) {
        if (Text::is_space(c)) continue;
        const unsigned digit = base64_digit(c);
        if (digit == 64) throw InputError("a data URI of the glTF file is no base64");
        bits = bits << 6 | digit;
        count += 6;
        if (count < 8) continue;
        count -= 8;
        bytes += char(bits >> count & 0xff);
    }
    return bytes;
}

bool is_data_uri(std::string_view uri) {
    return same_word(uri.substr(0, 5), "data:");
}

}  // namespace

std::string decode_percent(std::string_view text) {
    std::string bytes;
    bytes.reserve(text.size());
    for (std::size_t i = 0; i < text.size(); ++i) {
        const auto high = text[i] == '%' && i + 2 < text.size() ? hex_digit(text[i + 1]) : std::nullopt;
        const auto low = high ? hex_digit(text[i + 2]) : std::nullopt;
        bytes += low ? char(*high << 4 | *low) : text[i];
        i += low ? 2 : 0;
    }
    return bytes;
}

std::string decode_data_uri(std::string_view uri) {
    const std::size_t comma = uri.find(',');
    if (comma == std::string_view::npos) throw InputError("a data URI of the glTF file has no data");
    const std::string_view head = uri.substr(0, comma), body = uri.substr(comma + 1);
    const std::size_t last = head.rfind(';');
    const bool base64 = last != std::string_view::npos && same_word(head.substr(last + 1), "base64");
    if (!base64) return decode_percent(body);
    return body.find('%') == std::string_view::npos ? decode_base64(body) : decode_base64(decode_percent(body));
}

std::size_t component_size(int component) {
    switch (component) {
        case signed_byte:
        case unsigned_byte:
            return 1;
        case signed_short:
        case unsigned_short:
            return 2;
        case unsigned_int:
        case real:
            return 4;
        default:
            return 0;
    }
}

double View::value(std::size_t i, std::size_t k) const {
    const char* const at = data + i * stride + k * component_size(component);
    const auto scaled = [&](double v, double largest) { return normalized ? std::max(v / largest, -1.0) : v; };
    switch (component) {
        case signed_byte:
            return scaled(load_number<std::int8_t>(at), 127);
        case unsigned_byte:
            return scaled(load_number<std::uint8_t>(at), 255);
        case signed_short:
            return scaled(load_number<std::int16_t>(at), 32767);
        case unsigned_short:
            return scaled(load_number<std::uint16_t>(at), 65535);
        case unsigned_int:
            return load_number<std::uint32_t>(at);
        default:
            return double{load_number<float>(at)};
    }
}

const Accessor& Data::accessor(int index) const {
    if (index < 0 || std::size_t(index) >= model_.accessors.size()) bad_accessor(index, "there is none");
    return model_.accessors[std::size_t(index)];
}

bool Data::has_view(int index) const {
    return index >= 0 && std::size_t(index) < model_.accessors.size() &&
           model_.accessors[std::size_t(index)].place.view != none;
}

/// Files at or below the model's own folder, 4 GiB in all.
std::string_view Data::load(const std::string& uri, Loaded& loaded) {
    const std::string name = decode_percent(uri);
    const std::filesystem::path relative(name);
    bool plain = !name.empty() && name.find('\0') == std::string::npos && relative.is_relative();
    for (const auto& folder : relative) plain = plain && folder != "..";
    if (!load_ || !plain)
        throw InputError(fmt::format("file '{}' is not at or below the folder of the model", quotable(name)));
    try {
        loaded.file = load_(name);
    } catch (const FileError& error) {
        throw InputError(fmt::format("the file that it refers to: {}", quotable_end(error.what(), 120)));
    }
    return text_of(loaded.file);
}

std::string_view Data::buffer(int index) {
    if (index < 0 || std::size_t(index) >= buffers_.size())
        throw InputError(fmt::format("the glTF file has no buffer {}", index));
    const Buffer& wanted = model_.buffers[std::size_t(index)];
    Loaded& loaded = buffers_[std::size_t(index)];
    if (loaded.done) return loaded.bytes;
    if (!wanted.uri) {
        if (index != 0 || binary_.data() == nullptr || wanted.fallback)
            throw InputError(fmt::format("glTF buffer {} has no data", index));
        loaded.bytes = binary_;
    } else if (is_data_uri(*wanted.uri)) {
        loaded.owned = decode_data_uri(*wanted.uri);
        loaded.bytes = loaded.owned;
    } else {
        loaded.bytes = load(*wanted.uri, loaded);
    }
    loaded.bytes = loaded.bytes.substr(0, wanted.length);  // what follows is padding
    loaded_ += loaded.bytes.size();
    if (loaded_ > 0xffffffff) throw InputError("its buffers have more than 4 GiB");
    loaded.done = true;
    return loaded.bytes;
}

std::string_view Data::part(int buffer_index, std::size_t offset, std::size_t length) {
    const std::string_view bytes = buffer(buffer_index);
    if (offset > bytes.size() || length > bytes.size() - offset)
        throw InputError(fmt::format("data of the glTF file lie outside of its buffer {}", buffer_index));
    return bytes.substr(offset, length);
}

std::string_view Data::view(int index) {
    if (index < 0 || std::size_t(index) >= model_.views.size())
        throw InputError(fmt::format("the glTF file has no buffer view {}", index));
    const BufferView& wanted = model_.views[std::size_t(index)];
    if (!wanted.meshopt) return part(wanted.buffer, wanted.offset, wanted.length);
    const Meshopt& packed = *wanted.meshopt;
    if (const auto known = unpacked_.find(index); known != unpacked_.end()) return known->second;
    try {
        const std::string_view bytes = part(packed.buffer, packed.offset, packed.length);
        if (packed.stride > 256 || packed.count > 0xffffffff)
            throw InputError(
                fmt::format("{} of {} times {} bytes", packed.extension, packed.count, packed.stride));
        mesh_.charge_instance(packed.count * packed.stride / 8);
        return unpacked_.emplace(index, decode_meshopt(packed, bytes)).first->second;
    } catch (const InputError&) {
        // A file may have the data a second time, for programs that cannot unpack them.
        const bool real_fallback = wanted.buffer >= 0 && std::size_t(wanted.buffer) < model_.buffers.size() &&
                                   wanted.buffer != packed.buffer &&
                                   !model_.buffers[std::size_t(wanted.buffer)].fallback &&
                                   model_.buffers[std::size_t(wanted.buffer)].uri;
        if (model_.needs(packed.extension) || !real_fallback) throw;
        return part(wanted.buffer, wanted.offset, wanted.length);
    }
}

/// `count` elements of `components` numbers each.
/// \throws InputError unless they lie within their view.
View Data::elements(int index, const Place& place, std::size_t components, std::size_t count) {
    if (place.view < 0 || std::size_t(place.view) >= model_.views.size()) bad_accessor(index, "it has no data");
    const BufferView& wanted = model_.views[std::size_t(place.view)];
    const std::size_t known = component_size(place.component);
    if (known == 0) bad_accessor(index, "unknown kind of number");
    std::string_view bytes;
    try {
        bytes = view(place.view);
    } catch (const InputError& error) {
        bad_accessor(index, error.what());
    }
    const std::size_t size = known * components;
    const std::size_t own_stride = wanted.meshopt ? wanted.meshopt->stride : wanted.stride;
    const std::size_t stride = own_stride != 0 ? own_stride : size;
    const std::size_t room = bytes.size() - std::min(bytes.size(), place.offset);
    if (place.offset > bytes.size() || (count > 0 && (room < size || count - 1 > (room - size) / stride)))
        bad_accessor(index, "it lies outside of its buffer");
    return {bytes.data() + place.offset, count, stride, place.component};
}

std::vector<double> Data::numbers(int index, Type type) {
    const Accessor& wanted = accessor(index);
    if (wanted.type != type) bad_accessor(index, "it has the wrong type");
    const auto components = std::size_t(type);
    if (wanted.place.view == none && !wanted.sparse) bad_accessor(index, "it has no data");
    mesh_.charge_instance(wanted.count);
    std::vector<double> numbers;
    if (wanted.place.view != none) {
        View from = elements(index, wanted.place, components, wanted.count);
        from.normalized = wanted.normalized;
        numbers.reserve(wanted.count * components);
        for (std::size_t i = 0; i < wanted.count; ++i)
            for (std::size_t k = 0; k < components; ++k) numbers.push_back(from.value(i, k));
    } else {
        numbers.resize(wanted.count * components);  // zeros, says the specification
    }
    if (!wanted.sparse) return numbers;
    const Sparse& changes = *wanted.sparse;
    const View places = elements(index, changes.indices, 1, changes.count);
    View values = elements(index, changes.values, components, changes.count);
    values.normalized = wanted.normalized;
    for (std::size_t i = 0; i < changes.count; ++i) {
        const double place = places.value(i, 0);
        if (!(place >= 0 && place < double(wanted.count))) bad_accessor(index, "a sparse index out of range");
        for (std::size_t k = 0; k < components; ++k)
            numbers[std::size_t(place) * components + k] = values.value(i, k);
    }
    return numbers;
}

}  // namespace its::formats::gltf
