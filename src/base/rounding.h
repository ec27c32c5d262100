#pragma once

/// Constants of the floating-point model: IEEE 754 binary64, round to nearest, no contraction.
namespace its {

/// u = 2⁻⁵³: |fl(a ∘ b) − a ∘ b| ≤ u·|a ∘ b| for each of + − × ÷ √ without overflow or underflow.
inline constexpr double unit_roundoff = 0x1p-53;

}  // namespace its
