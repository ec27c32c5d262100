#pragma once

#include "its/base.h"

/// The verifier's own exact signs of determinants: a filter in floating point, then whole numbers of any size.
namespace its::verifier {

/// Twice the signed area of a, b, p in the plane of two axes: 1 if they run counter-clockwise from the first
/// axis to the second, 0 if they are collinear.
int turn_sign(const Vec3& a, const Vec3& b, const Vec3& p, int first, int second);

/// 1 if p is strictly on the side of the plane abc that (b − a) × (c − a) points to, 0 if it is in the plane.
int plane_side(const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& p);

// The same for p displaced by an infinitesimal (δx, δy, δz), δy ≫ δz ≫ δx > 0: the convention of the file for
// lattice points on M.

/// In the plane of x and y; 0 only if a and b coincide there.
int displaced_turn(const Vec3& a, const Vec3& b, const Vec3& p);

/// Whether p is above (greater z) the plane of a triangle of which `up` is the sign of the normal's z, not 0.
bool displaced_above(const Vec3& a, const Vec3& b, const Vec3& c, int up, const Vec3& p);

/// Whether p is on the line through a and b, strictly between them.
bool strictly_between(const Vec3& a, const Vec3& b, const Vec3& p);

}  // namespace its::verifier
