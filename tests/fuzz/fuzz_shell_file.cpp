#include <cstdint>
#include <span>
#include <vector>

#include "io/shell_file.h"

/// The reader of .its files, past its checksums: whatever decodes must be valid and encode to the same bytes.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    const auto input = std::as_bytes(std::span(data, size));
    std::vector<std::byte> file(input.begin(), input.end());
    its::mend_checksums(file);
    try {
        if (its::encode(its::decode(file)) != file) __builtin_trap();
    } catch (const its::InputError&) {
    }
    return 0;
}
