#pragma once

#include "its/base.h"
#include "shell/shell_data.h"

/// f on triangles that are not M's.
namespace its::shell {

/// Proves that f stays within bounds on whole triangles: in every lattice cell on which f is trilinear and that
/// the triangle meets it is clipped, and bounded by its Bernstein–Bézier control values. See
/// docs/design/simplify.md.
class TriangleBounds {
public:
    explicit TriangleBounds(const ShellData& shell);

    /// Whether ε₁ ≤ f ≤ ε₂ is proven on the triangle (mesh coordinates): for each of its points, as a caller
    /// may round it to doubles, in the shipped evaluation of f. False does not mean that a point is outside.
    bool in_shell(const Vec3& a, const Vec3& b, const Vec3& c) const;

private:
    /// In lattice coordinates.
    struct Corners {
        Vec3 a, b, c;
    };
    bool cell_in_shell(const Corners& t, const Vec3& corner, double width,
                       const field::TrilinearCell& cell) const;

    const ShellData& shell_;
    double dilation_, margin_, displacement_;
};

}  // namespace its::shell
