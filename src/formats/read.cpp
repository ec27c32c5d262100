#include <fmt/format.h>

#include <new>

#include "base/input_file.h"
#include "base/quote.h"
#include "formats/readers.h"
#include "formats/text.h"
#include "its/mesh_file.h"

namespace its {
using namespace formats;

namespace {

bool starts_like_off(std::string_view text) {
    for (const std::string_view prefix : {"ST", "C", "N", "4", "n"}) {
        if (text.starts_with(prefix)) text.remove_prefix(prefix.size());
    }
    return same_word(text.substr(0, 3), "off");
}

/// Whether the first line that is not empty or a comment is a statement of OBJ.
bool starts_like_obj(Text text) {
    text.skip_space_and_comments();
    const std::string_view word = text.word();
    for (const std::string_view known : {"v", "vn", "vt", "f", "o", "g", "s", "mtllib", "usemtl"}) {
        if (word == known) return true;
    }
    return false;
}

bool is_exact_binary_stl(std::string_view bytes) {
    if (bytes.size() < 84 + 50 || (bytes.size() - 84) % 50 != 0) return false;
    std::uint64_t count = 0;
    for (int i = 3; i >= 0; --i) count = count << 8 | static_cast<unsigned char>(bytes[80 + std::size_t(i)]);
    return count == (bytes.size() - 84) / 50;
}

}  // namespace

std::string formats::lower_extension(const std::filesystem::path& path) {
    std::string extension = path.extension().string();
    for (char& c : extension) c = c >= 'A' && c <= 'Z' ? char(c - 'A' + 'a') : c;
    return extension;
}

MeshFile formats::parse_mesh(std::string_view bytes, const std::string& extension, const LoadSibling& load,
                             const ReadOptions& options) {
    if (bytes.empty()) throw InputError("the file is empty");
    if (extension == ".stl" && is_exact_binary_stl(bytes)) return parse_stl(bytes);
    if (bytes.starts_with("glTF")) return parse_gltf(bytes, load, options);
    if (bytes.starts_with("PK\x03\x04")) return parse_3mf(bytes, options);
    if (bytes.starts_with("ply") && bytes.size() > 3 && Text::is_space(bytes[3]))
        return parse_ply(bytes, options);
    Text text(bytes);
    text.skip_space();
    if (text.peek() == '{') return parse_gltf(bytes, load, options);
    if (is_ascii_stl(bytes)) return parse_stl(bytes);
    text.skip_space_and_comments();
    if (starts_like_off(text.rest())) return parse_off(bytes, options);
    if (is_exact_binary_stl(bytes))
        return parse_stl(bytes);  // of no text: bytes 80 to 83 would be a huge count
    if (extension == ".obj" || (extension != ".stl" && starts_like_obj(Text(bytes))))
        return parse_obj(bytes, options);
    if (extension == ".off") return parse_off(bytes, options);
    if (extension == ".stl") return parse_stl(bytes);
    if (extension == ".ply" || extension == ".glb" || extension == ".gltf" || extension == ".3mf") {
        throw InputError(fmt::format("not a {} file: it does not begin like one", extension.substr(1)));
    }
    throw InputError("unknown format; .obj, .stl, .ply, .off, .glb, .gltf and .3mf can be read");
}

namespace {

/// parse_mesh(), with errors that begin with the name.
MeshFile parse_named(std::string_view bytes, const std::string& extension, const std::string& name,
                     const LoadSibling& load, const ReadOptions& options) {
    try {
        return parse_mesh(bytes, extension, load, options);
    } catch (const InputError& error) {
        throw InputError(fmt::format("cannot use {}: {}", name, quotable(error.what(), longest_line)));
    } catch (const std::bad_alloc&) {
        throw MemoryError(fmt::format("{} needs more than the memory to be read", name));
    }
}

}  // namespace

MeshFile read_mesh(const std::filesystem::path& path, const ReadOptions& options) {
    const FileBytes file = read_bytes(path);
    const LoadSibling load = [&](const std::string& relative) {
        return read_bytes(path.parent_path() / relative);
    };
    return parse_named(text_of(file), lower_extension(path), fmt::format("'{}'", shown(path)), load, options);
}

MeshFile decode_mesh(std::span<const std::byte> bytes, std::string_view extension, const ReadOptions& options) {
    const LoadSibling none = [](const std::string& relative) -> FileBytes {
        throw InputError(
            fmt::format("it needs the file '{}', which is not in memory; use .glb, which has all in one",
                        quotable_end(relative, longest_name)));
    };
    const std::string_view text{reinterpret_cast<const char*>(bytes.data()), bytes.size()};
    return parse_named(text, lower_extension(fmt::format("mesh{}", extension)), "the mesh", none, options);
}

}  // namespace its
