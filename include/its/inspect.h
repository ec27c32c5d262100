#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "its/mesh.h"

/// What is right and wrong with a mesh, and what its inside can mean.
namespace ITS_API its {

/// How the inside of a mesh is defined.
enum class SignRule : std::uint8_t {
    winding,        ///< inside where the integer winding number is ≥ 1; needs a boundary that cancels
    generalized,    ///< generalized winding number > ½, within M's bounds; for oriented meshes with boundary
    unsigned_rule,  ///< no inside: D ≥ 0, and the shell is around both sides of M
    even_odd,  ///< inside where a ray to infinity crosses M an odd number of times, whatever the directions of
               ///< its triangles; needs edges to have an even number of them
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

/// How a closed part of a mesh faces the wrong way.
enum class PartFault : std::uint8_t {
    inside_out,         ///< it faces inward and lies in no other part
    like_its_container  ///< it lies in another part and faces as that does: no cavity, and no solid in one
};

/// "inside-out", "like-its-container".
std::string_view name(PartFault fault);
/// The fault of that name; empty: there is none.
std::optional<PartFault> parse_part_fault(std::string_view name);

/// A closed part that faces the wrong way.
struct WrongPart {
    PartFault fault = PartFault::inside_out;
    std::uint64_t triangles = 0;
    std::uint64_t first_triangle = 0;  ///< the lowest of the part's, in the mesh
    Box bounds;
    double volume = 0;  ///< the integral of the part's winding number; < 0: it faces inward. ±infinity or
                        ///< ±0 beyond what a double can be, at sizes from 1e102 and below 1e-107
    std::uint64_t depth = 0;  ///< parts that it lies in
    /// Its surface crosses that of another part, or those that it lies in cross each other: then what is meant
    /// is not known, and turn_parts() leaves it as it is.
    bool overlaps = false;
};

/// The closed parts of a mesh as `auto` builds it: sets of triangles connected through edges that close without
/// others. Parts that only touch, at points, along edges or faces, are several. One part lies in another if the
/// winding number of that, about its points, is not 0.
struct PartsReport {
    std::uint64_t closed = 0;       ///< closed parts
    std::uint64_t nested = 0;       ///< of them, those that lie in another
    std::uint64_t overlapping = 0;  ///< of them, those whose surface crosses that of another, or is the same
    std::vector<WrongPart> wrong;   ///< ascending by first_triangle
    std::uint64_t to_turn = 0;      ///< parts that turn_parts() turns around
};

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
    std::uint64_t unbalanced_edges = 0;    ///< whose uses one way and the other do not cancel
    std::uint64_t odd_edges = 0;           ///< with an odd number of triangles
    /// Unbalanced edges that do not cancel as segments in space either: where an edge is split on one side
    /// only, by points exactly on it, there is no gap. 0: M is a cycle, and winding numbers are whole.
    std::uint64_t open_edges = 0;
    std::uint64_t open_odd_edges = 0;  ///< the same of odd edges; 0: even-odd crossings are defined
    std::uint64_t t_junctions = 0;     ///< points at which such an edge is split
    std::uint64_t components = 0;      ///< connected through shared vertices
    std::int64_t euler = 0;            ///< V − E + F
    bool closed = false;               ///< no boundary edge but those at T-junctions
    bool oriented = false;             ///< no inconsistent edge
    Box bounds;
    double signed_volume = 0;  ///< of the cones from the centre of the bounds; < 0: inside out. As
                               ///< WrongPart::volume where that is beyond what a double can be
    SignRule sign = SignRule::unsigned_rule;  ///< what `auto` chooses
    std::string sign_reason;                  ///< one sentence: why
    SignAdvice sign_advice = SignAdvice::none;
    std::uint64_t turned = 0;    ///< triangles that `auto` turns around before it builds; see oriented()
    std::uint64_t repaired = 0;  ///< triangles that `auto` turns since they disagree with those around them;
                                 ///< all triangles are turned besides where the mesh is inside out then
    double separating = 1;       ///< for meshes with boundary: the share of the area that separates inside from
                                 ///< outside once directions are repaired and holes are filled, by 512 samples
    PartsReport parts;           ///< what of the mesh, so turned around, faces the wrong way
    /// Wall clock: the call.
    struct Seconds {
        double total = 0;
    } seconds = {};
};

/// Examines a mesh. Reports no progress.
/// \throws InputError on indices out of range, non-finite coordinates, or no triangles; OptionError (run).
MeshReport inspect(const MeshView& mesh, const Run& run = {});

/// The mesh as `auto` builds it: triangles that MeshReport::turned counts have their second and third corner
/// exchanged, all else is the same. Reports no progress.
/// \throws as inspect().
Mesh oriented(const MeshView& mesh, const Run& run = {});

/// The mesh as `auto` builds it, and its closed parts turned around by nesting: those that lie in no other face
/// outward, those in them inward, and so on: solid, cavity, solid. Parts that overlap others stay as they are.
/// Reports no progress.
/// \throws as inspect().
Mesh turn_parts(const MeshView& mesh, const Run& run = {});

}  // namespace its
