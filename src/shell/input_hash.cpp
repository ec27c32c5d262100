#include <xxhash.h>

#include <array>
#include <bit>
#include <memory>
#include <new>
#include <span>

#include "its/shell.h"
#include "its/version.h"
#include "mesh/arrays.h"
#include "shell/target.h"

namespace its {

std::array<std::uint64_t, 2> input_hash(const MeshView& view, const BuildOptions& options) {
    const mesh::Native native(view);
    return shell::hash_of(native, options, shell::target_of(native, options));
}

std::array<std::uint64_t, 2> shell::hash_of(const mesh::Arrays& mesh, const BuildOptions& options,
                                            const Target& target) {
    constexpr std::uint64_t automatic = ~std::uint64_t{0};
    // Everything that build() makes a difference of, but for memory: it may have left cells coarse, which the
    // shell says.
    const std::uint64_t numbers[] = {
        options.depth ? std::uint64_t(*options.depth) : automatic,
        options.sign ? std::uint64_t(*options.sign) : automatic,
        std::uint64_t(options.turn_parts),
        std::uint64_t(options.extrema),
        std::uint64_t(options.solver),
        std::bit_cast<std::uint64_t>(options.weld + 0.0),
        std::bit_cast<std::uint64_t>(target.thickness),
        target.max_cells,
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
