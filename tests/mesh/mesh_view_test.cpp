#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <filesystem>
#include <limits>

#include "its/distance.h"
#include "its/inspect.h"
#include "its/mesh_file.h"
#include "its/shell.h"
#include "its/shell_file.h"
#include "its/simplify.h"
#include "its/verify.h"
#include "mesh/arrays.h"
#include "support/zoo.h"

namespace its {
namespace {

using testing::HasSubstr;

/// A column of a hostile array: rows and columns at distances that divide nothing, from either end.
template <class Number>
class Strided {
public:
    template <class Row>
    Strided(const std::vector<Row>& rows, std::ptrdiff_t row_stride, std::ptrdiff_t column_stride) {
        const auto count = std::ptrdiff_t(rows.size());
        const std::ptrdiff_t lowest = std::min<std::ptrdiff_t>(0, (count - 1) * row_stride) +
                                      std::min<std::ptrdiff_t>(0, 2 * column_stride);
        const std::ptrdiff_t highest = std::max<std::ptrdiff_t>(0, (count - 1) * row_stride) +
                                       std::max<std::ptrdiff_t>(0, 2 * column_stride);
        bytes_.resize(std::size_t(highest - lowest) + sizeof(Number) + 1, std::byte{0xee});
        std::byte* const first = bytes_.data() + 1 - lowest;  // at no number's alignment
        for (std::ptrdiff_t i = 0; i < count; ++i)
            for (int k = 0; k < 3; ++k) {
                const auto number = Number(rows[std::size_t(i)][std::size_t(k)]);
                std::memcpy(first + i * row_stride + k * column_stride, &number, sizeof(Number));
            }
        constexpr NumberType types[] = {NumberType::int16,  NumberType::uint16, NumberType::int32,
                                        NumberType::uint32, NumberType::int64,  NumberType::uint64};
        constexpr std::size_t width = sizeof(Number) == 2 ? 0 : sizeof(Number) == 4 ? 1 : 2;
        const NumberType type = std::is_same_v<Number, float> ? NumberType::float32
                                : std::is_same_v<Number, double>
                                    ? NumberType::float64
                                    : types[2 * width + std::is_unsigned_v<Number>];
        view_ = ArrayView(first, type, rows.size(), row_stride, column_stride);
    }
    const ArrayView& view() const { return view_; }

private:
    std::vector<std::byte> bytes_;
    ArrayView view_;
};

/// Vertices that floats hold exactly, as rows.
Mesh single_mesh() {
    Mesh mesh = zoo::torus(1.0, 0.35, 24, 12);
    for (Vec3& v : mesh.vertices) v = {double(float(v.x)), double(float(v.y)), double(float(v.z))};
    return mesh;
}

std::vector<std::array<double, 3>> rows_of(const std::vector<Vec3>& points) {
    std::vector<std::array<double, 3>> rows;
    for (const Vec3& p : points) rows.push_back({p.x, p.y, p.z});
    return rows;
}

template <class F>
void refuses(F&& call, const std::string& text) {
    try {
        call();
        FAIL() << "accepted; should say: " << text;
    } catch (const InputError& error) {
        EXPECT_THAT(error.what(), HasSubstr(text));
    }
}

void expect_same(const MeshView& view, const Mesh& mesh) {
    const Mesh copy = to_mesh(view);
    EXPECT_EQ(copy.vertices, mesh.vertices);
    EXPECT_EQ(copy.triangles, mesh.triangles);
}

template <class Index>
void expect_any_layout(const Mesh& mesh) {
    const auto rows = rows_of(mesh.vertices);
    const std::ptrdiff_t size = sizeof(Index), rows_count = std::ptrdiff_t(rows.size()),
                         triangles = std::ptrdiff_t(mesh.triangles.size());
    for (const auto& [row, column] : {std::pair{3 * size, size}, std::pair{5 * size + 1, size},
                                      std::pair{size, triangles * size}, std::pair{-3 * size, size}}) {
        const Strided<Index> corners(mesh.triangles, row, column);
        const Strided<double> wide(rows, 24, 8), fortran(rows, 8, 8 * rows_count);
        const Strided<float> narrow(rows, 12, 4), backwards(rows, -32, 4);
        for (const ArrayView& points : {wide.view(), fortran.view(), narrow.view(), backwards.view()})
            expect_same({points, corners.view()}, mesh);
    }
}

TEST(MeshView, TakesEveryLayout) {
    const Mesh mesh = single_mesh();
    expect_any_layout<std::int16_t>(mesh);
    expect_any_layout<std::uint16_t>(mesh);
    expect_any_layout<std::int32_t>(mesh);
    expect_any_layout<std::uint32_t>(mesh);
    expect_any_layout<std::int64_t>(mesh);
    expect_any_layout<std::uint64_t>(mesh);
}

TEST(MeshView, CopiesNothingOfItsOwnLayout) {
    const Mesh mesh = single_mesh();
    const mesh::Native native(mesh);
    EXPECT_EQ(native.arrays().vertices.data(), mesh.vertices.data());
    EXPECT_EQ(native.arrays().triangles.data(), mesh.triangles.data());

    std::vector<std::int32_t> corners;
    for (const Triangle& t : mesh.triangles)
        for (const std::uint32_t v : t) corners.push_back(std::int32_t(v));
    const mesh::Native flat(
        MeshView(std::span(mesh.vertices), ArrayView(std::span<const std::int32_t>(corners))));
    EXPECT_EQ(static_cast<const void*>(flat.arrays().triangles.data()), corners.data());
    EXPECT_TRUE(std::ranges::equal(flat.arrays().triangles, mesh.triangles));
}

TEST(MeshView, WithoutTrianglesTakesVerticesInOrder) {
    const Mesh mesh = zoo::tetrahedron();
    std::vector<double> numbers;
    for (const Triangle& t : mesh.triangles)
        for (const std::uint32_t v : t)
            for (int axis = 0; axis < 3; ++axis) numbers.push_back(mesh.vertices[v][axis]);
    const MeshView soup{ArrayView(std::span<const double>(numbers))};
    EXPECT_TRUE(inspect(soup).closed);
    EXPECT_EQ(inspect(soup).vertices, 4u);
    EXPECT_EQ(to_mesh(soup).triangles[1], (Triangle{3, 4, 5}));
    numbers.resize(numbers.size() - 3);
    refuses([&] { inspect(MeshView{ArrayView(std::span<const double>(numbers))}); }, "a multiple of 3");
    numbers.pop_back();
    refuses([&] { (void)ArrayView(std::span<const double>(numbers)); }, "a multiple of 3");
}

TEST(MeshView, RefusesWhatIsNoMesh) {
    const Mesh mesh = zoo::tetrahedron();
    const ArrayView points(std::span(mesh.vertices));
    const auto with = [&](const auto& numbers) {
        using Number = typename std::decay_t<decltype(numbers)>::value_type;
        return MeshView(points, ArrayView(std::span<const Number>(numbers)));
    };
    refuses([&] { inspect(with(std::vector<std::int64_t>{0, 1, 2, 0, -1, 2})); }, "triangle 1 uses vertex -1");
    refuses([&] { inspect(with(std::vector<std::int32_t>{0, 1, -7})); }, "triangle 0 uses vertex -7");
    refuses([&] { inspect(with(std::vector<std::uint64_t>{0, 1, 1ull << 32})); }, "uses vertex 4294967296");
    refuses([&] { inspect(with(std::vector<std::uint64_t>{0, 1, 4})); }, "uses vertex 4 of 4");
    refuses([&] { inspect(with(std::vector<double>{0, 1, 2})); }, "float64: they must be whole numbers");
    refuses([&] { inspect(MeshView(ArrayView(std::span(mesh.triangles)))); }, "uint32: they must be float32");
    refuses([&] { inspect(MeshView(ArrayView(nullptr, NumberType::float32, 3, 12, 4))); }, "without data");
    refuses([&] { inspect(MeshView{}); }, "no triangles");
}

/// What any function makes of a mesh it also makes of a view of it in another layout.
TEST(MeshView, EveryFunctionTakesOne) {
    const Mesh mesh = single_mesh();
    const Strided<float> points(rows_of(mesh.vertices), 20, 4);
    const Strided<std::int64_t> corners(mesh.triangles, 24, 8);
    const MeshView view(points.view(), corners.view());

    EXPECT_EQ(inspect(view).signed_volume, inspect(mesh).signed_volume);
    EXPECT_EQ(oriented(view).triangles, oriented(mesh).triangles);
    const BuildOptions options{.depth = 4};
    EXPECT_EQ(input_hash(view, options), input_hash(mesh, options));
    EXPECT_EQ(estimate_memory(view, 4), estimate_memory(mesh, 4));
    const ThinShell shell = build(view, options);
    EXPECT_EQ(encode(shell), encode(build(mesh, options)));
    EXPECT_TRUE(verify(shell, view, {.samples = 1000, .grid_samples = 1000}).passed());
    EXPECT_EQ(simplify(view, {.faces = 100}).mesh.vertices, simplify(mesh, {.faces = 100}).mesh.vertices);
    EXPECT_EQ(mesh_distance(view, mesh).max, mesh_distance(mesh, mesh).max);
    const Vec3 p{0.3, 0.4, 0.5};
    EXPECT_EQ(ClosestPoints(view).find(p).distance, ClosestPoints(mesh).find(p).distance);
    EXPECT_EQ(ClosestSides(view).side(p), ClosestSides(mesh).side(p));

    const auto folder = std::filesystem::temp_directory_path() / "its_mesh_view_test";
    std::filesystem::create_directories(folder);
    write_mesh(view, folder / "a.ply");
    EXPECT_EQ(read_mesh(folder / "a.ply").mesh.triangles, mesh.triangles);
    write_glb(std::vector<NamedMesh>{{"a", view}}, folder / "a.glb");
    EXPECT_EQ(read_mesh(folder / "a.glb").mesh.vertices, mesh.vertices);
    std::filesystem::remove_all(folder);
}

TEST(MeshView, OfAShellIsItsMesh) {
    const Mesh mesh = single_mesh();
    const ThinShell shell = build(mesh, {.depth = 3});
    expect_same(shell.mesh_view(), mesh);
    EXPECT_EQ(shell.mesh().triangles, mesh.triangles);
}

TEST(MeshView, EstimateChecksItsInputAsBuildDoes) {
    const Mesh mesh = zoo::tetrahedron();
    EXPECT_GT(estimate_memory(mesh, 8), estimate_memory(mesh, 6));
    EXPECT_THROW(estimate_memory(mesh, -1), OptionError);
    EXPECT_THROW(estimate_memory(mesh, max_depth + 1), OptionError);
    EXPECT_THROW(estimate_memory(mesh, 3, {.threads = -1}), OptionError);
    EXPECT_THROW(estimate_memory(Mesh{}, 3), InputError);
    EXPECT_THROW(estimate_memory(Mesh{{{0, 0, 0}}, {{0, 0, 1}}}, 3), InputError);
    EXPECT_THROW(estimate_memory(Mesh{{{0, 0, NAN}, {1, 0, 0}, {0, 1, 0}}, {{0, 1, 2}}}, 3), InputError);
    EXPECT_THROW(estimate_memory(zoo::box({1e15, 0, 0}, {1e15 + 1, 1, 1}), 10), InputError);
}

}  // namespace
}  // namespace its
