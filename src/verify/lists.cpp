#include "verify/lists.h"

#include <fmt/format.h>

#include <bit>

namespace its::verifier {
namespace {

/// Reads numbers in base 128, low digits first, each byte but a number's last with its highest bit set.
class Digits {
public:
    Digits(const Array<std::uint8_t>& bytes, std::uint64_t at, std::uint64_t end)
        : bytes_(bytes), at_(at), end_(end) {}

    /// False if the bytes end first, or the number has over 63 bits.
    bool read(std::uint64_t& number) {
        number = 0;
        for (unsigned shift = 0; shift < 63 && at_ < end_; shift += 7) {
            const std::uint64_t byte = bytes_[at_++];
            number += (byte % 128) << shift;
            if (byte < 128) return true;
        }
        return false;
    }

    std::uint64_t at() const { return at_; }

private:
    const Array<std::uint8_t>& bytes_;
    std::uint64_t at_, end_;
};

/// One cell's list: its length in bytes, the first triangle, then the gaps between neighbours, less one.
bool decode_list(Digits& digits, std::uint64_t end, std::uint64_t triangles, Lists& out) {
    std::uint64_t length = 0;
    if (!digits.read(length) || length > end - digits.at()) return false;
    const std::uint64_t stop = digits.at() + length;
    for (std::uint64_t next = 0; digits.at() < stop;) {
        std::uint64_t gap = 0;
        if (!digits.read(gap) || digits.at() > stop || next >= triangles || gap >= triangles - next)
            return false;
        out.triangle.push_back(std::uint32_t(next + gap));
        next += gap + 1;
    }
    out.begin.push_back(out.triangle.size());
    return true;
}

}  // namespace

std::optional<std::string> decode_lists(const View& view, Lists& out) {
    const shell::ShellData& data = view.data();
    const Array<std::uint64_t>& offset = data.surface.lists.offset;
    const Array<std::uint8_t>& bytes = data.surface.lists.bytes;
    std::uint64_t groups = 0;
    for (int k = 0; k < view.surface_levels(); ++k) groups += data.octree.levels[std::size_t(k)].parent.size();
    if (offset.size() != groups + 1 || offset[0] != 0 || offset.back() != bytes.size())
        return "triangle lists: offsets do not span the bytes";
    std::uint64_t number = 0;
    for (int k = 0; k < view.surface_levels(); ++k)
        for (std::uint64_t g = 0; g < data.octree.levels[std::size_t(k)].parent.size(); ++g, ++number) {
            const std::string damaged =
                fmt::format("triangle lists: those of group {} of level {} are damaged", g, k);
            if (offset[number] > offset[number + 1] || offset[number + 1] > bytes.size()) return damaged;
            Digits digits(bytes, offset[number], offset[number + 1]);
            for (int left = std::popcount(view.surface_bits(k, g)); left > 0; --left)
                if (!decode_list(digits, offset[number + 1], data.mesh.triangles.size(), out)) return damaged;
            if (digits.at() != offset[number + 1]) return damaged;
        }
    return {};
}

}  // namespace its::verifier
