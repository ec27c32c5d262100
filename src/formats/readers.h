#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "base/input_file.h"
#include "base/quote.h"
#include "formats/text.h"
#include "its/mesh.h"
#include "its/mesh_file.h"

/// One reader per file format. Each takes the whole file as bytes, trusts none of them, and takes time and
/// memory in proportion to their number, whatever the counts inside claim.
namespace its::formats {

/// The extension with its dot, in lower case.
std::string lower_extension(const std::filesystem::path& path);

/// The most characters of a warning or error of a reader, whatever the file puts into it; with the file's name,
/// of which at most longest_name are shown, a line has less than 300.
constexpr std::size_t longest_line = 180;

// All readers: \throws InputError if nothing usable is in there; the message does not name the file.

MeshFile parse_obj(std::string_view bytes, const ReadOptions& options = {});
/// ASCII or binary, whichever it is.
MeshFile parse_stl(std::string_view bytes);
MeshFile parse_ply(std::string_view bytes, const ReadOptions& options = {});
/// The vertices of a PLY file alone, non-finite ones included; the file need not have faces.
std::vector<Vec3> parse_ply_points(std::string_view bytes);
MeshFile parse_off(std::string_view bytes, const ReadOptions& options = {});
/// Loads one file that a .gltf refers to, given its relative path;
/// \throws FileError.
using LoadSibling = std::function<FileBytes(const std::string& relative_path)>;
/// GLB (binary) or glTF (JSON). Without `load`, files that it refers to are refused.
MeshFile parse_gltf(std::string_view bytes, const LoadSibling& load = {}, const ReadOptions& options = {});
MeshFile parse_3mf(std::string_view bytes, const ReadOptions& options = {});

/// The reader for these bytes: by their first bytes where a format has a mark, else by the extension (".obj",
/// …; may be empty), else by a guess.
/// \throws InputError if no format fits.
MeshFile parse_mesh(std::string_view bytes, const std::string& extension, const LoadSibling& load = {},
                    const ReadOptions& options = {});

/// Whether these bytes are an STL file in text form. Binary files that begin with "solid" exist.
bool is_ascii_stl(std::string_view bytes);

/// The values of one attribute on their way from a file into CornerValues: value i belongs to vertex i, or
/// faces name the values of their corners. What is missing or not finite becomes a default value.
template <class Value>
class AttributeReader {
public:
    explicit AttributeReader(const Value& missing) : missing_(missing) {}

    bool by_corner = false;

    std::size_t size() const { return values_.size(); }
    void add(Value value) {
        if (!is_finite(value)) {
            ++nonfinite_;
            value = missing_;
        }
        values_.push_back(value);
    }
    /// For vertices in ascending order.
    void set_vertex(std::uint64_t vertex, const Value& value) {
        if (values_.size() < vertex) values_.resize(vertex, missing_);
        add(value);
    }
    /// The value of the corner added last, the `corners`-th of all; any number out of range: none.
    void set_corner(std::size_t corners, std::int64_t value) {
        corners_.resize(corners, none);
        corners_.back() = value >= 0 && value < none ? std::uint32_t(value) : none;
    }
    void drop_corners(std::size_t kept) { corners_.resize(std::min(corners_.size(), kept)); }

    /// A triangle of these vertices, which are these corners of all.
    void add_triangle(const Triangle& vertices, const std::array<std::size_t, 3>& corners) {
        if (values_.empty()) return;
        Triangle numbers = vertices;
        for (std::size_t k = 0; k < 3; ++k) {
            if (by_corner) numbers[k] = corners[k] < corners_.size() ? corners_[corners[k]] : none;
            if (numbers[k] >= values_.size()) ++unset_, numbers[k] = std::uint32_t(values_.size());
        }
        triangles_.push_back(numbers);
    }
    /// How many values were replaced by the default.
    std::uint64_t replaced() const { return nonfinite_ + unset_; }
    std::vector<Value>& values() { return values_; }
    CornerValues<Value> take() {
        if (unset_ > 0) values_.push_back(missing_);
        return {std::move(values_), std::move(triangles_)};
    }

private:
    static constexpr std::uint32_t none = 0xffffffff;
    static bool is_finite(const Vec3& v) {
        return std::isfinite(v.x) && std::isfinite(v.y) && std::isfinite(v.z);
    }
    template <class Array>
    static bool is_finite(const Array& numbers) {
        return std::all_of(numbers.begin(), numbers.end(), [](auto x) { return std::isfinite(x); });
    }

    Value missing_;
    std::vector<Value> values_;
    std::vector<std::uint32_t> corners_;  ///< of all faces, one after the other
    std::vector<Triangle> triangles_;
    std::uint64_t nonfinite_ = 0, unset_ = 0;
};

/// Collects vertices and faces in the order of the file, and makes the mesh of them.
class MeshBuilder {
public:
    /// `bytes`: the size of the file; bounds what polygons and instances may cost.
    explicit MeshBuilder(std::size_t bytes, const ReadOptions& options = {})
        : bytes_(bytes), attributes_(options.attributes) {}

    /// Attributes are read only where they are asked for.
    bool wants_attributes() const { return attributes_; }
    AttributeReader<Colour> colours{{1, 1, 1, 1}};
    AttributeReader<TexturePoint> texture{{0, 0}};
    AttributeReader<Vec3> normals{{0, 0, 0}};
    bool byte_colours = false;
    /// A colour in text: components in [0, 1], or, if any in the file is larger, in [0, 255]. An alpha that the
    /// file has not is `opaque`.
    void set_text_colour(std::uint64_t vertex, const Colour& colour);
    static constexpr float opaque = -1;
    std::size_t corner_count() const { return corners_.size(); }                ///< of all faces
    std::size_t face_corners() const { return corners_.size() - face_begin_; }  ///< of the one being built
    void warn_not_carried(std::string_view what) { warn(std::string(what) + " are not read"); }

    /// Makes room for what a header claims, but for no more than `bytes_left` can hold at `bytes_each`.
    void reserve_vertices(std::uint64_t claimed, std::size_t bytes_left, std::size_t bytes_each);
    void reserve_triangles(std::uint64_t claimed, std::size_t bytes_left, std::size_t bytes_each);

    /// Adds a vertex; NaN and infinities are allowed and spoil the faces that use it.
    /// \throws InputError beyond 2³² − 2 vertices.
    void add_vertex(const Vec3& position);
    std::uint64_t vertex_count() const { return vertices_.size(); }

    /// Adds a corner to the face being built: an index from 0; any number out of range makes a bad face.
    void add_corner(std::int64_t vertex) {
        corners_.push_back(std::uint32_t(vertex >= 0 && vertex < nonfinite_vertex ? vertex : no_vertex));
    }
    /// Adds a corner that is no finite point, of readers that number only those.
    void add_nonfinite_corner() { corners_.push_back(std::uint32_t(nonfinite_vertex)); }
    /// Ends the face being built; does nothing to one without corners unless `count_empty`.
    void end_face(bool count_empty = true);
    /// Discards the corners of the face being built.
    void drop_face() {
        corners_.resize(face_begin_);
        texture.drop_corners(face_begin_);
        normals.drop_corners(face_begin_);
    }
    void add_triangle(std::int64_t a, std::int64_t b, std::int64_t c) {
        add_corner(a), add_corner(b), add_corner(c);
        end_face();
    }
    /// A face that cannot even be read.
    void add_unreadable_face() { ++unreadable_; }

    /// Instances multiply content: counts `items` more of them.
    /// \throws InputError where the sum is out of all proportion to the file.
    void charge_instance(std::uint64_t items);

    void warn(std::string_view line) { warnings_.push_back(quotable(line, longest_line)); }

    /// Triangulates, leaves bad faces out with warnings.
    /// \throws InputError if no triangle is left.
    MeshFile finish(std::string format);

private:
    static constexpr std::int64_t no_vertex = 0xffffffff, nonfinite_vertex = 0xfffffffe;

    MeshAttributes take_attributes();
    void add_triangle_of(std::size_t begin, const Triangle& local);
    bool usable(std::span<const std::uint32_t> face);
    void remove_nonfinite_vertices();
    void warn_of(std::uint64_t count, std::string_view what, std::uint64_t first);

    std::size_t bytes_;
    bool attributes_;
    bool text_colours_ = false;
    std::vector<Vec3> vertices_;
    std::vector<std::uint32_t> corners_;  ///< of all faces, one after the other
    std::vector<std::uint32_t> sizes_;    ///< of each face
    std::size_t face_begin_ = 0;
    std::vector<Triangle> triangles_;
    std::vector<std::string> warnings_;
    std::uint64_t instances_ = 0, unreadable_ = 0, nonfinite_vertices_ = 0;
    std::uint64_t out_of_range_ = 0, too_short_ = 0, nonfinite_ = 0;
    std::uint64_t first_out_of_range_ = 0, first_too_short_ = 0, first_nonfinite_ = 0;
};

/// Turns a strip of vertices into triangles of alternating direction. A triangle with a repeated index only
/// steers the strip and is no part of the surface.
class StripReader {
public:
    explicit StripReader(MeshBuilder& mesh) : mesh_(mesh) {}

    void restart() { length_ = 0; }
    void add(std::int64_t vertex) {
        if (length_ >= 2 && before_last_ != last_ && last_ != vertex && vertex != before_last_) {
            const bool odd = length_ % 2 == 1;
            mesh_.add_triangle(odd ? last_ : before_last_, odd ? before_last_ : last_, vertex);
        }
        before_last_ = last_;
        last_ = vertex;
        ++length_;
    }

private:
    MeshBuilder& mesh_;
    std::int64_t before_last_ = 0, last_ = 0;
    std::uint64_t length_ = 0;
};

/// Triangulates a polygon of n ≥ 3 corners into n − 2 triangles of corners from 0, added to `out`: a fan if it
/// is strictly convex in the plane it fits best, else by clipping ears; a corner that repeats its neighbour
/// makes a segment. Takes at most about `budget` steps, and deducts them; a polygon for which they do not
/// suffice is completed as a fan, and false returned.
bool triangulate(std::span<const std::uint32_t> polygon, std::span<const Vec3> vertices, std::uint64_t& budget,
                 std::vector<Triangle>& out);

}  // namespace its::formats
