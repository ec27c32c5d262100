#include <fmt/format.h>

#include <Model/COM/NMR_DLLInterfaces.h>

#include <map>
#include <string>
#include <utility>
#include <vector>

#include "mesh/archive.h"
#include "mesh/readers.h"

namespace its {

namespace {

/// A handle of the 3MF library.
class Handle {
public:
    Handle() = default;
    Handle(Handle&& other) noexcept : pointer_(std::exchange(other.pointer_, nullptr)) {}
    Handle& operator=(Handle&& other) noexcept {
        std::swap(pointer_, other.pointer_);
        return *this;
    }
    ~Handle() {
        if (pointer_ != nullptr) NMR::lib3mf_release(pointer_);
    }
    NMR::PLib3MFBase* get() const { return pointer_; }
    NMR::PLib3MFBase** out() { return &pointer_; }

private:
    NMR::PLib3MFBase* pointer_ = nullptr;
};

/// \throws InputError with the library's own words, if it has any.
void check(HRESULT result, const Handle& on) {
    if (result == 0) return;
    DWORD code = 0;
    LPCSTR message = nullptr;
    if (on.get() != nullptr) NMR::lib3mf_getlasterror(on.get(), &code, &message);
    throw InputError(fmt::format("not a usable 3MF file: {}",
                                 message != nullptr && *message != '\0' ? message : "malformed"));
}

/// Bytes that an archive may unpack to: XML of a mesh is seldom packed to less than a twentieth.
constexpr std::uint64_t unpacked_base = std::uint64_t{1} << 26, unpacked_per_byte = 64;
/// How deep components may be nested, and how many of them objects may expand to.
constexpr int deepest = 64;
constexpr std::uint64_t most_components = std::uint64_t{1} << 20;

/// The objects of a 3MF package and what they are made of, found by a plain scan of its XML. The library checks
/// each object by visiting all that it is made of: without bounds, forty lines of XML make it pay 2⁴⁰ visits.
class ComponentScan {
public:
    /// Scans one part of the package. \throws InputError on what other parsers could read otherwise.
    void scan(const std::string& part, std::string_view xml) {
        for (std::size_t at = xml.find('<'); at != std::string_view::npos; at = xml.find('<', at)) {
            const std::string_view rest = xml.substr(at);
            std::string_view end = ">";
            if (rest.starts_with("<!--")) end = "-->";
            if (rest.starts_with("<![CDATA[")) end = "]]>";
            if (rest.starts_with("<!DOCTYPE")) throw InputError("a document type in a 3MF file is not read");
            std::size_t length = rest.find(end);
            if (end == ">") length = end_of_tag(rest);
            if (length == std::string_view::npos) return;  // cut: the library will say so
            if (end == ">") read_tag(part, rest.substr(1, length - 1));
            at += length + end.size();
        }
    }

    /// \throws InputError if objects expand to too much.
    void check() {
        std::uint64_t sum = 0;
        for (std::size_t i = 0; i < references_.size(); ++i) {
            const auto object = objects_.find(references_[i]);
            if (object != objects_.end()) sum += cost(object->second, 0);
            if (sum > most_components) too_much();
        }
    }

private:
    struct Object {
        std::vector<std::string> components;
        std::uint64_t cost = 0;
    };

    [[noreturn]] static void too_much() {
        throw InputError(
            "components of the 3MF file repeat parts more than a million times or are nested more than "
            "64 levels deep");
    }

    /// The place of the '>' that is not in quotes.
    static std::size_t end_of_tag(std::string_view tag) {
        char quote = '\0';
        for (std::size_t i = 0; i < tag.size(); ++i) {
            if (quote == '\0' && tag[i] == '>') return i;
            if (quote == '\0' && (tag[i] == '"' || tag[i] == '\'')) {
                quote = tag[i];
            } else if (tag[i] == quote) {
                quote = '\0';
            }
        }
        return std::string_view::npos;
    }

    static std::string_view local(std::string_view name) { return name.substr(name.find(':') + 1); }

    /// The value of the attribute whose name without prefix is `name`; empty if there is none.
    static std::string attribute(std::string_view tag, std::string_view name) {
        std::size_t at = tag.find_first_of(" \t\r\n");
        while (at != std::string_view::npos) {
            at = tag.find_first_not_of(" \t\r\n/", at);
            if (at == std::string_view::npos) break;
            const std::size_t equals = tag.find('=', at);
            if (equals == std::string_view::npos) break;
            const std::string_view found = tag.substr(at, tag.find_first_of(" \t\r\n=", at) - at);
            const std::size_t open = tag.find_first_of("\"'", equals);
            if (open == std::string_view::npos) break;
            const std::size_t close = tag.find(tag[open], open + 1);
            if (close == std::string_view::npos) break;
            const std::string_view value = tag.substr(open + 1, close - open - 1);
            if (local(found) == name) {
                if (value.find('&') != std::string_view::npos)
                    throw InputError("an entity in an identifier of the 3MF file");
                return std::string(value);
            }
            at = close + 1;
        }
        return {};
    }

    /// Identifiers are numbers: "007" is "7".
    static std::string key(std::string_view part, std::string_view id) {
        while (part.starts_with('/')) part.remove_prefix(1);
        const auto digits = id.find_first_not_of(" \t\r\n+0");
        return std::string(part) + '\n' +
               std::string(digits == std::string_view::npos ? "" : id.substr(digits));
    }

    void read_tag(const std::string& part, std::string_view tag) {
        const std::string_view element = local(tag.substr(0, tag.find_first_of(" \t\r\n/")));
        if (element == "object") {
            current_ = &objects_[key(part, attribute(tag, "id"))];
        } else if (element == "component" || element == "item") {
            const std::string path = attribute(tag, "path");
            references_.push_back(key(path.empty() ? part : path, attribute(tag, "objectid")));
            if (element == "component" && current_ != nullptr)
                current_->components.push_back(references_.back());
        }
    }

    /// Objects visited on the way through this one, itself included; 0 means not known yet.
    std::uint64_t cost(Object& object, int depth) {
        if (depth > deepest) too_much();
        if (object.cost > 0) return object.cost;
        std::uint64_t sum = 1;
        for (const std::string& component : object.components) {
            const auto found = objects_.find(component);
            sum += found == objects_.end() ? 1 : cost(found->second, depth + 1);
            if (sum > most_components) too_much();
        }
        return object.cost = sum;
    }

    std::map<std::string, Object> objects_;
    std::vector<std::string> references_;
    Object* current_ = nullptr;
};

/// The package packed anew from what has been checked, so that the library unpacks what we have seen.
std::string checked_package(std::string_view bytes) {
    const auto files = unpack(bytes, unpacked_base + unpacked_per_byte * bytes.size());
    ComponentScan scan;
    for (const auto& [name, content] : files) {
        const bool utf16 = content.starts_with("\xff\xfe") || content.starts_with("\xfe\xff");
        if (utf16 && name.ends_with(".model"))
            throw InputError("the 3MF model is in UTF-16; only UTF-8 is read");
        scan.scan(name, content);
    }
    scan.check();
    return pack(files);
}

/// x' = m[0][0] x + m[0][1] y + m[0][2] z + m[0][3], and so on.
struct Affine {
    double m[3][4] = {{1, 0, 0, 0}, {0, 1, 0, 0}, {0, 0, 1, 0}};

    Vec3 operator()(const Vec3& p) const {
        Vec3 q;
        for (int row = 0; row < 3; ++row)
            q[row] = m[row][0] * p.x + m[row][1] * p.y + m[row][2] * p.z + m[row][3];
        return q;
    }
    Affine operator*(const Affine& inner) const {
        Affine product;
        for (int row = 0; row < 3; ++row) {
            for (int column = 0; column < 4; ++column) {
                product.m[row][column] = column == 3 ? m[row][3] : 0.0;
                for (int k = 0; k < 3; ++k) product.m[row][column] += m[row][k] * inner.m[k][column];
            }
        }
        return product;
    }
    double determinant() const {
        return m[0][0] * (m[1][1] * m[2][2] - m[1][2] * m[2][1]) -
               m[0][1] * (m[1][0] * m[2][2] - m[1][2] * m[2][0]) +
               m[0][2] * (m[1][0] * m[2][1] - m[1][1] * m[2][0]);
    }
};

Affine affine(const NMR::MODELTRANSFORM& transform) {
    Affine map;
    for (int row = 0; row < 3; ++row) {
        for (int column = 0; column < 4; ++column)
            map.m[row][column] = double{transform.m_fFields[row][column]};
    }
    return map;
}

class BuildReader {
public:
    explicit BuildReader(MeshBuilder& mesh) : mesh_(mesh) {}

    void read(const Handle& model) {
        Handle items;
        check(NMR::lib3mf_model_getbuilditems(model.get(), items.out()), model);
        bool any = false;
        for (BOOL more = false;
             check(NMR::lib3mf_builditemiterator_movenext(items.get(), &more), items), more;) {
            any = true;
            read_item(items);
        }
        if (!any) read_all_meshes(model);
    }

private:
    void read_item(const Handle& items) {
        Handle item, object;
        check(NMR::lib3mf_builditemiterator_getcurrent(items.get(), item.out()), items);
        check(NMR::lib3mf_builditem_getobjectresource(item.get(), object.out()), item);
        NMR::MODELTRANSFORM transform;
        check(NMR::lib3mf_builditem_getobjecttransform(item.get(), &transform), item);
        read_object(object, affine(transform), 0);
    }

    void read_all_meshes(const Handle& model) {
        mesh_.warn("the 3MF file builds nothing: all its meshes are read as they are");
        Handle objects;
        check(NMR::lib3mf_model_getmeshobjects(model.get(), objects.out()), model);
        for (BOOL more = false;
             check(NMR::lib3mf_resourceiterator_movenext(objects.get(), &more), objects), more;) {
            Handle object;
            check(NMR::lib3mf_resourceiterator_getcurrent(objects.get(), object.out()), objects);
            read_mesh_object(object, Affine{});
        }
    }

    void read_object(const Handle& object, const Affine& map, int depth) {
        if (depth > deepest) throw InputError("components of the 3MF file are nested more than 64 levels deep");
        mesh_.charge_instance(1);
        BOOL is_mesh = false, is_components = false;
        check(NMR::lib3mf_object_ismeshobject(object.get(), &is_mesh), object);
        if (is_mesh) return read_mesh_object(object, map);
        check(NMR::lib3mf_object_iscomponentsobject(object.get(), &is_components), object);
        if (!is_components) return;
        DWORD count = 0;
        check(NMR::lib3mf_componentsobject_getcomponentcount(object.get(), &count), object);
        for (DWORD i = 0; i < count; ++i) {
            Handle component, part;
            check(NMR::lib3mf_componentsobject_getcomponent(object.get(), i, component.out()), object);
            check(NMR::lib3mf_component_getobjectresource(component.get(), part.out()), component);
            NMR::MODELTRANSFORM transform;
            check(NMR::lib3mf_component_gettransform(component.get(), &transform), component);
            read_object(part, map * affine(transform), depth + 1);
        }
    }

    void read_mesh_object(const Handle& object, const Affine& map) {
        DWORD vertices = 0, triangles = 0;
        check(NMR::lib3mf_meshobject_getvertexcount(object.get(), &vertices), object);
        check(NMR::lib3mf_meshobject_gettrianglecount(object.get(), &triangles), object);
        mesh_.charge_instance(std::uint64_t{vertices} + triangles);
        const auto first = std::int64_t(mesh_.vertex_count());
        for (DWORD i = 0; i < vertices; ++i) {
            NMR::MODELMESHVERTEX v;
            check(NMR::lib3mf_meshobject_getvertex(object.get(), i, &v), object);
            mesh_.add_vertex(
                map({double{v.m_fPosition[0]}, double{v.m_fPosition[1]}, double{v.m_fPosition[2]}}));
        }
        const bool mirrored = map.determinant() < 0;
        const auto corner = [&](DWORD v) { return v < vertices ? first + v : -1; };
        for (DWORD i = 0; i < triangles; ++i) {
            NMR::MODELMESHTRIANGLE t;
            check(NMR::lib3mf_meshobject_gettriangle(object.get(), i, &t), object);
            const std::int64_t a = corner(t.m_nIndices[0]), b = corner(t.m_nIndices[1]),
                               c = corner(t.m_nIndices[2]);
            mirrored ? mesh_.add_triangle(b, a, c) : mesh_.add_triangle(a, b, c);
        }
    }

    MeshBuilder& mesh_;
};

}  // namespace

MeshFile parse_3mf(std::string_view bytes) {
    std::string package = checked_package(bytes);
    Handle model, reader;
    check(NMR::lib3mf_createmodel(model.out()), model);
    check(NMR::lib3mf_model_queryreader(model.get(), "3mf", reader.out()), model);
    check(NMR::lib3mf_reader_readfrombuffer(reader.get(), reinterpret_cast<BYTE*>(package.data()),
                                            package.size()),
          reader);
    MeshBuilder mesh(bytes.size());
    DWORD warnings = 0;
    check(NMR::lib3mf_reader_getwarningcount(reader.get(), &warnings), reader);
    if (warnings > 0) mesh.warn(fmt::format("the 3MF library has {} warning(s) about it", warnings));
    BuildReader(mesh).read(model);
    return mesh.finish("3mf");
}

}  // namespace its
