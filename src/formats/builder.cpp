#include <fmt/format.h>

#include <algorithm>

#include "formats/readers.h"
#include "geometry/vec3.h"
#include "its/mesh_file.h"

namespace its::formats {

namespace {

/// Steps that the ear clipping of one file may take: a second or so, and more for larger files.
constexpr std::uint64_t polygon_budget = std::uint64_t{1} << 26, polygon_budget_per_byte = 16;
/// Vertices and triangles that instances of a file's parts may add up to: some 200 MB, and more for larger
/// files.
constexpr std::uint64_t instance_budget = std::uint64_t{1} << 23, instance_budget_per_byte = 16;

}  // namespace

void MeshBuilder::reserve_vertices(std::uint64_t claimed, std::size_t bytes_left, std::size_t bytes_each) {
    vertices_.reserve(vertices_.size() +
                      std::size_t(std::min<std::uint64_t>(claimed, bytes_left / bytes_each)));
}

void MeshBuilder::reserve_triangles(std::uint64_t claimed, std::size_t bytes_left, std::size_t bytes_each) {
    const auto more = std::size_t(std::min<std::uint64_t>(claimed, bytes_left / bytes_each));
    corners_.reserve(corners_.size() + 3 * more);
    sizes_.reserve(sizes_.size() + more);
}

void MeshBuilder::add_vertex(const Vec3& position) {
    if (vertices_.size() >= std::size_t(no_vertex) - 1) {
        throw InputError("more than 4294967294 vertices; cut the mesh into parts");
    }
    nonfinite_vertices_ += finite(position) ? 0 : 1;
    vertices_.push_back(position);
}

void MeshBuilder::end_face(bool count_empty) {
    const std::size_t size = corners_.size() - face_begin_;
    if (size == 0 && !count_empty) return;
    sizes_.push_back(std::uint32_t(std::min<std::size_t>(size, 0xffffffff)));
    if (size > 0xffffffff) throw InputError("a face with more than 4294967295 corners");
    face_begin_ = corners_.size();
}

void MeshBuilder::charge_instance(std::uint64_t items) {
    const std::uint64_t limit = instance_budget + instance_budget_per_byte * bytes_;
    if (items > limit - instances_) {
        throw InputError(
            fmt::format("its repeated parts add up to more than {} vertices and triangles; "
                        "write it out with fewer copies",
                        limit));
    }
    instances_ += items;
}

/// Whether the face can be triangulated; counts it under its defect otherwise.
bool MeshBuilder::usable(std::span<const std::uint32_t> face) {
    if (face.size() < 3) {
        ++too_short_;
        return false;
    }
    bool known = true;
    for (const std::uint32_t v : face) {
        if (v < vertices_.size()) continue;
        known = false;
        if (v == nonfinite_vertex) continue;
        ++out_of_range_;
        return false;
    }
    if (known && nonfinite_vertices_ == 0) return true;
    for (const std::uint32_t v : face) {
        if (v == nonfinite_vertex || !finite(vertices_[v])) {
            ++nonfinite_;
            return false;
        }
    }
    return true;
}

void MeshBuilder::remove_nonfinite_vertices() {
    std::vector<std::uint32_t> number(vertices_.size());
    std::uint32_t kept = 0;
    for (std::size_t i = 0; i < vertices_.size(); ++i) {
        number[i] = kept;
        if (finite(vertices_[i])) vertices_[kept++] = vertices_[i];
    }
    vertices_.resize(kept);
    for (Triangle& t : triangles_) t = {number[t[0]], number[t[1]], number[t[2]]};
}

void MeshBuilder::set_text_colour(std::uint64_t vertex, const Colour& colour) {
    text_colours_ = true;
    colours.set_vertex(vertex, colour);
}

MeshAttributes MeshBuilder::take_attributes() {
    MeshAttributes found;
    if (!attributes_) return found;
    const auto& read = colours.values();
    byte_colours |= text_colours_ && std::any_of(read.begin(), read.end(), [](const Colour& c) {
                        return *std::max_element(c.begin(), c.end()) > 1;
                    });
    for (Colour& c : colours.values()) {
        const bool has_alpha = !text_colours_ || c[3] != opaque;
        for (float& x : c)
            x = std::clamp(text_colours_ && byte_colours ? float(double{x} / 255) : x, 0.0F, 1.0F);
        if (!has_alpha) c[3] = 1;
    }
    const auto warn_replaced = [&](std::uint64_t count, std::string_view what) {
        if (count > 0) warn(fmt::format("{} {} missing or not finite: replaced by a default", count, what));
    };
    warn_replaced(colours.replaced(), "colours are");
    warn_replaced(texture.replaced(), "texture coordinates are");
    warn_replaced(normals.replaced(), "normals are");
    found.byte_colours = byte_colours && colours.size() > 0;
    found.colours = colours.take();
    found.texture = texture.take();
    found.normals = normals.take();
    return found;
}

/// A triangle of three corners of the face that begins there.
void MeshBuilder::add_triangle_of(std::size_t begin, const Triangle& local) {
    const Triangle t{corners_[begin + local[0]], corners_[begin + local[1]], corners_[begin + local[2]]};
    triangles_.push_back(t);
    if (!attributes_) return;
    const std::array<std::size_t, 3> corners{begin + local[0], begin + local[1], begin + local[2]};
    colours.add_triangle(t, corners);
    texture.add_triangle(t, corners);
    normals.add_triangle(t, corners);
}

void MeshBuilder::warn_of(std::uint64_t count, std::string_view what, std::uint64_t first) {
    if (count == 0) return;
    warn(fmt::format("{} face{} left out: {} (the first is face {})", count, count == 1 ? "" : "s", what,
                     first + 1));
}

MeshFile MeshBuilder::finish(std::string format) {
    drop_face();
    std::uint64_t budget = polygon_budget + polygon_budget_per_byte * bytes_, given_up = 0;
    triangles_.reserve(sizes_.size());
    std::size_t begin = 0;
    std::vector<Triangle> parts;  // of a polygon
    for (std::size_t i = 0; i < sizes_.size(); begin += sizes_[i++]) {
        const std::span<const std::uint32_t> face(corners_.data() + begin, sizes_[i]);
        const std::uint64_t before[3] = {out_of_range_, too_short_, nonfinite_};
        if (!usable(face)) {
            if (before[0] == 0 && out_of_range_ == 1) first_out_of_range_ = i;
            if (before[1] == 0 && too_short_ == 1) first_too_short_ = i;
            if (before[2] == 0 && nonfinite_ == 1) first_nonfinite_ = i;
        } else if (face.size() == 3) {
            add_triangle_of(begin, {0, 1, 2});
        } else {
            parts.clear();
            given_up += triangulate(face, vertices_, budget, parts) ? 0 : 1;
            for (const Triangle& part : parts) add_triangle_of(begin, part);
        }
        if (triangles_.size() > std::size_t(no_vertex) - 1) {
            throw InputError("more than 4294967294 triangles; cut the mesh into parts");
        }
    }
    if (unreadable_ > 0) warn(fmt::format("{} face(s) left out: not readable", unreadable_));
    warn_of(out_of_range_, "corner index out of range", first_out_of_range_);
    warn_of(too_short_, "fewer than three corners", first_too_short_);
    warn_of(nonfinite_, "corner that is not a finite point", first_nonfinite_);
    if (given_up > 0)
        warn(fmt::format("{} polygon(s) too intricate to triangulate well: made into fans", given_up));
    if (triangles_.empty()) {
        const std::uint64_t faces = sizes_.size() + unreadable_;
        throw InputError(faces == 0
                             ? std::string("it holds no faces")
                             : fmt::format("none of its {} faces is usable: {}", faces, warnings_.front()));
    }
    if (nonfinite_vertices_ > 0) {
        warn(fmt::format("{} vertices left out: not finite", nonfinite_vertices_));
        remove_nonfinite_vertices();
    }
    MeshAttributes attributes = take_attributes();
    return {{std::move(vertices_), std::move(triangles_)},
            std::move(format),
            std::move(warnings_),
            std::move(attributes),
            UpAxis::unknown};
}

}  // namespace its::formats
