#include <fmt/format.h>

#include <algorithm>

#include "formats/gltf_data.h"
#include "its/base.h"

#ifdef ITS_DRACO
#include <draco/compression/decode.h>
#endif

// KHR_draco_mesh_compression.
namespace its::formats::gltf {

namespace {

[[noreturn]] void bad(std::string_view what) {
    throw InputError(fmt::format("KHR_draco_mesh_compression: {}", what));
}

}  // namespace

#ifdef ITS_DRACO

namespace {

/// Walks through the head of a Draco file, to learn how many triangles and vertices it claims before the
/// library takes memory for them. https://google.github.io/draco/spec/
class Head {
public:
    explicit Head(std::string_view bytes) : bytes_(bytes) {}

    std::uint64_t items() {
        if (!bytes_.starts_with("DRACO")) bad("its data are not Draco's");
        at_ = 5;
        const unsigned major = byte(), minor = byte(), kind = byte(), method = byte();
        if (kind != 1) bad("it has points, not triangles");
        if (major != 2 || minor != 2)
            bad(fmt::format("its data are of version {}.{}; only 2.2 is read", major, minor));
        const unsigned flags = byte() | byte() << 8;
        if ((flags & 0x8000) != 0) skip_metadata();
        if (method != 0) byte();                                                     // the kind of traversal
        const std::uint64_t first = varint(), second = varint(), most = 0xffffffff;  // triangles and vertices
        return std::min(first, most) + std::min(second, most);
    }

private:
    unsigned byte() {
        if (at_ >= bytes_.size()) bad("its data have been cut");
        return static_cast<unsigned char>(bytes_[at_++]);
    }
    std::uint64_t varint() {
        std::uint64_t value = 0;
        for (unsigned shift = 0; shift < 63; shift += 7) {
            const unsigned next = byte();
            value |= std::uint64_t{next & 0x7f} << shift;
            if (next < 0x80) return value;
        }
        bad("its data are damaged");
    }
    void skip(std::uint64_t count) {
        if (count > bytes_.size() - at_) bad("its data have been cut");
        at_ += count;
    }
    void skip_metadata() {
        for (std::uint64_t left = varint(); left > 0; --left) {
            varint();  // of this attribute
            skip_element(0);
        }
        skip_element(0);
    }
    void skip_element(int depth) {
        if (depth > 16) bad("its metadata are nested more than 16 levels deep");
        for (std::uint64_t left = varint(); left > 0; --left) {
            skip(byte());
            skip(varint());
        }
        for (std::uint64_t left = varint(); left > 0; --left) {
            skip(byte());
            skip_element(depth + 1);
        }
    }

    std::string_view bytes_;
    std::size_t at_ = 0;
};

std::vector<double> numbers_of(const draco::Mesh& mesh, const draco::PointAttribute& attribute,
                               const Wanted& wanted) {
    const auto components = std::size_t(wanted.type);
    if (std::size_t(attribute.num_components()) < components) bad("an attribute has too few components");
    const double unit =
        attribute.normalized() ? 1 : wanted.unit;  // the library scales what it calls normalized
    std::vector<double> numbers;
    numbers.reserve(std::size_t{mesh.num_points()} * components);
    std::array<double, 4> value{};
    for (draco::PointIndex i(0); i < mesh.num_points(); ++i) {
        if (!attribute.ConvertValue<double>(attribute.mapped_index(i), std::int8_t(components), value.data()))
            bad("an attribute cannot be unpacked");
        for (std::size_t k = 0; k < components; ++k) numbers.push_back(value[k] / unit);
    }
    return numbers;
}

}  // namespace

bool can_decode_draco() {
    return true;
}

Unpacked decode_draco(const Draco& packed, std::string_view bytes, const std::array<Wanted, attributes>& wanted,
                      const std::function<void(std::uint64_t)>& budget) {
    budget(Head(bytes).items());
    draco::DecoderBuffer buffer;
    buffer.Init(bytes.data(), bytes.size());
    draco::Decoder decoder;
    auto decoded = decoder.DecodeMeshFromBuffer(&buffer);
    if (!decoded.ok()) bad("its data are damaged");
    const draco::Mesh& mesh = *decoded.value();
    Unpacked out;
    out.indices.reserve(3 * std::size_t{mesh.num_faces()});
    for (draco::FaceIndex f(0); f < mesh.num_faces(); ++f)
        for (const draco::PointIndex& corner : mesh.face(f)) out.indices.push_back(corner.value());
    for (std::size_t i = 0; i < std::size_t{attributes}; ++i) {
        if (wanted[i].type == Type::other || packed.ids[i] == none) continue;
        const draco::PointAttribute* const attribute =
            mesh.GetAttributeByUniqueId(std::uint32_t(packed.ids[i]));
        if (attribute == nullptr) bad(fmt::format("it has no {}", attribute_names[i]));
        out.numbers[i] = numbers_of(mesh, *attribute, wanted[i]);
    }
    return out;
}

#else

bool can_decode_draco() {
    return false;
}

Unpacked decode_draco(const Draco&, std::string_view, const std::array<Wanted, attributes>&,
                      const std::function<void(std::uint64_t)>&) {
    bad("its was built without Draco, which unpacks that; write the file without");
}

#endif

}  // namespace its::formats::gltf
