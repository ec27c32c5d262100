#include "formats/archive.h"

#include <fmt/format.h>
#include <zlib.h>

#include <algorithm>
#include <cstdint>
#include <limits>

#include "its/base.h"

// The format is that of PKWARE's APPNOTE.TXT; section numbers are its.
namespace its::formats {

namespace {

[[noreturn]] void damaged(std::string_view what) {
    throw InputError(fmt::format("damaged archive: {}", what));
}

/// An unsigned little-endian number of `size` bytes at `at`.
/// \throws InputError beyond the end.
std::uint64_t number(std::string_view bytes, std::uint64_t at, std::uint64_t size) {
    if (at > bytes.size() || size > bytes.size() - at) damaged("it has been cut");
    std::uint64_t value = 0;
    while (size-- > 0) value = value << 8 | static_cast<unsigned char>(bytes[at + size]);
    return value;
}

std::string_view part(std::string_view bytes, std::uint64_t at, std::uint64_t size) {
    if (at > bytes.size() || size > bytes.size() - at) damaged("it has been cut");
    return bytes.substr(at, size);
}

struct Entry {
    std::string_view name;
    std::uint64_t flags = 0, method = 0, crc = 0, packed = 0, unpacked = 0, offset = 0;
};

/// One record of the table of contents (4.3.12), its large numbers from the ZIP64 field if need be (4.5.3).
Entry read_entry(std::string_view zip, std::uint64_t& at) {
    if (part(zip, at, 4) != "PK\x01\x02") damaged("its table of contents is broken");
    Entry entry;
    entry.flags = number(zip, at + 8, 2);
    entry.method = number(zip, at + 10, 2);
    entry.crc = number(zip, at + 16, 4);
    entry.packed = number(zip, at + 20, 4);
    entry.unpacked = number(zip, at + 24, 4);
    entry.offset = number(zip, at + 42, 4);
    const std::uint64_t name = number(zip, at + 28, 2), extra = number(zip, at + 30, 2),
                        comment = number(zip, at + 32, 2);
    entry.name = part(zip, at + 46, name);
    const std::string_view fields = part(zip, at + 46 + name, extra);
    for (std::uint64_t i = 0; i + 4 <= fields.size(); i += 4 + number(fields, i + 2, 2)) {
        if (number(fields, i, 2) != 1) continue;
        std::uint64_t value = i + 4;
        for (std::uint64_t* large : {&entry.unpacked, &entry.packed, &entry.offset}) {
            if (*large != 0xffffffff) continue;
            *large = number(fields, value, 8);
            value += 8;
        }
    }
    at += 46 + name + extra + comment;
    return entry;
}

std::vector<Entry> read_contents(std::string_view zip) {
    const std::size_t end = zip.rfind("PK\x05\x06");
    if (end == std::string_view::npos) damaged("it has no table of contents, as if it had been cut");
    std::uint64_t count = number(zip, end + 10, 2), at = number(zip, end + 16, 4);
    if ((count == 0xffff || at == 0xffffffff) && end >= 20 && zip.substr(end - 20, 4) == "PK\x06\x07") {
        const std::uint64_t large = number(zip, end - 20 + 8, 8);  // 4.3.14, 4.3.15
        if (part(zip, large, 4) != "PK\x06\x06") damaged("its ZIP64 record is broken");
        count = number(zip, large + 32, 8);
        at = number(zip, large + 48, 8);
    }
    std::vector<Entry> entries;
    while (count-- > 0) entries.push_back(read_entry(zip, at));  // ends with the bytes, whatever the count
    return entries;
}

std::string unpack_entry(std::string_view zip, const Entry& entry) {
    if ((entry.flags & 1) != 0) damaged("encrypted files are not read");
    if (part(zip, entry.offset, 4) != "PK\x03\x04") damaged("a file is not where it should be");
    const std::uint64_t begin = 30 + number(zip, entry.offset + 26, 2) + number(zip, entry.offset + 28, 2);
    part(zip, entry.offset, begin);
    const std::string_view packed = part(zip, entry.offset + begin, entry.packed);
    if (entry.method == 0) {
        if (entry.packed != entry.unpacked) damaged("a file has two lengths");
        return std::string(packed);
    }
    if (entry.method != 8) damaged("only stored and deflated files are read");
    constexpr std::uint64_t largest = std::numeric_limits<uInt>::max();
    if (entry.packed > largest || entry.unpacked > largest) damaged("files beyond 4 GiB are not read");
    std::string bytes(entry.unpacked, '\0');
    z_stream stream{};
    if (inflateInit2(&stream, -MAX_WBITS) != Z_OK) throw std::bad_alloc();
    stream.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(packed.data()));
    stream.avail_in = uInt(packed.size());
    stream.next_out = reinterpret_cast<Bytef*>(bytes.data());
    stream.avail_out = uInt(bytes.size());
    const int result = inflate(&stream, Z_FINISH);
    const bool complete = result == Z_STREAM_END && stream.avail_out == 0;
    inflateEnd(&stream);
    if (!complete) damaged("a file cannot be unpacked");
    return bytes;
}

std::uint32_t checksum(std::string_view bytes) {
    return std::uint32_t(crc32_z(0, reinterpret_cast<const Bytef*>(bytes.data()), bytes.size()));
}

}  // namespace

std::vector<ArchiveFile> unpack(std::string_view zip, std::uint64_t allowed) {
    const std::vector<Entry> entries = read_contents(zip);
    std::uint64_t left = allowed;
    for (const Entry& entry : entries) {  // before anything is unpacked
        if (entry.unpacked > left) {
            throw InputError(
                fmt::format("the archive unpacks to more than {} bytes, out of all proportion", allowed));
        }
        left -= entry.unpacked;
    }
    std::vector<ArchiveFile> files;
    for (const Entry& entry : entries) {
        files.push_back({std::string(entry.name), unpack_entry(zip, entry)});
        if (checksum(files.back().bytes) != entry.crc)
            damaged(fmt::format("wrong checksum of file {}", files.size()));
    }
    return files;
}

}  // namespace its::formats
