#include <fmt/format.h>

#include "base/quote.h"
#include "formats/gltf_data.h"
#include "formats/text.h"
#include "its/base.h"

#ifdef ITS_MESHOPTIMIZER
#include <meshoptimizer.h>
#endif

// EXT_meshopt_compression, and KHR_meshopt_compression, which adds a version of the vertex codec and a filter:
// what the library at hand does not know of it is refused.
namespace its::formats::gltf {

#ifdef ITS_MESHOPTIMIZER

namespace {

[[noreturn]] void bad(const Meshopt& packed, std::string_view what) {
    throw InputError(fmt::format("{}: {}", packed.extension, what));
}

/// What the library asserts. Sizes are those that the extension allows.
void check(const Meshopt& packed) {
    const std::size_t stride = packed.stride;
    const std::string &mode = packed.mode, &filter = packed.filter;
    const bool indices = mode == "TRIANGLES" || mode == "INDICES";
    if (!indices && mode != "ATTRIBUTES")
        bad(packed, fmt::format("mode '{}' is not known", quotable(mode, 30)));
    if (indices ? stride != 2 && stride != 4 : stride == 0 || stride > 256 || stride % 4 != 0)
        bad(packed, fmt::format("a stride of {} bytes", stride));
    if (mode == "TRIANGLES" && packed.count % 3 != 0) bad(packed, "triangles of fewer than three corners");
    if (filter.empty() || filter == "NONE") return;
    if (indices) bad(packed, "a filter of indices");
    const bool fits = filter == "OCTAHEDRAL"    ? stride == 4 || stride == 8
                      : filter == "QUATERNION"  ? stride == 8
                      : filter == "EXPONENTIAL" ? true
                                                : false;
    if (!fits) bad(packed, fmt::format("filter '{}' of {} bytes is not known", quotable(filter, 30), stride));
}

}  // namespace

bool can_decode_meshopt() {
    return true;
}

std::string decode_meshopt(const Meshopt& packed, std::string_view bytes) {
    check(packed);
    const auto* const data = reinterpret_cast<const unsigned char*>(bytes.data());
    std::string out(packed.count * packed.stride, '\0');
    const int result =
        packed.mode == "ATTRIBUTES"
            ? meshopt_decodeVertexBuffer(out.data(), packed.count, packed.stride, data, bytes.size())
        : packed.mode == "TRIANGLES"
            ? meshopt_decodeIndexBuffer(out.data(), packed.count, packed.stride, data, bytes.size())
            : meshopt_decodeIndexSequence(out.data(), packed.count, packed.stride, data, bytes.size());
    if (result == -1)
        bad(packed, fmt::format("data that meshoptimizer {}.{} does not know", MESHOPTIMIZER_VERSION / 1000,
                                MESHOPTIMIZER_VERSION / 10 % 100));
    if (result != 0) bad(packed, "its data are damaged");
    if (packed.filter == "OCTAHEDRAL") meshopt_decodeFilterOct(out.data(), packed.count, packed.stride);
    if (packed.filter == "QUATERNION") meshopt_decodeFilterQuat(out.data(), packed.count, packed.stride);
    if (packed.filter == "EXPONENTIAL") meshopt_decodeFilterExp(out.data(), packed.count, packed.stride);
    return out;
}

#else

bool can_decode_meshopt() {
    return false;
}

std::string decode_meshopt(const Meshopt& packed, std::string_view) {
    throw InputError(
        fmt::format("{}: its was built without meshoptimizer, which unpacks that; write the file without",
                    packed.extension));
}

#endif

}  // namespace its::formats::gltf
