#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace its::formats {

/// One file of an archive, unpacked.
struct ArchiveFile {
    std::string name, bytes;
};

/// Unpacks a ZIP archive (stored and deflated files, ZIP64 sizes; no encryption), after its table of contents.
/// \throws InputError if it is damaged, or unpacks to more than `allowed` bytes in all.
std::vector<ArchiveFile> unpack(std::string_view zip, std::uint64_t allowed);

}  // namespace its::formats
