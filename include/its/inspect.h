#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include "its/mesh.h"

/// What is right and wrong with a mesh, and what its inside can mean.
namespace its {

/// How the inside of a mesh is defined.
enum class SignRule : std::uint8_t {
    winding,  ///< inside where the integer winding number is ≥ 1; needs every edge matched by its opposite
    generalized,    ///< generalized winding number > ½, within M's bounds; for oriented meshes with boundary
    unsigned_rule,  ///< no inside: D ≥ 0, and the shell is around both sides of M
    even_odd,  ///< inside where a ray to infinity crosses M an odd number of times, whatever the directions of
               ///< its triangles; needs every edge to have an even number of them
};

/// "winding", "generalized", "unsigned", "even-odd".
std::string_view name(SignRule rule);
/// The rule of that name; empty: there is none.
std::optional<SignRule> parse_sign_rule(std::string_view name);

/// A rule other than the one that is chosen for a mesh, which may be what somebody wants, and what it does.
enum class SignAdvice : std::uint8_t {
    none,
    around_both_sides,     ///< SignRule::unsigned_rule: a shell around both sides
    with_holes_open,       ///< the same; holes, which would be filled, stay open
    winding_as_it_is,      ///< SignRule::winding, without turning triangles around: then nothing is inside
    crossings_as_it_is,    ///< SignRule::even_odd, without turning triangles around
    generalized_as_it_is,  ///< SignRule::generalized, by the directions of the triangles as they are
    fill_nevertheless,     ///< SignRule::generalized, though its filled holes seem to make no inside
};

/// The enumerator, with hyphens: "around-both-sides".
std::string_view name(SignAdvice advice);
/// The advice of that name; empty: there is none.
std::optional<SignAdvice> parse_sign_advice(std::string_view name);
/// The rule that is advised; empty for SignAdvice::none.
std::optional<SignRule> advised_rule(SignAdvice advice);

/// What is known about a mesh before anything is built from it. Counts are of the mesh as it stands;
/// vertices with identical coordinates are taken as one for everything topological.
struct MeshReport {
    std::uint64_t vertices = 0;  ///< distinct positions used by triangles
    std::uint64_t triangles = 0;
    std::uint64_t degenerate = 0;          ///< zero area, exactly
    std::uint64_t duplicate = 0;           ///< triangles over three corners that an earlier triangle has too
    std::uint64_t boundary_edges = 0;      ///< with exactly one triangle
    std::uint64_t nonmanifold_edges = 0;   ///< with more than two
    std::uint64_t inconsistent_edges = 0;  ///< two triangles that run through it in the same direction
    std::uint64_t unbalanced_edges = 0;    ///< whose uses one way and the other do not cancel; 0: M is a cycle
    std::uint64_t odd_edges = 0;   ///< with an odd number of triangles; 0: even-odd crossings are defined
    std::uint64_t components = 0;  ///< connected through shared vertices
    std::int64_t euler = 0;        ///< V − E + F
    bool closed = false;           ///< no boundary edge, at least one triangle
    bool oriented = false;         ///< no inconsistent edge
    Box bounds;
    double signed_volume = 0;                 ///< of the cones from the centre of the bounds; < 0: inside out
    SignRule sign = SignRule::unsigned_rule;  ///< what `auto` chooses
    std::string sign_reason;                  ///< one sentence: why
    SignAdvice sign_advice = SignAdvice::none;
    std::uint64_t turned = 0;  ///< triangles that `auto` turns around before it builds; see oriented()
    double separating = 1;     ///< for meshes with boundary that agree about the outside: the share of the area
                               ///< that separates inside from outside once holes are filled, by 512 samples
    /// Wall clock: the call.
    struct Seconds {
        double total = 0;
    } seconds = {};
};

/// Examines a mesh. Reports no progress.
/// \throws InputError on indices out of range, non-finite coordinates, or no triangles; OptionError (run).
MeshReport inspect(const MeshView& mesh, const Run& run = {});

/// The mesh as `auto` builds it: triangles that MeshReport::turned counts have their second and third corner
/// exchanged, all else is the same. Reports no progress. \throws as inspect().
Mesh oriented(const MeshView& mesh, const Run& run = {});

}  // namespace its
