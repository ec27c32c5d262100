#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "mesh/arrays.h"
#include "mesh/attributes.h"
#include "simplify/complex.h"

/// Colours and texture coordinates of a simplified mesh, from those of the mesh it came from.
namespace its::simplifier {

/// Keeps the mesh's wedges: its corners, put together by position, colour and texture coordinates.
class AttributeTransfer {
public:
    /// The mesh and attributes, which are known to fit, must outlive this.
    AttributeTransfer(const mesh::Arrays& mesh, const MeshAttributes& attributes);

    /// For Complex; empty if there are neither colours nor texture coordinates.
    std::span<const Triangle> wedges() const { return wedges_.triangles; }

    /// Attributes at the corners of the triangles that are left, in their order.
    /// \param result  made of them
    MeshAttributes attributes_of(const Complex& current, const mesh::Arrays& result) const;

private:
    /// A point of a triangle of the mesh.
    struct Place {
        double squared;  ///< squared distance from where it was looked for
        std::uint32_t triangle;
        std::array<double, 3> weights;  ///< barycentric
    };

    std::vector<std::vector<std::uint32_t>> members_of(const Complex& current) const;
    Place place_of(std::uint32_t wedge, std::uint32_t t, std::uint32_t k, const Complex& current,
                   std::span<const std::uint32_t> members) const;
    void look_around(std::uint32_t wedge, const Vec3& p, Place& best) const;
    void try_triangle(std::uint32_t t, const Vec3& p, Place& best) const;

    mesh::Arrays mesh_;
    const MeshAttributes& attributes_;
    mesh::Wedges wedges_;
    std::vector<std::uint64_t> begin_;  ///< of each wedge's triangles in around_
    std::vector<std::uint32_t> around_;
    bool split_normals_ = false;  ///< somewhere the mesh has several normals at one position
};

}  // namespace its::simplifier
