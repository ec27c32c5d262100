#pragma once

#include <span>

#include "its/mesh.h"

/// Meshes in arrays of the library's own types, which all algorithms read.
namespace its::mesh {

/// Such arrays, wherever they lie.
struct Arrays {
    std::span<const Vec3> vertices;
    std::span<const Triangle> triangles;

    Arrays() = default;
    Arrays(std::span<const Vec3> points, std::span<const Triangle> corners)
        : vertices(points), triangles(corners) {}
    Arrays(const Mesh& mesh) : vertices(mesh.vertices), triangles(mesh.triangles) {}

    MeshView view() const { return {ArrayView(vertices), ArrayView(triangles)}; }
};

Mesh copy_of(const Arrays& arrays);

/// A view as such arrays: the caller's own where they have that layout, else copies.
class Native {
public:
    /// \throws as MeshView says
    explicit Native(const MeshView& view);
    Native(const Native&) = delete;
    Native& operator=(const Native&) = delete;

    operator const Arrays&() const { return arrays_; }
    const Arrays& arrays() const { return arrays_; }

private:
    Mesh copies_;
    Arrays arrays_;
};

}  // namespace its::mesh
