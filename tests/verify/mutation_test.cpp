#include <fmt/format.h>
#include <gtest/gtest.h>
#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>
#include <map>
#include <numbers>
#include <optional>
#include <string>
#include <vector>

#include "its/verify.h"
#include "shell/access.h"
#include "shell/shell_data.h"
#include "shell_file/format.h"
#include "shell_file/shell_file.h"
#include "support/tries.h"
#include "support/zoo.h"

// Every section of a shell's file is changed, one element at a time, so that something that the file says
// becomes false; the checksums are mended. Loading or a complete check must see each change.

namespace its {
namespace {

using Bytes = std::vector<std::byte>;

struct Subject {
    std::string name;
    Mesh mesh;
    BuildOptions options;
};

BuildOptions asked(int depth, SignRule rule) {
    BuildOptions options;
    options.depth = depth;
    options.sign = rule;
    return options;
}

BuildOptions to_thickness(double thickness, SignRule rule) {
    BuildOptions options;
    options.thickness = thickness;
    options.sign = rule;
    return options;
}

/// A sphere without the triangles above a height: an open mesh with an inside.
Mesh cup() {
    Mesh mesh = zoo::sphere({0.1, 0.2, 0.3}, 1, 2);
    std::erase_if(mesh.triangles, [&](const Triangle& t) {
        return mesh.vertices[t[0]].z + mesh.vertices[t[1]].z + mesh.vertices[t[2]].z > 3 * 0.9;
    });
    return mesh;
}

std::vector<Subject> subjects() {
    return {
        {"torus, winding", zoo::torus(1.0, 0.35, 12, 6), asked(3, SignRule::winding)},
        {"overlapping spheres, winding", zoo::overlapping_spheres(1), asked(2, SignRule::winding)},
        {"box, even-odd", zoo::box({0, 0, 0}, {1, 0.5, 0.25}), asked(2, SignRule::even_odd)},
        {"cup, generalized", cup(), asked(2, SignRule::generalized)},
        {"soup, unsigned", zoo::soup(12, 7), asked(2, SignRule::unsigned_rule)},
        {"box, adaptive", zoo::box({0, 0, 0}, {1, 0.47, 0.23}), to_thickness(0.1, SignRule::winding)},
        {"overlapping spheres, adaptive", zoo::overlapping_spheres(1), to_thickness(0.2, SignRule::winding)}};
}

/// A file and where its sections are.
class File {
public:
    explicit File(const shell::ShellData& data) : bytes_(shell_file::encode(data)) {
        shell_file::Header header{};
        std::memcpy(&header, bytes_.data(), sizeof(header));
        table_.resize(header.sections);
        std::memcpy(table_.data(), bytes_.data() + sizeof(header), table_.size() * sizeof(shell_file::Section));
    }

    const Bytes& bytes() const { return bytes_; }
    const std::vector<shell_file::Section>& table() const { return table_; }
    const shell_file::Section& section(std::uint32_t kind, std::uint32_t level = 0) const {
        return *std::find_if(table_.begin(), table_.end(),
                             [&](const auto& s) { return s.kind == kind && s.level == level; });
    }

    template <class T>
    static T get(const Bytes& bytes, const shell_file::Section& s, std::uint64_t i) {
        T value;
        std::memcpy(&value, bytes.data() + s.offset + i * sizeof(T), sizeof(T));
        return value;
    }
    template <class T>
    static void put(Bytes& bytes, const shell_file::Section& s, std::uint64_t i, const T& value) {
        std::memcpy(bytes.data() + s.offset + i * sizeof(T), &value, sizeof(T));
    }

private:
    Bytes bytes_;
    std::vector<shell_file::Section> table_;
};

/// Tries changes and counts who saw them.
class Trial {
public:
    Trial(const Subject& subject, std::uint64_t most)
        : subject_(subject),
          most_(most),
          shell_(build(subject.mesh, subject.options)),
          file_(shell::Access::data(shell_)) {}

    const shell::ShellData& data() const { return shell::Access::data(shell_); }
    const ThinShell& shell() const { return shell_; }
    const File& file() const { return file_; }

    /// For elements 0 … count − 1, or as many as are tried, evenly spread: change(bytes, i) makes a statement
    /// of the file false, or returns false where it cannot.
    template <class Change>
    void each(const std::string& what, std::uint64_t count, const Change& change, bool all = false) {
        const std::uint64_t tried = all ? count : std::min(count, most_);
        for (std::uint64_t n = 0; n < tried; ++n) {
            const std::uint64_t i = n * count / tried;
            Bytes bytes = file_.bytes();
            if (!change(bytes, i) || bytes == file_.bytes()) continue;
            const std::string seen = seen_by(bytes);
            ++seen_[what][seen];
            EXPECT_NE(seen, "") << subject_.name << ": " << what << ", element " << i << " of " << count;
        }
    }

    void print() const {
        fmt::print("{}\n", subject_.name);
        for (const auto& [what, by] : seen_) {
            std::string line;
            for (const auto& [check, count] : by)
                line += fmt::format("{}{} {}", line.empty() ? "" : ", ", check, count);
            fmt::print("    {:<46} {}\n", what, line);
        }
    }

private:
    /// "load", the first check that fails, or nothing.
    std::string seen_by(Bytes bytes) const {
        shell_file::mend_checksums(bytes);
        std::optional<ThinShell> changed;
        try {
            changed = shell::Access::make(shell_file::decode(bytes));
        } catch (const InputError&) {
            return "load";
        }
        VerifyOptions options;
        options.samples = 100;
        options.complete = true;
        for (const VerifyCheck& check : verify(*changed, subject_.mesh, options).checks)
            if (!check.passed) return check.name;
        return "";
    }

    const Subject& subject_;
    std::uint64_t most_;
    ThinShell shell_;
    File file_;
    std::map<std::string, std::map<std::string, int>> seen_;
};

template <class T, class F>
auto changing(const shell_file::Section& section, const F& f) {
    return [&section, f](Bytes& bytes, std::uint64_t i) {
        File::put<T>(bytes, section, i, f(File::get<T>(bytes, section, i)));
        return true;
    };
}

void change_header(Trial& trial) {
    const std::uint64_t end =
        sizeof(shell_file::Header) + trial.file().table().size() * sizeof(shell_file::Section);
    const auto is_checksum = [](std::uint64_t at) {
        return at < sizeof(shell_file::Header)
                   ? at >= offsetof(shell_file::Header, checksum)
                   : (at - sizeof(shell_file::Header)) % sizeof(shell_file::Section) >=
                         offsetof(shell_file::Section, checksum);
    };
    trial.each("header and table: bytes", end, [&](Bytes& bytes, std::uint64_t i) {
        bytes[i] ^= std::byte(1);
        return !is_checksum(i);  // those are mended
    });
}

/// The numbers of section 1, in the order of shell_file::visit_facts.
void change_facts(Trial& trial) {
    const shell_file::Section& facts = trial.file().section(shell_file::facts);
    constexpr std::uint64_t rounding = 24, first_double[] = {1, 5, 14}, last_double[] = {1, 6, 24};
    const auto is_double = [&](std::uint64_t i) {
        for (int k = 0; k < 3; ++k)
            if (i >= first_double[k] && i <= last_double[k]) return true;
        return false;
    };
    for (const int step : {1, -1})
        trial.each(
            fmt::format("numbers: whole ones {:+d}", step), facts.count,
            [&](Bytes& bytes, std::uint64_t i) {
                if (is_double(i)) return false;
                File::put(bytes, facts, i, File::get<std::uint64_t>(bytes, facts, i) + std::uint64_t(step));
                return true;
            },
            true);
    for (const double factor : {0.999, 1.001})
        trial.each(
            fmt::format("numbers: lengths times {}", factor), facts.count,
            [&](Bytes& bytes, std::uint64_t i) {
                if (!is_double(i) || i == rounding) return false;
                File::put(bytes, facts, i, File::get<double>(bytes, facts, i) * factor);
                return true;
            },
            true);
    const double w = trial.data().lattice.width, gamma = trial.data().info.rounding;
    for (const double wrong : {0.001 * gamma, gamma + 1e-5 * w})
        trial.each(wrong < gamma ? "numbers: γ too small" : "numbers: γ too large", 1,
                   [&](Bytes& bytes, std::uint64_t) {
                       File::put(bytes, facts, rounding, wrong);
                       return true;
                   });
    // ε in both units, which loading compares.
    for (const int side : {0, 1})
        for (const double change : {-1e-5, 1e-5})
            trial.each(fmt::format("numbers: ε{} {}", side ? "₂" : "₁", change < 0 ? "lower" : "higher"), 1,
                       [&](Bytes& bytes, std::uint64_t) {
                           const double epsilon =
                               File::get<double>(bytes, facts, 5 + std::uint64_t(side)) + change;
                           File::put(bytes, facts, 5 + std::uint64_t(side), epsilon);
                           File::put(bytes, facts, 22 + std::uint64_t(side), w * epsilon);
                           return true;
                       });
}

void change_mesh(Trial& trial) {
    const shell_file::Section& vertices = trial.file().section(shell_file::vertices);
    trial.each("vertices: one unit in the last place", 3 * vertices.count,
               changing<double>(vertices, [](double x) { return std::nextafter(x, 10.0); }));
    const shell_file::Section& triangles = trial.file().section(shell_file::triangles);
    trial.each("triangles: another corner", 3 * triangles.count,
               changing<std::uint32_t>(triangles, [](std::uint32_t v) { return v ^ 1; }));
    trial.each("triangles: turned around", triangles.count,
               changing<Triangle>(triangles, [](const Triangle& t) {
                   return Triangle{t[0], t[2], t[1]};
               }));
    trial.each("triangles: corners rotated", triangles.count,
               changing<Triangle>(triangles, [](const Triangle& t) {
                   return Triangle{t[1], t[2], t[0]};
               }));
}

void change_cells(Trial& trial) {
    for (std::uint32_t k = 0; k < trial.data().octree.levels.size(); ++k) {
        const shell_file::Section& parent = trial.file().section(shell_file::level_parent, k);
        for (const std::uint64_t bit : {0, 1, 5})
            trial.each(fmt::format("codes: bit {}", bit), parent.count,
                       changing<std::uint64_t>(parent, [bit](std::uint64_t code) { return code ^ 1u << bit; }));
        const shell_file::Section& mask = trial.file().section(shell_file::level_mask, k);
        const shell_file::Section& inside = trial.file().section(shell_file::level_inside, k);
        for (unsigned bit = 0; bit < 8; ++bit) {
            const auto flip = [bit](std::uint8_t byte) { return std::uint8_t(byte ^ 1u << bit); };
            trial.each("masks: one bit", mask.count, changing<std::uint8_t>(mask, flip));
            trial.each("sides: one bit", inside.count, changing<std::uint8_t>(inside, flip));
            const shell_file::Section& leaf = trial.file().section(shell_file::level_leaf, k);
            trial.each("surface cells: one bit", leaf.count, changing<std::uint8_t>(leaf, flip));
        }
    }
    const shell_file::Section& corners = trial.file().section(shell_file::cell_corners);
    for (unsigned bit = 0; bit < 8; ++bit)
        trial.each(
            "sides of corners: one bit", corners.count,
            changing<std::uint8_t>(corners, [bit](std::uint8_t b) { return std::uint8_t(b ^ 1u << bit); }));
    const shell_file::Section& winding = trial.file().section(shell_file::cell_winding);
    for (const int step : {1, -1, 7})
        trial.each("winding numbers", winding.count,
                   changing<std::int32_t>(winding, [step](std::int32_t w) { return w + step; }));
}

/// Number of the surface cell that holds a finest one.
std::uint64_t surface_cell(const octree::Octree& octree, std::uint64_t code) {
    int level = 0;
    while (octree.find(level, code >> 3) == octree::no_group) {
        ++level;
        code >>= 3;
    }
    const std::uint64_t group = octree.find(level, code >> 3);
    const unsigned before = octree.surface_mask(level, group) & ((1u << (code & 7)) - 1);
    return octree.first_surface_cell(level, group) + std::uint64_t(std::popcount(before));
}

/// The least and greatest f among points of M in each surface cell, in cell widths.
void attained(const Trial& trial, const Mesh& mesh, std::vector<double>& low, std::vector<double>& high) {
    const shell::ShellData& data = trial.data();
    low.assign(data.octree.surface_cells(), 1e30);
    high.assign(low.size(), -1e30);
    constexpr int steps = 100;
    for (const Triangle& t : mesh.triangles)
        for (int i = 1; i < steps; ++i)
            for (int j = 1; i + j < steps; ++j) {
                const Vec3 &a = mesh.vertices[t[0]], &b = mesh.vertices[t[1]], &c = mesh.vertices[t[2]];
                Vec3 p;
                octree::Cell cell;
                bool clear = true;  // of the cell's faces
                for (int axis = 0; axis < 3; ++axis) {
                    p[axis] = a[axis] + (b[axis] - a[axis]) * i / steps + (c[axis] - a[axis]) * j / steps;
                    const double u = data.lattice.to_lattice(p)[axis];
                    cell[std::size_t(axis)] = std::uint32_t(std::floor(u));
                    clear = clear && std::abs(u - std::nearbyint(u)) > 1e-9;
                }
                if (!clear) continue;
                const std::uint64_t s = surface_cell(data.octree, octree::morton_encode(cell));
                const double f = trial.shell().value(p) / data.lattice.width;
                low[s] = std::min(low[s], f);
                high[s] = std::max(high[s], f);
            }
}

void change_bounds(Trial& trial, const Mesh& mesh) {
    std::vector<double> low, high;
    attained(trial, mesh, low, high);
    for (const bool upper : {false, true}) {
        const shell_file::Section& section =
            trial.file().section(upper ? shell_file::cell_upper : shell_file::cell_lower);
        for (const double by : {1e-6, 1e-3, 0.5})
            trial.each(fmt::format("local bounds: {} {} beyond f on M", upper ? "upper" : "lower", by),
                       section.count, [&](Bytes& bytes, std::uint64_t i) {
                           if (high[i] < low[i]) return false;  // M was not sampled in this cell
                           File::put(bytes, section, i, float(upper ? high[i] - by : low[i] + by));
                           return true;
                       });
    }
}

void change_lists(Trial& trial) {
    const shell_file::Section& offset = trial.file().section(shell_file::list_offset);
    for (const int step : {1, -1})
        trial.each(
            "lists: where a group begins", offset.count,
            changing<std::uint64_t>(offset, [step](std::uint64_t o) { return o + std::uint64_t(step); }));
    const shell_file::Section& list = trial.file().section(shell_file::list_bytes);
    for (const unsigned step : {1u, 255u, 128u, 64u})
        trial.each("lists: a byte", list.count,
                   changing<std::uint8_t>(list, [step](std::uint8_t b) { return std::uint8_t(b + step); }));
}

/// All places of the grid point, which must have the same bits.
std::vector<std::uint64_t> places(const shell::ShellData& data, std::uint32_t k, std::uint64_t place) {
    const octree::Level& level = data.octree.levels[k];
    const auto at = [&](std::uint64_t i) {
        const octree::Cell parent = octree::morton_decode(level.parent[i / 27]);
        return octree::Cell{2 * parent[0] + std::uint32_t(i % 3), 2 * parent[1] + std::uint32_t(i / 3 % 3),
                            2 * parent[2] + std::uint32_t(i % 27 / 9)};
    };
    std::vector<std::uint64_t> out;
    for (std::uint64_t i = 0; i < 27 * level.groups(); ++i)
        if (at(i) == at(place)) out.push_back(i);
    return out;
}

/// Less than the distance: next to a filled hole, where the value is an estimate that no more than the distance
/// bounds.
bool beside_a_hole(const Subject& subject, const shell::ShellData& data, std::uint32_t k, std::uint64_t place) {
    if (data.info.sign != SignRule::generalized) return false;
    BuildOptions options = subject.options;
    options.sign = SignRule::unsigned_rule;
    static std::map<std::string, ThinShell> cache;
    // The unsigned shell of the mesh has plain distances wherever it has the grid point.
    const auto it = cache.try_emplace(subject.name, build(subject.mesh, options)).first;
    const shell::ShellData& plain = shell::Access::data(it->second);
    const octree::Level& level = data.octree.levels[k];
    const octree::Cell parent = octree::morton_decode(level.parent[place / 27]);
    const std::uint64_t group = plain.octree.find(int(k), octree::morton_encode(parent));
    if (group == octree::no_group) return true;  // in the hole itself
    return std::abs(data.field.values[k][place]) < plain.field.values[k][27 * group + place % 27] - 1e-9;
}

void change_values(Trial& trial, const Subject& subject) {
    // A hundredth of less than this is within the rounding of a distance.
    const double least = trial.data().info.rounding / trial.data().lattice.width;
    for (std::uint32_t k = 0; k < trial.data().octree.levels.size(); ++k) {
        const shell_file::Section& section = trial.file().section(shell_file::level_values, k);
        const auto everywhere = [&](const auto& f) {
            return [&, f](Bytes& bytes, std::uint64_t i) {
                const double old = File::get<double>(bytes, section, i);
                if (std::abs(old) < least || beside_a_hole(subject, trial.data(), k, i)) return false;
                for (const std::uint64_t place : places(trial.data(), k, i))
                    File::put(bytes, section, place, f(old));
                return true;
            };
        };
        trial.each("values: one place of a grid point", section.count, [&](Bytes& bytes, std::uint64_t i) {
            const double old = File::get<double>(bytes, section, i);
            if (beside_a_hole(subject, trial.data(), k, i)) return false;
            File::put(bytes, section, i, old + 1e-9);
            return true;
        });
        trial.each("values: negated", section.count, everywhere([](double v) { return -v; }));
        trial.each("values: 1 % more", section.count, everywhere([](double v) { return 1.01 * v; }));
        trial.each("values: 10⁻¹⁰ cells less", section.count, everywhere([](double v) { return v - 1e-10; }));
    }
}

void change_everything(const Subject& subject, std::uint64_t most) {
    Trial trial(subject, most);
    change_header(trial);
    change_facts(trial);
    change_mesh(trial);
    change_cells(trial);
    change_bounds(trial, subject.mesh);
    change_lists(trial);
    change_values(trial, subject);
    trial.print();
}

TEST(Mutation, SomeElementsOfEverySection) {
    for (const Subject& subject : subjects()) change_everything(subject, test::tries(8));
}

TEST(SlowMutation, EveryElementOfEverySection) {
    for (const Subject& subject : subjects()) change_everything(subject, ~std::uint64_t{0});
}

}  // namespace
}  // namespace its
