#include "its/picture.h"

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <png.h>
#include <unistd.h>

#include <cmath>
#include <cstring>
#include <limits>

#include "display/numbers.h"
#include "octree/lattice.h"
#include "picture/legend.h"
#include "picture/plot.h"
#include "picture/section.h"
#include "shell/access.h"
#include "support/zoo.h"

namespace its {
namespace {

namespace fs = std::filesystem;

ThinShell build_at(const Mesh& mesh, int depth) {
    BuildOptions options;
    options.depth = depth;
    return build(mesh, options);
}

const ThinShell& sphere_shell() {
    static const ThinShell shell = build_at(zoo::sphere({1, 2, 3}, 1, 4), 5);
    return shell;
}

/// Halfway through the mesh's extent, or at another fraction of it.
picture::Plane middle_plane(const Mesh& mesh, picture::Plane plane, double at = 0.5) {
    const Box box = picture::extent(mesh, plane);
    plane.offset = std::lerp(box.min.z, box.max.z, at);
    return plane;
}

bool is_blue(const picture::Rgb& c) {
    return c[2] > c[0] + 20;
}
bool is_red(const picture::Rgb& c) {
    return c[0] > c[2] + 20;
}
bool is_dark(const picture::Rgb& c) {
    return c[0] < 90 && c[1] < 90 && c[2] < 90;
}

/// A plot alone, without its surroundings, of the whole window [−1.3, 1.3]² around the sphere's centre.
struct PlainPlot {
    picture::Plane plane;
    picture::View view;
    Image image;

    PlainPlot(const ThinShell& shell, int size, picture::PlotStyle style, double radius = 1.3) {
        plane = middle_plane(shell.mesh(), picture::axis_plane(2));
        view = picture::make_view({0, 0, size, size}, {1, 2}, 2 * radius);
        image = {size, size, std::vector<std::uint8_t>(3 * std::size_t(size) * std::size_t(size), 255)};
        picture::plot(image, shell, plane, picture::mesh_section(shell.mesh(), plane, 0),
                      picture::cell_section(shell::Access::data(shell), plane), view, style,
                      picture::DivergingMap());
    }
    picture::Rgb at(double x, double y) const {
        const picture::Point2 p = view.to_pixels({x, y});
        return picture::pixel(image, int(std::floor(p.x)), int(std::floor(p.y)));
    }
};

TEST(Plot, ColoursTellInsideFromOutside) {
    const PlainPlot p(sphere_shell(), 400, {.range = 1});
    EXPECT_TRUE(is_blue(p.at(1, 2)));
    EXPECT_TRUE(is_blue(p.at(1.5, 1.6)));
    EXPECT_TRUE(is_red(p.at(-0.2, 0.8)));
    EXPECT_TRUE(is_red(p.at(1, 3.25)));
}

TEST(Plot, TheSectionIsDarkAndNothingElse) {
    const PlainPlot p(sphere_shell(), 800, {.range = 1});
    // The section is a polygon of many sides with all corners on or just inside the circle of radius 1.
    int dark = 0;
    for (int y = 0; y < 800; ++y)
        for (int x = 0; x < 800; ++x) {
            if (!is_dark(picture::pixel(p.image, x, y))) continue;
            ++dark;
            const picture::Point2 at = p.view.to_plane({x + 0.5, y + 0.5});
            EXPECT_NEAR(std::hypot(at.x - 1, at.y - 2), 1, 0.01 + 2 * p.view.pixel);
        }
    const double around = 2 * M_PI / p.view.pixel;
    EXPECT_GT(dark, 0.8 * around);
    EXPECT_LT(dark, 3 * around);
}

TEST(Plot, ContoursLieAtTheirLevels) {
    // On a convex mesh ε₁ may be 0; a torus has all three levels.
    const ThinShell shell = build_at(zoo::torus(1, 0.4, 48, 24), 5);
    ASSERT_LT(shell.info().epsilon_inner, 0);
    const picture::Plane plane = middle_plane(shell.mesh(), picture::axis_plane(2));
    const picture::View near = picture::make_view({0, 0, 600, 600}, {0.6, 0}, 0.3);
    Image image{600, 600, std::vector<std::uint8_t>(3 * 600 * 600, 255)};
    picture::plot(image, shell, plane, {}, {}, near, {.range = 1, .contour_width = 3}, picture::DivergingMap());
    const std::pair<double, picture::Rgb> levels[] = {{shell.info().epsilon_inner, picture::inner_colour},
                                                      {0, picture::zero_colour},
                                                      {shell.info().epsilon_outer, picture::outer_colour}};
    int found[3] = {};
    for (int y = 0; y < 600; ++y)
        for (int x = 0; x < 600; ++x)
            for (int i = 0; i < 3; ++i) {
                if (picture::pixel(image, x, y) != levels[i].second) continue;
                ++found[i];
                const double f = shell.value(plane.lift(near.to_plane({x + 0.5, y + 0.5})));
                EXPECT_NEAR(f, levels[i].first, 3 * near.pixel);
            }
    for (const int n : found) EXPECT_GT(n, 300);
}

TEST(Plot, BandCoverageIsTheShareOfThePixel) {
    EXPECT_EQ(picture::band_coverage(0, 1, -10, 10), 1);
    EXPECT_EQ(picture::band_coverage(5, 1, -1, 1), 0);
    EXPECT_EQ(picture::band_coverage(1, 1, -1, 1), 0.5);
    EXPECT_DOUBLE_EQ(picture::band_coverage(0, 1, -0.05, 0.05), 0.1);
}

TEST(Section, IsExactAndClosed) {
    const Mesh mesh = zoo::box({0, 0, 0}, {2, 4, 8});
    for (const double at : {0.0, 0.25, 0.5, 1.0}) {  // the box's faces, too
        const std::vector<picture::Segment> section =
            picture::mesh_section(mesh, middle_plane(mesh, picture::axis_plane(2), at), 4);
        double length = 0;
        for (const picture::Segment& s : section) {
            for (const picture::Point2& p : {s.a, s.b}) {
                const bool on_side = ((p.x == 0 || p.x == 2) && p.y >= 0 && p.y <= 4) ||
                                     ((p.y == 0 || p.y == 4) && p.x >= 0 && p.x <= 2);
                EXPECT_TRUE(on_side) << p.x << " " << p.y;
            }
            length += std::hypot(s.b.x - s.a.x, s.b.y - s.a.y);
        }
        EXPECT_DOUBLE_EQ(length, 12) << at;
    }
}

double polygon_area(const picture::CellSection& c) {
    double twice = 0;
    for (int i = 0; i < c.corners; ++i) {
        const picture::Point2 &a = c.corner[std::size_t(i)], &b = c.corner[std::size_t((i + 1) % c.corners)];
        twice += (a.x - c.corner[0].x) * (b.y - c.corner[0].y) - (b.x - c.corner[0].x) * (a.y - c.corner[0].y);
    }
    return 0.5 * twice;
}

TEST(Section, LeafCellsTileThePlane) {
    const ThinShell& shell = sphere_shell();
    double area = 0;
    for (const picture::CellSection& c : picture::cell_section(
             shell::Access::data(shell), middle_plane(shell.mesh(), picture::axis_plane(1), 0.3))) {
        EXPECT_EQ(c.corners, 4);
        EXPECT_DOUBLE_EQ(polygon_area(c), c.width * c.width);
        area += polygon_area(c);
    }
    const double side = 2 * shell.info().scale;
    EXPECT_DOUBLE_EQ(area, side * side);
}

TEST(Section, LeafCellsTileAnObliquePlane) {
    // Through the centre of a cube of side a and across its diagonal: a regular hexagon of side a/√2.
    const ThinShell& shell = sphere_shell();
    double area = 0;
    int most = 0;
    for (const picture::CellSection& c : picture::cell_section(
             shell::Access::data(shell), middle_plane(shell.mesh(), picture::normal_plane({1, 1, 1})))) {
        area += polygon_area(c);
        most = std::max(most, c.corners);
    }
    const double side = 2 * shell.info().scale;
    EXPECT_NEAR(area, 0.75 * std::sqrt(3.0) * side * side,
                1e-3 * side * side);  // the box is not quite the root's
    EXPECT_EQ(most, 6);
}

TEST(Section, ObliquePlanesHaveOrthonormalAxes) {
    for (const Vec3& n : {Vec3{1, 2, 3}, {-1e200, 1e200, 3e199}, {0, 0, -5}, {1e-300, 0, 0}, {0, -2, 0}}) {
        const picture::Plane p = picture::normal_plane(n);
        for (const Vec3& v : {p.normal, p.right, p.up}) EXPECT_NEAR(norm(v), 1, 1e-15);
        EXPECT_NEAR(dot(p.right, p.normal), 0, 1e-15);
        EXPECT_NEAR(dot(p.up, p.normal), 0, 1e-15);
        EXPECT_EQ(p.right.z, 0);
        EXPECT_GE(p.up.z, 0);
        const Vec3 handed = cross(p.right, p.up);  // the normal points at the viewer
        EXPECT_NEAR(dot(handed, p.normal), 1, 1e-15);
    }
}

TEST(Section, NormalsAlongAnAxisGiveItsPlane) {
    for (const int axis : {0, 2}) {
        Vec3 normal;
        normal[axis] = 5;
        const picture::Plane a = picture::axis_plane(axis), b = picture::normal_plane(normal);
        EXPECT_EQ(a.normal, b.normal);
        EXPECT_EQ(a.right, b.right);
        EXPECT_EQ(a.up, b.up);
    }
}

TEST(Section, ObliqueSectionOfABall) {
    // Every corner lies on the ball's edges: at distance ≤ 1 from its centre, and on the plane.
    const Mesh ball = zoo::sphere({1, 2, 3}, 1, 4);
    picture::Plane plane = picture::normal_plane({3, -1, 2});
    plane.offset = plane.height({1, 2, 3}) + 0.6;
    const picture::Point2 centre = plane.project({1, 2, 3});
    const std::vector<picture::Segment> section = picture::mesh_section(ball, plane, 0);
    double length = 0;
    for (const picture::Segment& s : section) {
        EXPECT_NEAR(std::hypot(s.a.x - centre.x, s.a.y - centre.y), 0.8, 0.01);
        length += std::hypot(s.b.x - s.a.x, s.b.y - s.a.y);
    }
    EXPECT_NEAR(length, 2 * M_PI * 0.8, 0.02);
}

TEST(Colour, DivergesEvenly) {
    const picture::DivergingMap map;
    EXPECT_TRUE(is_blue(map(-1)));
    EXPECT_TRUE(is_red(map(1)));
    EXPECT_GT(std::min({map(0)[0], map(0)[1], map(0)[2]}), 240);
    EXPECT_EQ(map(-5), map(-1));
    EXPECT_EQ(map(5), map(1));
    EXPECT_EQ(map(std::numeric_limits<double>::quiet_NaN()), (picture::Rgb{128, 128, 128}));
    const auto luma = [](const picture::Rgb& c) { return 0.2126 * c[0] + 0.7152 * c[1] + 0.0722 * c[2]; };
    for (double t = 0; t < 1; t += 0.01) {  // each arm gets darker all the way, both about equally
        EXPECT_GE(luma(map(t)), luma(map(t + 0.01)));
        EXPECT_GE(luma(map(-t)), luma(map(-t - 0.01)));
        EXPECT_NEAR(luma(map(t)), luma(map(-t)), 26);
    }
}

TEST(Text, Numbers) {
    EXPECT_EQ(display::number_text(0), "0");
    EXPECT_EQ(display::number_text(-0.00123456), "−0.001235");
    EXPECT_EQ(display::number_text(12.5, 2), "12");
    EXPECT_EQ(display::number_text(-1.25e-7, 3), "−1.25·10⁻⁷");
    EXPECT_EQ(display::number_text(9.9999e9, 3), "1.00·10¹⁰");
    EXPECT_EQ(display::count_text(7), "7");
    EXPECT_EQ(display::count_text(1234567), "1,234,567");
}

TEST(Text, IsSetWhereAsked) {
    Image image{200, 60, std::vector<std::uint8_t>(3 * 200 * 60, 255)};
    picture::Typesetter type;
    type.write(image, "εₖ₁ Hxg", {100, 40}, 20, picture::ink, picture::Weight::regular, picture::Align::centre);
    int left = 200, right = -1;
    for (int y = 0; y < 60; ++y)
        for (int x = 0; x < 200; ++x)
            if (is_dark(picture::pixel(image, x, y))) left = std::min(left, x), right = std::max(right, x);
    const double width = type.width("εₖ₁ Hxg", 20);
    EXPECT_NEAR(left, 100 - width / 2, 3);
    EXPECT_NEAR(right, 100 + width / 2, 3);
    EXPECT_GT(type.width("WWW", 20), type.width("iii", 20));
}

TEST(Slice, RefusesOptionsOutOfRange) {
    const ThinShell& shell = sphere_shell();
    EXPECT_THROW(slice(shell, {.axis = 3}), OptionError);
    EXPECT_THROW(slice(shell, {.axis = -1}), OptionError);
    EXPECT_THROW(slice(shell, {.at = 1.01}), OptionError);
    EXPECT_THROW(slice(shell, {.at = std::numeric_limits<double>::quiet_NaN()}), OptionError);
    EXPECT_THROW(slice(shell, {.size = 63}), OptionError);
    EXPECT_THROW(slice(shell, {.size = 8193}), OptionError);
    EXPECT_THROW(slice(shell, {.run = {.threads = -1}}), OptionError);
    EXPECT_THROW(slice(shell, {.normal = Vec3{}}), OptionError);
    EXPECT_THROW(slice(shell, {.normal = Vec3{0, NAN, 1}}), OptionError);
    EXPECT_THROW(slice(shell, {.through = Vec3{INFINITY, 0, 1}}), OptionError);
    const Mesh none, wild{{{0, 0, 0}}, {{0, 0, 1}}}, endless{{{0, 0, 0}, {1, 0, 0}, {0, NAN, 0}}, {{0, 1, 2}}};
    for (const Mesh& mesh : {none, wild, endless}) EXPECT_THROW(slice(shell, {.mesh = mesh}), InputError);
}

TEST(Slice, DrawsTheSectionOfAnotherMesh) {
    const Mesh small = zoo::sphere({1, 2, 3}, 0.5, 4);
    const Image own = slice(sphere_shell(), {.size = 300});
    const Image other = slice(sphere_shell(), {.mesh = small, .size = 300});
    const auto dark_in_the_middle = [](const Image& image) {
        int dark = 0;
        for (int y = image.height / 2 - 70; y < image.height / 2 + 70; ++y)
            for (int x = 127; x < 267; ++x) dark += is_dark(picture::pixel(image, x, y));
        return dark;
    };
    EXPECT_LT(dark_in_the_middle(own), 10);
    EXPECT_GT(dark_in_the_middle(other), 200);
    EXPECT_EQ(own.rgb.size(), other.rgb.size());
}

TEST(Slice, SameBytesForAnyNumberOfThreads) {
    const Image one = slice(sphere_shell(), {.size = 300, .cells = true, .run = {.threads = 1}});
    const Image two = slice(sphere_shell(), {.size = 300, .cells = true, .run = {.threads = 2}});
    EXPECT_EQ(one.width, two.width);
    EXPECT_EQ(one.rgb, two.rgb);
}

TEST(Slice, DrawsEveryKindOfMesh) {
    for (const zoo::Entry& entry : zoo::all()) {
        for (const int depth : {0, 4}) {
            const ThinShell shell = build_at(entry.mesh, depth);
            for (const double at : {0.0, 0.37, 1.0}) {
                const Image image = slice(shell, {.axis = depth % 3, .at = at, .size = 64, .cells = true});
                EXPECT_EQ(image.rgb.size(), 3 * std::size_t(image.width) * std::size_t(image.height))
                    << entry.name;
                EXPECT_LT(image.width, 700);
                EXPECT_LT(image.height, 700);
            }
        }
    }
}

class Png : public testing::Test {
protected:
    fs::path path_ = fs::temp_directory_path() / fmt::format("its-picture-{}.png", ::getpid());
    void TearDown() override { fs::remove(path_); }
};

TEST_F(Png, DecodesToTheSamePixels) {
    const Image image = slice(sphere_shell(), {.size = 128});
    write_png(image, path_);
    png_image header{};
    header.version = PNG_IMAGE_VERSION;
    ASSERT_TRUE(png_image_begin_read_from_file(&header, path_.c_str()));
    header.format = PNG_FORMAT_RGB;
    std::vector<std::uint8_t> decoded(PNG_IMAGE_SIZE(header));
    ASSERT_TRUE(png_image_finish_read(&header, nullptr, decoded.data(), 0, nullptr));
    EXPECT_EQ(int(header.width), image.width);
    EXPECT_EQ(int(header.height), image.height);
    EXPECT_EQ(decoded, image.rgb);
}

TEST_F(Png, RefusesWhatItCannotWrite) {
    const Image image{2, 2, std::vector<std::uint8_t>(12)};
    EXPECT_THROW(write_png({2, 2, std::vector<std::uint8_t>(11)}, path_), OptionError);
    EXPECT_THROW(write_png({0, 0, {}}, path_), OptionError);
    EXPECT_THROW(write_png({-2, -2, std::vector<std::uint8_t>(12)}, path_), OptionError);
    EXPECT_FALSE(fs::exists(path_));
    EXPECT_THROW(write_png(image, "/nowhere/at/all.png"), FileError);
    EXPECT_THROW(write_png(image, "/dev/full"), FileError);
    write_png(image, path_);
    EXPECT_TRUE(fs::exists(path_));
}

}  // namespace
}  // namespace its
