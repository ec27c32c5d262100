#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "formats/gltf_model.h"
#include "formats/readers.h"

/// The data that a glTF file refers to: buffers, the views of them, the numbers of accessors.
namespace its::formats::gltf {

/// The bytes of a data URI (RFC 2397), of any media type.
/// \throws InputError
std::string decode_data_uri(std::string_view uri);
/// A relative reference with its %XY replaced.
std::string decode_percent(std::string_view text);

/// Bytes that meshoptimizer packed.
/// \throws InputError that names the extension: where they are damaged, of a kind that the library does not
///         know, or where its was built without the library
std::string decode_meshopt(const Meshopt& packed, std::string_view bytes);
bool can_decode_meshopt();

/// A primitive that Draco packed: what `accessors` ask for, one number after the other, and three indices for
/// each triangle.
struct Unpacked {
    std::array<std::vector<double>, attributes> numbers;
    std::vector<double> indices;
};
/// How an attribute is wanted: `other`, not at all. Whole numbers stand for themselves divided by `unit`.
struct Wanted {
    Type type = Type::other;
    double unit = 1;
};
/// \param budget   called with the claimed number of triangles and vertices before memory is taken for them
/// \throws InputError that names the extension, as above
Unpacked decode_draco(const Draco& packed, std::string_view bytes, const std::array<Wanted, attributes>& wanted,
                      const std::function<void(std::uint64_t)>& budget);
bool can_decode_draco();

/// Elements whose bytes are known to be there.
struct View {
    const char* data = nullptr;
    std::size_t count = 0, stride = 0;
    int component = 0;
    bool normalized = false;

    /// Component k of element i; fixed-point ones as in the glTF specification, 3.6.2.2.
    double value(std::size_t i, std::size_t k) const;
};

/// The bytes of a kind of number, 5120 (signed byte) to 5126 (float); 0: there is no such kind.
std::size_t component_size(int component);

/// Loads buffers and unpacks views when they are first needed, and keeps them.
class Data {
public:
    /// \param binary   the file's own buffer, if it has one
    Data(const Model& model, std::string_view binary, const LoadSibling& load, MeshBuilder& mesh)
        : model_(model), binary_(binary), load_(load), mesh_(mesh), buffers_(model.buffers.size()) {}

    /// The numbers of accessor `index`, one after the other.
    /// \throws InputError unless it has this type and its bytes are there.
    std::vector<double> numbers(int index, Type type);
    /// \throws InputError if there is none
    const Accessor& accessor(int index) const;
    /// Whether an accessor has a place in a view, where its numbers may be.
    bool has_view(int index) const;
    /// The bytes of a view, unpacked if need be.
    /// \throws InputError
    std::string_view view(int index);

private:
    struct Loaded {
        bool done = false;
        std::string owned;
        FileBytes file;
        std::string_view bytes;
    };

    std::string_view buffer(int index);
    std::string_view load(const std::string& uri, Loaded& loaded);
    std::string_view part(int buffer, std::size_t offset, std::size_t length);
    View elements(int accessor, const Place& place, std::size_t components, std::size_t count);

    const Model& model_;
    std::string_view binary_;
    const LoadSibling& load_;
    MeshBuilder& mesh_;
    std::vector<Loaded> buffers_;
    std::map<int, std::string> unpacked_;  ///< views, by number
    std::uint64_t loaded_ = 0;             ///< bytes of all buffers so far
};

}  // namespace its::formats::gltf
