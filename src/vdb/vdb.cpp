#include "its/vdb.h"

#include <fmt/format.h>

#include <openvdb/io/Stream.h>
#include <openvdb/openvdb.h>
#include <openvdb/tools/SignedFloodFill.h>
#include <algorithm>
#include <limits>
#include <ostream>
#include <streambuf>

#include "base/output_file.h"
#include "base/parallel.h"
#include "base/progress.h"
#include "its/inspect.h"
#include "shell/access.h"
#include "surface/level_cells.h"

namespace its {

namespace {

/// A stream into a file that appears complete or not at all. Errors of the file pass through the stream, which
/// would otherwise swallow them.
class OutputBuffer : public std::streambuf {
public:
    explicit OutputBuffer(OutputFile& file) : file_(file) {}

private:
    std::streamsize xsputn(const char* text, std::streamsize size) override {
        file_.write(std::as_bytes(std::span(text, std::size_t(size))));
        return size;
    }
    int_type overflow(int_type c) override {
        const char byte = traits_type::to_char_type(c);
        file_.write(std::as_bytes(std::span(&byte, 1)));
        return traits_type::not_eof(c);
    }

    OutputFile& file_;
};

/// OpenVDB 10 takes no scale whose cube is below 3e-15, and grids of f have 32-bit values.
constexpr double least_width = 1.5e-5, most_value = std::numeric_limits<float>::max();

/// \throws InputError
void require_size(double width, double half_width) {
    if (width >= least_width && width * half_width <= most_value) return;
    throw InputError(
        fmt::format("cells {:.3g} wide: a grid of OpenVDB can have them from {:g} on, and values up to "
                    "{:.2g}; scale the mesh, or take another depth",
                    width, least_width, most_value));
}

openvdb::FloatGrid::Ptr make_grid(const shell::ShellData& shell, const VdbOptions& options,
                                  const Progress& progress) {
    const double width = shell.lattice.width;
    const bool inside = shell.info.sign != SignRule::unsigned_rule;
    openvdb::FloatGrid::Ptr grid = openvdb::FloatGrid::create(float(options.half_width * width));
    grid->setName("f");
    openvdb::math::Transform::Ptr transform = openvdb::math::Transform::createLinearTransform(width);
    const Vec3 origin = shell.lattice.position({0, 0, 0});
    transform->postTranslate({origin.x, origin.y, origin.z});
    grid->setTransform(transform);

    openvdb::FloatGrid::Accessor accessor = grid->getAccessor();
    for (const surface::LevelCell& cell : surface::find_level_cells(
             shell.octree, shell.field, -options.half_width, options.half_width, Parts(progress).until(0.5)))
        for (int c = 0; c < 8; ++c) {
            const double value = cell.value[std::size_t(c)];
            if (!(std::abs(value) < options.half_width)) continue;
            const openvdb::Coord at(int(cell.at[0]) + (c & 1), int(cell.at[1]) + (c >> 1 & 1),
                                    int(cell.at[2]) + (c >> 2));
            accessor.setValueOn(at, float(width * value));
        }
    if (inside) {
        grid->setGridClass(openvdb::GRID_LEVEL_SET);
        openvdb::tools::signedFloodFill(grid->tree());
    }
    grid->insertMeta("epsilon_inner", openvdb::DoubleMetadata(shell.info.epsilon_inner));
    grid->insertMeta("epsilon_outer", openvdb::DoubleMetadata(shell.info.epsilon_outer));
    grid->insertMeta("depth", openvdb::Int32Metadata(shell.info.depth));
    grid->insertMeta("sign", openvdb::StringMetadata(std::string(name(shell.info.sign))));
    return grid;
}

}  // namespace

void write_vdb(const ThinShell& shell, const std::filesystem::path& path, const VdbOptions& options) {
    if (!(options.half_width >= 1 && options.half_width <= 64))
        throw OptionError(fmt::format("half width {}: must be 1 to 64", options.half_width));
    require_size(shell::Access::data(shell).lattice.width, options.half_width);
    run_call(options.run, "grid", [&](const Progress& progress) {
        openvdb::initialize();
        const openvdb::FloatGrid::Ptr grid = make_grid(shell::Access::data(shell), options, progress);
        OutputFile file(path);
        OutputBuffer buffer(file);
        std::ostream stream(&buffer);
        stream.exceptions(std::ios::badbit);  // an OutputFile's error is rethrown as it is
        openvdb::io::Stream(stream).write(openvdb::GridCPtrVec{grid});
        stream.flush();
        file.commit();
    });
}

}  // namespace its
