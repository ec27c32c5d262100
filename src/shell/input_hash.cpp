#include <xxhash.h>

#include <array>
#include <bit>
#include <memory>
#include <new>
#include <span>

#include "base/parallel.h"
#include "its/shell.h"
#include "its/version.h"
#include "its/weld.h"
#include "mesh/arrays.h"
#include "mesh/require.h"
#include "octree/lattice.h"
#include "shell/budget.h"
#include "shell/input_hash.h"

namespace its {

namespace {

/// The depth that build() chooses. \throws as build()
int chosen_depth(const mesh::Arrays& mesh, const BuildOptions& options) {
    return with_threads(options.run.threads, [&] {
        mesh::require_usable(mesh);
        octree::require_size(octree::bounds(mesh));
        if (options.weld == 0) return shell::automatic_depth(mesh, options.max_memory);
        return shell::automatic_depth(weld(mesh.view(), options.weld).mesh, options.max_memory);
    });
}

}  // namespace

std::array<std::uint64_t, 2> input_hash(const MeshView& view, const BuildOptions& options) {
    const mesh::Native native(view);
    const bool known = options.depth || options.thickness > 0;
    return shell::hash_of(native, options, known ? options.depth.value_or(0) : chosen_depth(native, options));
}

std::array<std::uint64_t, 2> shell::hash_of(const mesh::Arrays& mesh, const BuildOptions& options, int depth) {
    constexpr std::uint64_t automatic = ~std::uint64_t{0};
    // Everything that build() makes a difference of. Memory has limited the depth, if anything; of a shell that
    // is built to a thickness, it may have left cells coarse, which the shell says.
    const std::uint64_t numbers[] = {
        options.thickness > 0 ? automatic : std::uint64_t(depth),
        options.sign ? std::uint64_t(*options.sign) : automatic,
        std::uint64_t(options.turn_parts),
        std::uint64_t(options.extrema),
        std::uint64_t(options.solver),
        std::bit_cast<std::uint64_t>(options.weld + 0.0),
        std::bit_cast<std::uint64_t>(options.thickness + 0.0),
        options.max_cells,
        options.deepest ? std::uint64_t(*options.deepest) : automatic,
        mesh.vertices.size(),
        mesh.triangles.size(),
    };
    const std::unique_ptr<XXH3_state_t, decltype(&XXH3_freeState)> state(XXH3_createState(), XXH3_freeState);
    if (!state) throw std::bad_alloc();
    XXH3_128bits_reset(state.get());
    const auto add = [&](const auto& array) {
        const auto bytes = std::as_bytes(std::span(array));
        XXH3_128bits_update(state.get(), bytes.data(), bytes.size());
    };
    add(ITS_VERSION);
    add(numbers);
    if (options.up != UpAxis::unknown) add(std::array{options.up});
    add(mesh.vertices);
    add(mesh.triangles);
    const XXH128_hash_t hash = XXH3_128bits_digest(state.get());
    return {hash.low64, hash.high64};
}

}  // namespace its
