#include <fmt/format.h>

#include <Model/COM/NMR_DLLInterfaces.h>

#include <utility>

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

std::uint32_t little_endian(std::string_view bytes, std::size_t at, int size) {
    std::uint32_t value = 0;
    for (int i = size - 1; i >= 0; --i)
        value = value << 8 | static_cast<unsigned char>(bytes[at + std::size_t(i)]);
    return value;
}

/// Refuses archives that unpack to far more than a mesh can be compressed: the table of contents is looked at
/// before anything is unpacked. (The format: APPNOTE.TXT, 4.3.12 and 4.3.16.)
void check_archive(std::string_view bytes) {
    constexpr std::uint64_t allowed = std::uint64_t{1} << 26, allowed_per_byte = 64;
    constexpr std::size_t end_size = 22, entry_size = 46;
    const std::size_t end = bytes.rfind("PK\x05\x06");
    if (end == std::string_view::npos || bytes.size() - end < end_size) {
        throw InputError("not a usable 3MF file: the archive has no table of contents: it has been cut");
    }
    std::size_t at = little_endian(bytes, end + 16, 4);
    const std::uint32_t entries = little_endian(bytes, end + 10, 2);
    std::uint64_t unpacked = 0;
    for (std::uint32_t i = 0; i < entries; ++i) {
        if (at > end || end - at < entry_size || bytes.substr(at, 4) != "PK\x01\x02") {
            throw InputError("not a usable 3MF file: the archive's table of contents is damaged");
        }
        unpacked += little_endian(bytes, at + 24, 4);
        at += entry_size + little_endian(bytes, at + 28, 2) + little_endian(bytes, at + 30, 2) +
              little_endian(bytes, at + 32, 2);
    }
    if (unpacked > allowed + allowed_per_byte * bytes.size()) {
        throw InputError(
            fmt::format("the 3MF archive would unpack to {} bytes, out of all proportion", unpacked));
    }
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
        constexpr int deepest = 64;
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
    check_archive(bytes);
    Handle model, reader;
    check(NMR::lib3mf_createmodel(model.out()), model);
    check(NMR::lib3mf_model_queryreader(model.get(), "3mf", reader.out()), model);
    std::string copy(bytes);  // the library wants to be allowed to write
    check(NMR::lib3mf_reader_readfrombuffer(reader.get(), reinterpret_cast<BYTE*>(copy.data()), copy.size()),
          reader);
    MeshBuilder mesh(bytes.size());
    DWORD warnings = 0;
    check(NMR::lib3mf_reader_getwarningcount(reader.get(), &warnings), reader);
    if (warnings > 0) mesh.warn(fmt::format("the 3MF library has {} warning(s) about it", warnings));
    BuildReader(mesh).read(model);
    return mesh.finish("3mf");
}

}  // namespace its
