#include <fmt/format.h>
#include <gtest/gtest.h>
#include <algorithm>
#include <cmath>
#include <filesystem>
#include <memory>
#include <numeric>
#include <optional>
#include <set>

#include "its/inspect.h"
#include "its/mesh_file.h"
#include "its/verify.h"
#include "shell/access.h"
#include "shell/shell_data.h"
#include "support/edit.h"
#include "support/zoo.h"
#include "verify/checks.h"

namespace its {
namespace {

using test::edit;

VerifyOptions quick() {
    VerifyOptions options;
    options.samples = 20'000;
    options.grid_samples = 300;
    return options;
}

std::string failures(const VerifyReport& report) {
    std::string text;
    for (const VerifyCheck& c : report.checks)
        if (!c.passed)
            text += fmt::format("{}: {} violations, worst {}: {}\n", c.name, c.violations, c.worst, c.detail);
    return text;
}

std::set<std::string> failed(const VerifyReport& report) {
    std::set<std::string> names;
    for (const VerifyCheck& c : report.checks)
        if (!c.passed) names.insert(c.name);
    return names;
}

bool fails(const VerifyReport& report, const std::string& name) {
    EXPECT_FALSE(report.passed());
    return failed(report).contains(name);
}

BuildOptions at_depth(int depth) {
    BuildOptions options;
    options.depth = depth;
    return options;
}

ThinShell shell_of(const shell::ShellData& data) {
    return shell::Access::make(data);
}

/// A shell to tamper with.
struct Tampered {
    Mesh mesh;
    shell::ShellData data;

    explicit Tampered(int depth = 4, const Mesh& of = zoo::torus(1.0, 0.35, 24, 12))
        : mesh(of), data(shell::Access::data(build(of, at_depth(depth)))) {}

    VerifyReport report(VerifyOptions options = quick()) const { return verify(shell_of(data), mesh, options); }

    void set_outer(double epsilon) {
        data.epsilon_outer = epsilon;
        data.info.epsilon_outer = epsilon * data.lattice.width;
    }

    /// Cell and group of a surface cell.
    octree::Cell surface_cell(std::uint64_t wanted, std::uint64_t& group, int& child) const {
        const octree::Level& level = data.octree.levels[0];
        std::uint64_t count = 0;
        for (group = 0;; ++group)
            for (child = 0; child < 8; ++child)
                if (level.mask[group] >> child & 1 && count++ == wanted)
                    return octree::morton_decode(level.parent[group] << 3 | unsigned(child));
    }

    /// Takes a surface cell out of all arrays, so that only coverage is broken.
    void remove_surface_cell(std::uint64_t s) {
        std::uint64_t group = 0;
        int child = 0;
        surface_cell(s, group, child);
        octree::Level& level = data.octree.levels[0];
        shell::SurfaceCells& surface = data.surface;
        shell::CellLists lists = shell::unpack_lists(level, surface.lists, data.mesh.triangles.size());
        const auto erase = [](auto& from, std::uint64_t begin, std::uint64_t end) {
            from.erase(from.begin() + std::ptrdiff_t(begin), from.begin() + std::ptrdiff_t(end));
        };
        const std::uint64_t count = lists.offset[s + 1] - lists.offset[s];
        erase(lists.triangle, lists.offset[s], lists.offset[s + 1]);
        erase(lists.offset, s, s + 1);
        for (std::uint64_t c = s; c < lists.offset.size(); ++c) lists.offset[c] -= count;
        erase(*edit(surface.lower), s, s + 1);
        erase(*edit(surface.upper), s, s + 1);
        edit(level.mask)[group] &= std::uint8_t(~(1u << child));
        level = {level.parent, level.mask};
        surface.lists = shell::pack_lists(level, lists.offset, lists.triangle);
        --data.info.surface_cells;
    }

    void negate() {
        for (auto& level : data.field.values) {
            auto values = edit(level);
            for (double& value : *values) value = -value;
        }
    }

    /// Applies fn to the stored value of a grid point in every group that has it.
    template <class F>
    void change_value(int level, const octree::Cell& at, F&& fn) {
        auto values = edit(data.field.values[level]);
        for (std::uint64_t g = 0; g < data.octree.levels[level].groups(); ++g) {
            const octree::Cell parent = octree::morton_decode(data.octree.levels[level].parent[g]);
            int index = 0, stride = 1;
            bool inside = true;
            for (int axis = 0; axis < 3; ++axis, stride *= 3) {
                const std::int64_t p = std::int64_t(at[axis]) - 2 * std::int64_t(parent[axis]);
                inside = inside && p >= 0 && p <= 2;
                index += stride * int(p);
            }
            if (inside) fn(values[octree::group_points * g + std::uint64_t(index)]);
        }
    }
};

TEST(Verify, GoodShellsPass) {
    for (const zoo::Entry& entry : zoo::all()) {
        const VerifyReport report = verify(build(entry.mesh, at_depth(4)), entry.mesh, quick());
        EXPECT_TRUE(report.passed()) << entry.name << "\n" << failures(report);
        EXPECT_GE(report.checks.size(), 10u);
        EXPECT_LE(report.proven_min, report.sampled_min) << entry.name;
        EXPECT_GE(report.proven_max, report.sampled_max) << entry.name;
    }
}

TEST(Verify, GoodShellsPassAtAllSmallDepths) {
    const Mesh aligned = zoo::box({0, 0, 0}, {1, 0.5, 0.25});  // faces in lattice planes
    for (int depth = 0; depth <= 6; ++depth) {
        for (const Mesh& mesh : {aligned, zoo::soup(20, 7)}) {
            const VerifyReport report = verify(build(mesh, at_depth(depth)), mesh, quick());
            EXPECT_TRUE(report.passed()) << "depth " << depth << "\n" << failures(report);
        }
    }
}

TEST(Verify, GoodShellsOfRealMeshesPass) {
    const std::set<std::string> wanted = {"fandisk.obj", "far_bunny_1e6.obj", "thin_plate_1e-4.obj",
                                          "cycloidal.ply"};
    for (const std::string& path : zoo::real_mesh_files()) {
        if (!wanted.contains(std::filesystem::path(path).filename().string())) continue;
        const Mesh mesh = read_mesh(path).mesh;
        const VerifyReport report = verify(build(mesh, at_depth(6)), mesh, quick());
        EXPECT_TRUE(report.passed()) << path << "\n" << failures(report);
    }
}

TEST(Verify, TheTamperingHelpersAreHarmlessByThemselves) {
    Tampered t;
    t.set_outer(t.data.epsilon_outer);
    EXPECT_TRUE(t.report().passed()) << failures(t.report());
}

TEST(Verify, EpsilonTooSmall) {
    Tampered t;
    t.set_outer(t.data.epsilon_outer - 1e-5);
    EXPECT_TRUE(fails(t.report(), "G1 containment, proven"));
    EXPECT_EQ(failed(t.report()).count("G2 tightness"), 0u);
}

TEST(Verify, InnerEpsilonTooSmall) {
    Tampered t;
    t.data.epsilon_inner += 1e-5;
    t.data.info.epsilon_inner = t.data.epsilon_inner * t.data.lattice.width;
    EXPECT_TRUE(fails(t.report(), "G1 containment, proven"));
}

TEST(Verify, EpsilonMuchTooSmallIsSeenBySamples) {
    Tampered t;
    t.set_outer(t.data.epsilon_outer * 0.5);
    EXPECT_TRUE(fails(t.report(), "G1 containment, sampled"));
}

TEST(Verify, EpsilonLoose) {
    Tampered t;
    t.set_outer(t.data.epsilon_outer + 1e-5);
    EXPECT_EQ(failed(t.report()), std::set<std::string>{"G2 tightness"});
}

TEST(Verify, EpsilonLooseByLessThanPromisedPasses) {
    Tampered t;
    t.set_outer(t.data.epsilon_outer + 5e-7);
    EXPECT_TRUE(t.report().passed()) << failures(t.report());
}

TEST(Verify, InfoDiffersFromArrays) {
    Tampered t;
    t.data.info.epsilon_outer *= 1.001;
    EXPECT_TRUE(fails(t.report(), "structure"));
}

TEST(Verify, SurfaceCellMissing) {
    for (const std::uint64_t cell : {0, 17, 300}) {
        Tampered t;
        t.remove_surface_cell(cell);
        EXPECT_TRUE(fails(t.report(), "G1 coverage")) << cell;
    }
}

TEST(Verify, CellTouchedOnlyInAPlaneIsMissing) {
    // A face of the box lies in a lattice plane: the cells on its outer side meet it in that face only.
    Tampered t(3, zoo::box({0, 0, 0}, {1, 0.5, 0.25}));
    const double top = t.data.lattice.to_lattice({0, 0, 0.25}).z;
    ASSERT_EQ(top, std::floor(top));
    std::uint64_t group = 0;
    int child = 0;
    std::uint64_t s = 0;
    while (t.surface_cell(s, group, child)[2] != std::uint32_t(top)) ++s;
    t.remove_surface_cell(s);
    EXPECT_TRUE(fails(t.report(), "G1 coverage"));
}

TEST(Verify, CornerValueMovedInOneGroup) {
    Tampered t;
    for (const int corner : {0, 1, 4, 12, 14, 26}) {  // 13, the middle of a group, is in no other
        Tampered u = t;
        std::uint64_t group = 0;
        int child = 0;
        u.surface_cell(100, group, child);
        edit(u.data.field.values[0])[octree::group_points * group + std::uint64_t(corner)] += 1e-3;
        const std::set<std::string> names = failed(u.report());
        EXPECT_FALSE(names.empty()) << corner;
    }
}

TEST(Verify, CornerValueMovedEverywhere) {
    Tampered t;
    std::uint64_t group = 0;
    int child = 0;
    const octree::Cell cell = t.surface_cell(100, group, child);
    for (int corner = 0; corner < 8; ++corner)
        t.change_value(0, {cell[0] + (corner & 1), cell[1] + (corner >> 1 & 1), cell[2] + (corner >> 2)},
                       [](double& value) { value += 1e-3; });
    const VerifyReport report = t.report();
    EXPECT_EQ(failed(report).count("structure"), 0u);
    EXPECT_TRUE(fails(report, "local bounds, proven"));
    VerifyOptions all = quick();
    all.grid_samples = 20'000;
    EXPECT_TRUE(fails(t.report(all), "G3 distances"));
}

TEST(Verify, LocalBoundsTooTight) {
    Tampered t;
    const std::uint64_t cell = 123;
    const shell::SurfaceCells& cells = t.data.surface;
    edit(t.data.surface.upper)[cell] =
        std::midpoint(cells.lower[cell], std::midpoint(cells.lower[cell], cells.upper[cell]));
    EXPECT_TRUE(fails(t.report(), "local bounds, proven"));
    {
        auto upper = edit(t.data.surface.upper), lower = edit(t.data.surface.lower);
        for (std::uint64_t c = 0; c < upper->size(); ++c)
            upper[c] -= 1e-3f, lower[c] = std::min(lower[c], upper[c]);
    }
    EXPECT_TRUE(fails(t.report(), "local bounds, sampled"));
}

TEST(Verify, SignFlipped) {
    Tampered t(2);
    const octree::Cell at = {4, 4, 4};  // the centre of the bounds: outside, in the hole of the torus
    t.change_value(0, at, [](double& value) {
        ASSERT_GT(value, 0.1);
        value = -value;
    });
    VerifyOptions options = quick();
    options.grid_samples = 20'000;  // far more than there are grid points
    const VerifyReport report = t.report(options);
    EXPECT_TRUE(fails(report, "G3 signs"));
    EXPECT_EQ(failed(report).count("G3 distances"), 0u);
}

TEST(Verify, InsideOutIsSeen) {
    Tampered t;
    t.negate();
    EXPECT_TRUE(fails(t.report(), "G3 signs"));
}

TEST(Verify, NegativeValueOfAnUnsignedField) {
    Tampered t(3, zoo::soup(20, 3));
    ASSERT_EQ(t.data.info.sign, SignRule::unsigned_rule);
    t.negate();
    EXPECT_TRUE(fails(t.report(), "G3 signs"));
}

TEST(Verify, SidesOfCellsFlipped) {
    for (const std::size_t level : {0, 1, 3}) {
        Tampered t;
        edit(t.data.sides.inside[level])[0] ^= 4;
        EXPECT_EQ(failed(t.report()), std::set<std::string>{"G3 sides of cells"});
    }
    Tampered t;
    for (auto& level : t.data.sides.inside) {
        auto bits = edit(level);
        for (std::uint8_t& byte : *bits) byte = std::uint8_t(~byte);
    }
    EXPECT_EQ(failed(t.report()), std::set<std::string>{"G3 sides of cells"});
}

TEST(Verify, CopyOfTheMeshMoved) {
    Tampered t;
    edit(t.data.mesh.vertices)[7].y += 1e-12;
    EXPECT_TRUE(fails(t.report(), "copy of the mesh"));
    Tampered u;
    edit(u.data.mesh.triangles)[7][0] ^= 1;
    EXPECT_TRUE(fails(u.report(), "copy of the mesh"));
    Tampered v;
    {
        auto triangles = edit(v.data.mesh.triangles);
        std::swap(triangles[9][1], triangles[9][2]);
    }
    EXPECT_TRUE(fails(v.report(), "copy of the mesh"));
    EXPECT_TRUE(fails(v.report(), "description"));  // the edges do not cancel any more
}

TEST(Verify, OneValueChangedByOnePercentIsSeenByACompleteCheck) {
    Tampered t;
    t.change_value(1, {5, 9, 7}, [](double& value) { value *= 1.01; });
    VerifyOptions options = quick();
    options.complete = true;
    EXPECT_EQ(failed(t.report(options)), std::set<std::string>{"G3 distances"});
}

TEST(Verify, TellsWhatIsASample) {
    const Tampered t;
    VerifyOptions options = quick();
    options.grid_samples = 100;
    const auto distances = [&] {
        for (const VerifyCheck& check : t.report(options).checks)
            if (check.name == "G3 distances") return check;
        return VerifyCheck{};
    };
    const VerifyCheck some = distances();
    EXPECT_FALSE(some.complete);
    EXPECT_EQ(some.tested, 100u);
    EXPECT_NE(some.detail.find("with probability"), std::string::npos);
    options.complete = true;
    const VerifyCheck all = distances();
    EXPECT_TRUE(all.complete);
    EXPECT_EQ(all.tested, shell_of(t.data).grid_points());
}

TEST(Verify, WorstOfAFailedLocalBoundIsByHowMuch) {
    Tampered t;
    const Array<float>&lower = t.data.surface.lower, &upper = t.data.surface.upper;
    std::uint64_t cell = 0;
    for (std::uint64_t c = 0; c < upper.size(); ++c)
        if (upper[c] - lower[c] > upper[cell] - lower[cell]) cell = c;
    // The bound's own slack (rounding to single precision, the hull) is below a thousandth here.
    edit(t.data.surface.upper)[cell] -= 0.01f;
    bool seen = false;
    for (const VerifyCheck& check : t.report().checks) {
        if (check.name != "local bounds, proven") continue;
        seen = true;
        EXPECT_FALSE(check.passed);
        EXPECT_NEAR(check.worst, -0.01 * t.data.lattice.width, 1e-3 * t.data.lattice.width) << check.detail;
    }
    EXPECT_TRUE(seen);
}

TEST(Verify, TheAxisThatIsUpIsPartOfTheInputHash) {
    Tampered t;
    BuildOptions options = at_depth(4);
    options.up = UpAxis::z;
    EXPECT_NE(input_hash(t.mesh, options), input_hash(t.mesh, at_depth(4)));
    VerifyOptions complete = quick();
    complete.complete = true;
    const ThinShell shell = build(t.mesh, options);
    EXPECT_EQ(shell.info().up, UpAxis::z);
    EXPECT_TRUE(verify(shell, t.mesh, complete).passed());
    t.data = shell::Access::data(shell);
    t.data.info.up = UpAxis::y;
    EXPECT_EQ(failed(t.report(complete)), std::set<std::string>{"input hash"});
}

TEST(Verify, InputHashOfOtherOptions) {
    Tampered t;
    t.data.info.extrema = Extrema::candidates;
    VerifyOptions options = quick();
    EXPECT_TRUE(t.report(options).passed());
    options.complete = true;
    EXPECT_EQ(failed(t.report(options)), std::set<std::string>{"input hash"});
    BuildOptions limited;
    limited.max_memory = 1'000'000'000;
    const ThinShell shell = build(t.mesh, limited);
    EXPECT_TRUE(verify(shell, t.mesh, options).passed());
}

TEST(Verify, TriangleInTheListOfACellThatItDoesNotMeet) {
    Tampered t;
    const octree::Level& level = t.data.octree.levels[0];
    shell::CellLists lists = shell::unpack_lists(level, t.data.surface.lists, t.data.mesh.triangles.size());
    const std::uint64_t cell = 200, end = lists.offset[cell + 1];
    const std::uint32_t last = lists.triangle[end - 1];
    ASSERT_LT(last + 100, t.data.mesh.triangles.size());
    lists.triangle.insert(lists.triangle.begin() + std::ptrdiff_t(end), last + 100);
    for (std::uint64_t c = cell + 1; c < lists.offset.size(); ++c) ++lists.offset[c];
    const std::uint64_t before = t.data.surface.lists.bytes.size();
    t.data.surface.lists = shell::pack_lists(level, lists.offset, lists.triangle);
    t.data.info.memory_bytes += t.data.surface.lists.bytes.size() - before;
    EXPECT_EQ(failed(t.report()), std::set<std::string>{"G3 triangle lists"});
}

TEST(Verify, AllRulesPassACompleteCheck) {
    VerifyOptions options = quick();
    options.samples = 1000;
    options.complete = true;
    for (const zoo::Entry& entry : zoo::all())
        for (const SignRule rule :
             {SignRule::winding, SignRule::generalized, SignRule::unsigned_rule, SignRule::even_odd}) {
            BuildOptions asked = at_depth(3);
            asked.sign = rule;
            std::optional<ThinShell> shell;
            try {
                shell = build(entry.mesh, asked);
            } catch (const OptionError&) {
                continue;  // the mesh cannot have this rule
            }
            const VerifyReport report = verify(*shell, entry.mesh, options);
            EXPECT_TRUE(report.passed()) << entry.name << " " << name(rule) << "\n" << failures(report);
        }
}

TEST(Verify, TriangleMissingInAList) {
    Tampered t;
    const std::uint64_t cell = 200;
    const octree::Level& level = t.data.octree.levels[0];
    shell::CellLists lists = shell::unpack_lists(level, t.data.surface.lists, t.data.mesh.triangles.size());
    lists.triangle.erase(lists.triangle.begin() + std::ptrdiff_t(lists.offset[cell]));
    for (std::uint64_t c = cell + 1; c < lists.offset.size(); ++c) --lists.offset[c];
    const std::uint64_t before = t.data.surface.lists.bytes.size();
    t.data.surface.lists = shell::pack_lists(level, lists.offset, lists.triangle);
    t.data.info.memory_bytes -= before - t.data.surface.lists.bytes.size();
    EXPECT_EQ(failed(t.report()), std::set<std::string>{"G3 triangle lists"});
}

TEST(Verify, MeshWithATriangleMoved) {
    Tampered t;
    t.mesh.vertices[5].z += 1.5 * t.data.lattice.width;
    const std::set<std::string> names = failed(t.report());
    EXPECT_TRUE(names.contains("G1 coverage"));
    EXPECT_TRUE(names.contains("G1 containment, proven"));
    EXPECT_TRUE(names.contains("G1 containment, sampled"));
}

TEST(Verify, MeshMovedByAMillionthOfACell) {
    Tampered t;
    for (Vec3& v : t.mesh.vertices) v.x += 3e-6 * t.data.lattice.width;
    EXPECT_TRUE(fails(t.report(), "local bounds, proven"));
}

TEST(Verify, WrongShippedEvaluation) {
    const Tampered t;
    const ThinShell shell = shell_of(t.data);
    const double w = t.data.lattice.width;
    const auto off = [&](const Vec3& p) { return shell.value(p) + 1e-9 * w; };
    EXPECT_TRUE(fails(verifier::judge(t.data, off, t.mesh, quick()), "G1 evaluation"));
    const auto nan = [&](const Vec3& p) { return p == t.mesh.vertices[3] ? std::nan("") : shell.value(p); };
    const VerifyReport report = verifier::judge(t.data, nan, t.mesh, quick());
    EXPECT_TRUE(fails(report, "G1 containment, sampled"));
    const auto far = [&](const Vec3& p) { return shell.value(p) + (std::abs(p.z) > 0.6 ? 1e-6 * w : 0.0); };
    EXPECT_EQ(failed(verifier::judge(t.data, far, t.mesh, quick())),
              std::set<std::string>{"evaluation in space"});
}

TEST(Verify, BrokenArraysAreNotRead) {
    const Tampered good(3);
    const auto only_structure = [&](auto&& tamper) {
        Tampered t = good;
        tamper(t.data);
        const VerifyReport report = t.report();
        EXPECT_EQ(report.checks.size(), 1u);
        return fails(report, "structure");
    };
    EXPECT_TRUE(only_structure([](shell::ShellData& d) { edit(d.octree.levels[0].mask)[3] ^= 1; }));
    EXPECT_TRUE(only_structure([](shell::ShellData& d) { edit(d.octree.levels[1].mask)[0] ^= 128; }));
    EXPECT_TRUE(
        only_structure([](shell::ShellData& d) { std::ranges::reverse(*edit(d.octree.levels[0].parent)); }));
    EXPECT_TRUE(only_structure([](shell::ShellData& d) { edit(d.octree.levels[0].parent)->back() += 1; }));
    EXPECT_TRUE(only_structure([](shell::ShellData& d) { edit(d.octree.levels.back().parent)[0] = 1; }));
    EXPECT_TRUE(only_structure([](shell::ShellData& d) { d.octree.levels.pop_back(); }));
    EXPECT_TRUE(only_structure([](shell::ShellData& d) { d.octree.depth = 40; }));
    EXPECT_TRUE(only_structure([](shell::ShellData& d) { edit(d.field.values[1])->pop_back(); }));
    EXPECT_TRUE(only_structure([](shell::ShellData& d) { edit(d.field.values[2])[7] = std::nan(""); }));
    EXPECT_TRUE(only_structure([](shell::ShellData& d) { edit(d.surface.lists.offset)[4] = 1'000'000; }));
    EXPECT_TRUE(only_structure([](shell::ShellData& d) { edit(d.surface.lists.bytes)[0] = 255; }));
    EXPECT_TRUE(only_structure([](shell::ShellData& d) { edit(d.surface.lower)->pop_back(); }));
    EXPECT_TRUE(only_structure([](shell::ShellData& d) { std::swap(d.surface.lower, d.surface.upper); }));
}

TEST(Verify, NumbersOfTheShell) {
    Tampered t(3);
    t.data.epsilon_inner = 1e-3;
    EXPECT_TRUE(fails(t.report(), "structure"));
}

TEST(Verify, RefusesUnusableMeshes) {
    const Tampered t(3);
    const ThinShell shell = shell_of(t.data);
    EXPECT_THROW(verify(shell, Mesh{}, quick()), InputError);
    Mesh far = t.mesh;
    far.vertices[0].x += 100;
    EXPECT_THROW(verify(shell, far, quick()), InputError);
    Mesh bad = t.mesh;
    bad.triangles[0][1] = 1'000'000;
    EXPECT_THROW(verify(shell, bad, quick()), InputError);
    Mesh nan = t.mesh;
    nan.vertices[1].y = std::nan("");
    EXPECT_THROW(verify(shell, nan, quick()), InputError);
    VerifyOptions options = quick();
    options.run.threads = -1;
    EXPECT_THROW(verify(shell, t.mesh, options), OptionError);
}

TEST(Verify, CanBeStoppedInEveryStage) {
    const Tampered t(3);
    std::set<std::string> stages;
    VerifyOptions options = quick();
    options.run.progress = [&](std::string_view stage, double fraction) {
        EXPECT_GE(fraction, 0.0);
        EXPECT_LE(fraction, 1.0);
        stages.insert(std::string(stage));
        return true;
    };
    EXPECT_TRUE(t.report(options).passed());
    EXPECT_GE(stages.size(), 6u);
    for (const std::string& stage : stages) {
        options.run.progress = [&](std::string_view name, double) { return name != stage; };
        EXPECT_THROW(t.report(options), Cancelled) << stage;
    }
}

TEST(Verify, AnyNumberOfSamplesTakesLittleMemory) {
    const Tampered t(3);
    VerifyOptions options = quick();
    options.samples = ~std::uint64_t{0};
    int calls = 0;
    options.run.progress = [&](std::string_view stage, double) {
        return stage != "verify: samples" || ++calls < 4;
    };
    EXPECT_THROW(t.report(options), Cancelled);
}

TEST(Verify, SameReportForAnyNumberOfThreads) {
    const Tampered t;
    VerifyOptions options = quick();
    options.run.threads = 1;
    const VerifyReport one = t.report(options);
    options.run.threads = 4;
    const VerifyReport four = t.report(options);
    ASSERT_EQ(one.checks.size(), four.checks.size());
    for (std::size_t i = 0; i < one.checks.size(); ++i) {
        EXPECT_EQ(one.checks[i].detail, four.checks[i].detail);
        EXPECT_EQ(one.checks[i].worst, four.checks[i].worst);
        EXPECT_EQ(one.checks[i].tested, four.checks[i].tested);
    }
    EXPECT_EQ(one.proven_max, four.proven_max);
    EXPECT_EQ(one.sampled_min, four.sampled_min);
}

/// A plate in a lattice plane within a box without one of its triangles: on the plate's far side the winding
/// number is just below ½, and passes ½ within a cell. Grid points on the plate count as displaced to that
/// side.
TEST(Verify, AHoleThatRunsAlongTheMeshIsNextToIt) {
    Mesh mesh = zoo::box({-1, -1, -1}, {1, 1, 1});
    mesh.triangles.pop_back();
    const auto n = std::uint32_t(mesh.vertices.size());
    for (const Vec3& v : {Vec3{0, -0.5, -0.5}, Vec3{0, 0.5, -0.5}, Vec3{0, 0.5, 0.5}, Vec3{0, -0.5, 0.5}})
        mesh.vertices.push_back(v);
    mesh.triangles.push_back({n, n + 1, n + 2});
    mesh.triangles.push_back({n, n + 2, n + 3});
    for (const int depth : {2, 3, 4, 5, 6}) {
        const ThinShell shell = build(mesh, {.depth = depth, .sign = SignRule::generalized});
        const VerifyReport report = verify(shell, mesh, {.samples = 1000});
        for (const VerifyCheck& check : report.checks)
            EXPECT_TRUE(check.passed) << depth << ' ' << check.name << ": " << check.detail;
    }
}

}  // namespace
}  // namespace its
