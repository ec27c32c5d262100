#include <fmt/format.h>

#include <algorithm>
#include <limits>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "formats/affine.h"
#include "formats/archive.h"
#include "formats/readers.h"
#include "formats/slicer_parts.h"
#include "formats/text.h"
#include "formats/xml.h"
#include "its/mesh_file.h"

// 3MF Core Specification 1.3, and the paths of the Production Extension. docs/design/mesh.md says why no
// library.
namespace its::formats {

namespace {

constexpr double nan = std::numeric_limits<double>::quiet_NaN();

/// Bytes that an archive may unpack to: XML of a mesh is seldom packed to less than a twentieth.
constexpr std::uint64_t unpacked_base = std::uint64_t{1} << 26, unpacked_per_byte = 64;
/// How deep components may be nested.
constexpr int deepest = 64;

/// Where an object is defined: the part of the package, in lower case and without slash at its beginning, and
/// its number there.
using Key = std::pair<std::string, std::int64_t>;

struct Reference {
    Key object;
    Affine map;
};

struct Object {
    std::vector<Vec3> vertices;
    std::vector<Triangle> triangles;
    std::vector<Reference> components;
};

std::string part_name(std::string_view path) {
    while (path.starts_with('/')) path.remove_prefix(1);
    std::string name(path);
    for (char& c : name) c = c >= 'A' && c <= 'Z' ? char(c - 'A' + 'a') : c;
    return name;
}

/// An identifier or an index; −1 for what is none.
std::int64_t whole_number(std::string_view text) {
    Text number(text);
    number.skip_space();
    const auto value = number.integer();
    return value && *value >= 0 ? *value : -1;
}

double real_number(std::string_view text) {
    Text number(text);
    number.skip_space();
    return number.number().value_or(nan);
}

/// Twelve numbers, row by row, for row vectors: x' = x m₀ + y m₃ + z m₆ + m₉.
/// \throws InputError
Affine transform_of(const XmlTag& tag) {
    const auto found = tag.attribute("transform");
    if (!found) return {};
    double m[12];
    Text text(*found);
    for (double& entry : m) {
        text.skip_space();
        const auto value = text.number();
        if (!value || !finite({*value, 0, 0}))
            throw InputError("a transform in the 3MF file is not twelve numbers");
        entry = *value;
    }
    return {{m[0], m[1], m[2]}, {m[3], m[4], m[5]}, {m[6], m[7], m[8]}, {m[9], m[10], m[11]}};
}

/// The objects of all parts of the package, and what is to be built of them.
class Package {
public:
    /// Reads one part; `root`: whose items are built.
    /// \throws InputError
    void read_part(const std::string& part, std::string_view xml, bool root) {
        part_ = part;
        object_ = nullptr;
        in_mesh_ = false;
        XmlTags tags(xml);
        for (XmlTag tag; tags.next(tag);) {
            if (tag.name == "vertex" || tag.name == "triangle") {
                if (in_mesh_ && tag.opens) tag.name == "vertex" ? add_vertex(tag) : add_triangle(tag);
            } else if (tag.name == "object") {
                object_ = tag.opens ? &new_object(tag) : nullptr;
                if (tag.closes) object_ = nullptr;
                in_mesh_ = false;  // whatever has not been closed
            } else if (tag.name == "mesh") {
                in_mesh_ = object_ != nullptr && tag.opens && !tag.closes;
            } else if (tag.name == "component" && tag.opens && object_ != nullptr) {
                object_->components.push_back(reference(tag));
            } else if (tag.name == "item" && tag.opens && root) {
                items_.push_back(reference(tag));
            } else if (tag.name == "beamlattice") {
                beams_ = beams_ || tag.opens;
            }
        }
    }

    /// Adds all that is built to the mesh, without what `slicer` leaves out.
    /// \throws InputError
    void build(MeshBuilder& mesh, const std::string& root, SlicerParts& slicer) {
        root_ = root, slicer_ = &slicer;
        if (beams_) mesh.warn("beams of the 3MF file are not read, only triangles");
        for (const Reference& item : items_) add(item, Affine{}, 0, mesh);
        if (!items_.empty()) return;
        mesh.warn("the 3MF file builds nothing: all its meshes are read as they are");
        for (const auto& [key, object] : objects_) add_mesh(key, object, Affine{}, mesh);
    }

private:
    Object& new_object(const XmlTag& tag) {
        const std::int64_t id = whole_number(tag.attribute("id").value_or(""));
        const auto [object, added] = objects_.try_emplace({part_, id});
        if (id < 0 || !added) throw InputError("an object of the 3MF file has no number of its own");
        return object->second;
    }

    void add_vertex(const XmlTag& tag) {
        Vec3 p{nan, nan, nan};
        std::string_view rest = tag.attributes, name, value;
        while (next_attribute(rest, name, value)) {
            if (name.size() == 1 && name >= "x" && name <= "z") p[name[0] - 'x'] = real_number(value);
        }
        object_->vertices.push_back(p);
    }

    void add_triangle(const XmlTag& tag) {
        constexpr std::uint32_t none = 0xffffffff;
        Triangle corners = {none, none, none};
        std::string_view rest = tag.attributes, name, value;
        while (next_attribute(rest, name, value)) {
            if (name.size() != 2 || name < "v1" || name > "v3") continue;
            const std::int64_t index = whole_number(value);
            corners[std::size_t(name[1] - '1')] = index >= 0 && index < none ? std::uint32_t(index) : none;
        }
        object_->triangles.push_back(corners);
    }

    Reference reference(const XmlTag& tag) const {
        const auto path = tag.attribute("path");
        return {{path ? part_name(*path) : part_, whole_number(tag.attribute("objectid").value_or(""))},
                transform_of(tag)};
    }

    void add(const Reference& use, const Affine& outer, int depth, MeshBuilder& mesh) {
        if (depth > deepest) throw InputError("components of the 3MF file are nested more than 64 levels deep");
        const auto object = objects_.find(use.object);
        if (object == objects_.end())
            throw InputError(fmt::format("the 3MF file uses object {}, which is not in it", use.object.second));
        const Affine map = outer * use.map;
        add_mesh(object->first, object->second, map, mesh);
        const bool in_root = use.object.first == root_;
        for (const Reference& component : object->second.components)
            if (!in_root || !slicer_->leaves_out(use.object.second, component.object.second))
                add(component, map, depth + 1, mesh);
    }

    void add_mesh(const Key& key, const Object& object, const Affine& map, MeshBuilder& mesh) const {
        const std::size_t count = object.vertices.size();
        mesh.charge_instance(1 + count + object.triangles.size() + slicer_->count(key.second));
        const auto first = std::int64_t(mesh.vertex_count());
        for (const Vec3& p : object.vertices) mesh.add_vertex(map(p));
        const auto corner = [&](std::uint32_t v) { return v < count ? first + v : std::int64_t{-1}; };
        const bool mirrored = map.determinant() < 0;
        const auto add_range = [&](std::uint64_t begin, std::uint64_t end) {
            for (std::uint64_t i = begin; i < end; ++i) {
                const Triangle& t = object.triangles[i];
                mesh.add_triangle(corner(t[mirrored ? 1 : 0]), corner(t[mirrored ? 0 : 1]), corner(t[2]));
            }
        };
        if (key.first == root_)
            slicer_->for_solid_triangles(key.second, object.triangles.size(), add_range);
        else
            add_range(0, object.triangles.size());
    }

    std::map<Key, Object> objects_;
    std::vector<Reference> items_;
    bool beams_ = false;
    std::string root_;  ///< the part whose objects slicers speak of
    SlicerParts* slicer_ = nullptr;
    std::string part_;  // being read, as are:
    Object* object_ = nullptr;
    bool in_mesh_ = false;
};

/// The part that the package begins with, by its relationships.
std::string root_part(const std::vector<ArchiveFile>& files) {
    for (const auto& [name, content] : files) {
        if (part_name(name) != "_rels/.rels") continue;
        XmlTags tags(content);
        for (XmlTag tag; tags.next(tag);) {
            if (tag.name == "Relationship" && tag.attribute("Type").value_or("").ends_with("/3dmodel"))
                return part_name(tag.attribute("Target").value_or(""));
        }
    }
    return "3d/3dmodel.model";
}

}  // namespace

MeshFile parse_3mf(std::string_view bytes, const ReadOptions& options) {
    const auto files = unpack(bytes, unpacked_base + unpacked_per_byte * bytes.size());
    const std::string root = root_part(files);
    Package package;
    bool any = false;
    for (const auto& [name, content] : files) {
        const std::string part = part_name(name);
        if (!part.ends_with(".model") && part != root) continue;
        if (content.starts_with("\xff\xfe") || content.starts_with("\xfe\xff"))
            throw InputError("the 3MF model is in UTF-16; only UTF-8 is read");
        package.read_part(part, content, part == root);
        any = any || part == root;
    }
    if (!any) throw InputError(fmt::format("not a 3MF file: no part '{}' in the archive", root));
    MeshBuilder mesh(bytes.size());
    SlicerParts slicer(files);
    package.build(mesh, root, slicer);
    for (const std::string& line : slicer.lines()) mesh.warn(line);
    if (options.attributes) {
        for (const auto& [name, content] : files)
            if (part_name(name).ends_with(".model") && (content.find("colorgroup") != std::string::npos ||
                                                        content.find("basematerials") != std::string::npos ||
                                                        content.find("texture2d") != std::string::npos)) {
                mesh.warn_not_carried("colours, materials and textures of 3MF files");
                break;
            }
    }
    MeshFile file = mesh.finish("3mf");
    file.up = UpAxis::z;  // Core Specification, 3.1: coordinates are the printer's
    return file;
}

}  // namespace its::formats
