#include "io/shell_file.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>
#include <xxhash.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cerrno>
#include <cstring>
#include <limits>
#include <new>
#include <type_traits>

#include "base/memory.h"
#include "base/output_file.h"
#include "base/parallel.h"
#include "its/io.h"
#include "shell/validate.h"

namespace its {
namespace {

static_assert(std::endian::native == std::endian::little, "the .its format is little-endian");
static_assert(sizeof(Vec3) == 24 && sizeof(Triangle) == 12, "meshes are written as they lie in memory");

// A byte with bit 7 and both line ends, as in PNG: files mangled by text-mode copies do not pass.
constexpr std::array<unsigned char, 8> magic = {0x89, 'I', 'T', 'S', '\r', '\n', 0x1a, '\n'};
constexpr std::uint32_t version = 2;
constexpr std::uint32_t byte_order = 0x01020304;
constexpr std::uint64_t alignment = 64;  // a cache line, and any element's own alignment

struct Header {
    std::array<unsigned char, 8> magic;
    std::uint32_t version;
    std::uint32_t byte_order;
    std::uint64_t file_bytes;
    std::uint32_t header_bytes;  // this struct and the section table
    std::uint32_t sections;
    std::array<std::uint64_t, 3> reserved;
    std::uint64_t checksum;  // XXH3-64 of the header's other bytes and the section table
};
static_assert(sizeof(Header) == 64 && std::has_unique_object_representations_v<Header>);

struct Section {
    std::uint32_t kind;
    std::uint32_t level;
    std::uint64_t offset;  // from the start of the file, a multiple of 64
    std::uint64_t bytes;
    std::uint64_t count;
    std::uint64_t element_bytes;
    std::uint64_t checksum;  // XXH3-64 of the section's bytes
};
static_assert(sizeof(Section) == 48 && std::has_unique_object_representations_v<Section>);

enum Kind : std::uint32_t {
    facts = 1,
    sign_reason,
    vertices,
    triangles,
    level_parent,
    level_mask,
    level_first,
    level_values,
    cell_lower,
    cell_upper,
    cell_offset,
    cell_triangle,
    level_inside,
    cell_winding,
};

/// Numbers that are not arrays, eight bytes each; the order is the format.
using Facts = std::array<std::uint64_t, 32>;

/// Calls visit(index, member) for every such number.
template <class Shell, class Visit>
void visit_facts(Shell& shell, Visit&& visit) {
    auto& lattice = shell.lattice;
    auto& info = shell.info;
    std::size_t i = 0;
    const auto all = [&](auto&... members) { (visit(i++, members), ...); };
    all(lattice.depth, lattice.width, lattice.base[0], lattice.base[1], lattice.base[2]);
    all(shell.epsilon_inner, shell.epsilon_outer);
    all(info.depth, info.sign, info.extrema, info.solver, info.mesh_closed, info.mesh_vertices,
        info.mesh_triangles);
    all(info.scale, info.cell_width, info.root.min.x, info.root.min.y, info.root.min.z, info.root.max.x,
        info.root.max.y, info.root.max.z);
    all(info.epsilon_inner, info.epsilon_outer, info.rounding);
    all(info.surface_cells, info.cells, info.memory_bytes);
}

std::uint64_t to_word(double v) {
    return std::bit_cast<std::uint64_t>(v);
}
template <class T>
requires(std::is_integral_v<T> || std::is_enum_v<T>) std::uint64_t to_word(T v) {
    return static_cast<std::uint64_t>(v);
}

/// False if the word is no value of T.
bool from_word(std::uint64_t word, double& v) {
    v = std::bit_cast<double>(word);
    return true;
}
bool from_word(std::uint64_t word, bool& v) {
    v = word != 0;
    return word <= 1;
}
template <class T>
requires(std::is_integral_v<T> || std::is_enum_v<T>) bool from_word(std::uint64_t word, T& v) {
    v = static_cast<T>(word);
    return to_word(v) == word;
}

/// Calls visit(kind, level, array) for every array of the shell, in the order of the file.
template <class Shell, class Visit>
void visit_arrays(Shell& shell, Visit&& visit) {
    visit(sign_reason, 0, shell.info.sign_reason);
    visit(vertices, 0, shell.mesh.vertices);
    visit(triangles, 0, shell.mesh.triangles);
    for (std::size_t k = 0; k < shell.octree.levels.size(); ++k) {
        auto& level = shell.octree.levels[k];
        const auto index = static_cast<std::uint32_t>(k);
        visit(level_parent, index, level.parent);
        visit(level_mask, index, level.mask);
        visit(level_first, index, level.first);
        visit(level_values, index, shell.field.values[k]);
        visit(level_inside, index, shell.sides.inside[k]);
    }
    visit(cell_lower, 0, shell.surface.lower);
    visit(cell_upper, 0, shell.surface.upper);
    visit(cell_offset, 0, shell.surface.offset);
    visit(cell_triangle, 0, shell.surface.triangle);
    visit(cell_winding, 0, shell.sides.winding);
}

constexpr std::uint64_t fixed_sections = 9, sections_per_level = 5;

constexpr std::uint64_t aligned(std::uint64_t offset) {
    return (offset + alignment - 1) / alignment * alignment;
}

std::uint64_t checksum(std::span<const std::byte> bytes) {
    return XXH3_64bits(bytes.data(), bytes.size());
}

/// Of the header without its own checksum, then the table.
std::uint64_t header_checksum(std::span<const std::byte> header_and_table) {
    std::vector<std::byte> copy(header_and_table.begin(), header_and_table.end());
    std::fill_n(copy.begin() + offsetof(Header, checksum), sizeof(std::uint64_t), std::byte{0});
    return checksum(copy);
}

struct Part {
    Section section;
    std::span<const std::byte> bytes;
};

/// The header and table of a file, and where its sections lie in memory.
struct Layout {
    std::vector<std::byte> header;
    std::vector<Part> parts;
    std::uint64_t file_bytes = 0;
};

/// Keeps `words` alive: the layout points into it.
Layout lay_out(const ShellData& shell, Facts& words) {
    words.fill(0);
    visit_facts(shell, [&](std::size_t i, const auto& member) { words[i] = to_word(member); });
    Layout layout;
    const auto add = [&](Kind kind, std::uint32_t level, const auto& array) {
        const auto bytes = std::as_bytes(std::span(array));
        layout.parts.push_back({{kind, level, 0, bytes.size(), array.size(), sizeof(array[0]), 0}, bytes});
    };
    add(facts, 0, words);
    visit_arrays(shell, add);
    parallel_for(layout.parts.size(), 1,
                 [&](std::uint64_t i) { layout.parts[i].section.checksum = checksum(layout.parts[i].bytes); });

    const std::uint64_t header_bytes = sizeof(Header) + layout.parts.size() * sizeof(Section);
    layout.header.resize(header_bytes);
    std::uint64_t end = header_bytes;
    for (std::size_t i = 0; i < layout.parts.size(); ++i) {
        Section& section = layout.parts[i].section;
        section.offset = aligned(end);
        end = section.offset + section.bytes;
        std::memcpy(layout.header.data() + sizeof(Header) + i * sizeof(Section), &section, sizeof(Section));
    }
    layout.file_bytes = aligned(end);
    Header header{magic,
                  version,
                  byte_order,
                  layout.file_bytes,
                  static_cast<std::uint32_t>(header_bytes),
                  static_cast<std::uint32_t>(layout.parts.size()),
                  {},
                  0};
    std::memcpy(layout.header.data(), &header, sizeof(header));
    header.checksum = header_checksum(layout.header);
    std::memcpy(layout.header.data(), &header, sizeof(header));
    return layout;
}

/// Passes the file's bytes, in order, to write(span).
template <class Write>
void emit(const ShellData& shell, Write&& write) {
    Facts words;
    const Layout layout = lay_out(shell, words);
    static constexpr std::array<std::byte, alignment> zeros = {};
    std::uint64_t at = 0;
    const auto put = [&](std::span<const std::byte> bytes) {
        write(bytes);
        at += bytes.size();
    };
    const auto pad = [&] { put(std::span(zeros).first(aligned(at) - at)); };
    put(layout.header);
    for (const Part& part : layout.parts) {
        pad();
        put(part.bytes);
    }
    pad();
}

/// Where a file's bytes come from.
class Source {
public:
    virtual ~Source() = default;
    virtual std::uint64_t size() const = 0;
    /// Copies bytes [offset, offset + target.size()), which must be within size(). Thread-safe.
    virtual void read(std::uint64_t offset, std::span<std::byte> target) const = 0;
};

class MemorySource : public Source {
public:
    explicit MemorySource(std::span<const std::byte> bytes) : bytes_(bytes) {}
    std::uint64_t size() const override { return bytes_.size(); }
    void read(std::uint64_t offset, std::span<std::byte> target) const override {
        if (!target.empty()) std::memcpy(target.data(), bytes_.data() + offset, target.size());
    }

private:
    std::span<const std::byte> bytes_;
};

class FileSource : public Source {
public:
    explicit FileSource(const std::filesystem::path& path) : name_(path.string()) {
        descriptor_ = ::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK);  // a pipe must not block us
        if (descriptor_ < 0) fail("cannot open");
        struct stat status {};
        if (::fstat(descriptor_, &status) != 0) fail("cannot open");
        if (!S_ISREG(status.st_mode)) {
            ::close(descriptor_);
            throw FileError(name_ + ": is not a regular file");
        }
        size_ = static_cast<std::uint64_t>(status.st_size);
    }
    ~FileSource() override { ::close(descriptor_); }
    FileSource(const FileSource&) = delete;
    FileSource& operator=(const FileSource&) = delete;

    std::uint64_t size() const override { return size_; }
    void read(std::uint64_t offset, std::span<std::byte> target) const override {
        constexpr std::size_t largest_call = std::size_t{1} << 30;  // Linux reads less than 2³¹ bytes a call
        while (!target.empty()) {
            const ssize_t got = ::pread(descriptor_, target.data(), std::min(target.size(), largest_call),
                                        static_cast<off_t>(offset));
            if (got < 0 && errno == EINTR) continue;
            if (got < 0) throw FileError(fmt::format("{}: cannot read: {}", name_, std::strerror(errno)));
            if (got == 0) throw FileError(name_ + ": became shorter while it was read");
            target = target.subspan(static_cast<std::size_t>(got));
            offset += static_cast<std::uint64_t>(got);
        }
    }

private:
    [[noreturn]] void fail(const char* what) const {
        const int error = errno;
        if (descriptor_ >= 0) ::close(descriptor_);
        throw FileError(fmt::format("{}: {}: {}", name_, what, std::strerror(error)));
    }

    std::string name_;
    int descriptor_ = -1;
    std::uint64_t size_ = 0;
};

constexpr const char* rebuild = "; copy it again or rebuild it with `its build`";

template <class... Args>
void require(bool holds, fmt::format_string<Args...> text, Args&&... args) {
    if (!holds) throw InputError(fmt::format(text, std::forward<Args>(args)...));
}

Header read_header(const Source& source) {
    require(source.size() >= sizeof(Header::magic), "is not an .its file");
    Header header{};
    source.read(0,
                std::as_writable_bytes(std::span(&header, 1)).first(std::min(source.size(), sizeof(Header))));
    require(header.magic == magic, "is not an .its file");
    require(source.size() >= sizeof(Header), "is cut short{}", rebuild);
    require(header.byte_order == byte_order, "has its bytes in another order{}", rebuild);
    require(header.version == version, "has format version {}, and this program reads version {}; rebuild it",
            header.version, version);
    require(header.file_bytes == source.size(), "should have {} bytes and has {}{}", header.file_bytes,
            source.size(), rebuild);
    return header;
}

/// The table, checked as far as possible without knowing what is in the sections: after this every section lies
/// in the file, none overlaps another, and bytes = count · element_bytes.
std::vector<Section> read_table(const Source& source, const Header& header) {
    const std::uint64_t most = fixed_sections + sections_per_level * (max_depth + 1);
    require(header.sections <= most &&
                header.header_bytes == sizeof(Header) + header.sections * sizeof(Section) &&
                header.header_bytes <= source.size(),
            "has a damaged header{}", rebuild);
    std::vector<std::byte> bytes(header.header_bytes);
    source.read(0, bytes);
    require(header_checksum(bytes) == header.checksum, "has a damaged header{}", rebuild);
    require(header.reserved == decltype(header.reserved){}, "has a damaged header{}", rebuild);

    std::vector<Section> table(header.sections);
    if (!table.empty())
        std::memcpy(table.data(), bytes.data() + sizeof(Header), table.size() * sizeof(Section));
    std::uint64_t end = header.header_bytes;
    for (const Section& section : table) {
        const bool fits = section.offset == aligned(end) && section.offset <= source.size() &&
                          section.bytes <= source.size() - section.offset && section.element_bytes > 0 &&
                          section.bytes / section.element_bytes == section.count &&
                          section.bytes % section.element_bytes == 0;
        require(fits, "has a damaged section table{}", rebuild);
        end = section.offset + section.bytes;
    }
    require(aligned(end) == source.size(), "has a damaged section table{}", rebuild);
    return table;
}

/// No byte of the file is without meaning: the gaps between sections are zero.
void check_padding(const Source& source, const Header& header, const std::vector<Section>& table) {
    std::uint64_t end = header.header_bytes;
    const auto check = [&](std::uint64_t next) {
        std::array<std::byte, alignment> gap{};
        source.read(end, std::span(gap).first(next - end));
        require(std::ranges::all_of(gap, [](std::byte b) { return b == std::byte{0}; }), "is damaged{}",
                rebuild);
    };
    for (const Section& section : table) {
        check(section.offset);
        end = section.offset + section.bytes;
    }
    check(source.size());
}

/// One read to make: a section and the memory of its array.
struct Target {
    const Section* section;
    std::span<std::byte> bytes;
};

void read_section(const Source& source, const Target& target) {
    source.read(target.section->offset, target.bytes);
    require(checksum(target.bytes) == target.section->checksum, "is damaged{}", rebuild);
}

void read_facts(const Source& source, const Section& section, ShellData& shell) {
    Facts words;
    require(section.kind == facts && section.level == 0 && section.element_bytes == sizeof(words[0]) &&
                section.count == words.size(),
            "has an unknown section");
    read_section(source, {&section, std::as_writable_bytes(std::span(words))});
    std::size_t known = 0;
    bool good = true;
    visit_facts(shell, [&](std::size_t i, auto& member) {
        good &= from_word(words[i], member);
        known = i + 1;
    });
    for (; known < words.size(); ++known) good &= words[known] == 0;
    require(good && shell.lattice.depth >= 0 && shell.lattice.depth <= max_depth, "has damaged numbers");
}

/// Sizes all arrays as the table says (together they are no larger than the file) and lists what to read.
std::vector<Target> allocate(const std::vector<Section>& table, ShellData& shell) {
    shell.octree.depth = shell.lattice.depth;
    const auto levels = static_cast<std::size_t>(shell.lattice.depth) + 1;
    require(table.size() == fixed_sections + sections_per_level * levels, "has {} sections at depth {}",
            table.size(), shell.lattice.depth);
    shell.octree.levels.resize(levels);
    shell.field.values.resize(levels);
    shell.sides.inside.resize(levels);
    std::vector<Target> targets;
    const Section* section = &table[1];
    visit_arrays(shell, [&](Kind kind, std::uint32_t level, auto& array) {
        require(section->kind == kind && section->level == level && section->element_bytes == sizeof(array[0]),
                "has an unknown section");
        array.resize(section->count);
        targets.push_back({section++, std::as_writable_bytes(std::span(array.data(), array.size()))});
    });
    return targets;
}

ShellData read_shell(const Source& source, const std::string& name) {
    try {
        const Header header = read_header(source);
        const std::vector<Section> table = read_table(source, header);
        require(!table.empty(), "has no sections");
        check_padding(source, header, table);
        ShellData shell;
        read_facts(source, table[0], shell);
        const std::vector<Target> targets = allocate(table, shell);
        parallel_for(targets.size(), 1, [&](std::uint64_t i) { read_section(source, targets[i]); });
        validate(shell);
        return shell;
    } catch (const InputError& error) {
        throw InputError(fmt::format("{}: {}", name, error.what()));
    } catch (const std::bad_alloc&) {
        throw MemoryError(
            fmt::format("{}: needs {} of memory, more than is free", name, bytes_text(source.size())));
    }
}

}  // namespace

std::vector<std::byte> encode(const ShellData& shell) {
    std::vector<std::byte> file;
    emit(shell, [&](std::span<const std::byte> bytes) { file.insert(file.end(), bytes.begin(), bytes.end()); });
    return file;
}

ShellData decode(std::span<const std::byte> bytes, const std::string& name) {
    return read_shell(MemorySource(bytes), name);
}

void mend_checksums(std::span<std::byte> bytes) {
    Header header{};
    if (bytes.size() < sizeof(header)) return;
    std::memcpy(&header, bytes.data(), sizeof(header));
    const std::uint64_t fits = (bytes.size() - sizeof(header)) / sizeof(Section);
    const std::uint64_t sections = std::min<std::uint64_t>(header.sections, fits);
    for (std::uint64_t i = 0; i < sections; ++i) {
        std::byte* const place = bytes.data() + sizeof(Header) + i * sizeof(Section);
        Section section{};
        std::memcpy(&section, place, sizeof(section));
        if (section.offset > bytes.size() || section.bytes > bytes.size() - section.offset) continue;
        section.checksum = checksum(bytes.subspan(section.offset, section.bytes));
        std::memcpy(place, &section, sizeof(section));
    }
    header.checksum = header_checksum(bytes.first(sizeof(Header) + sections * sizeof(Section)));
    std::memcpy(bytes.data(), &header, sizeof(header));
}

void save(const ThinShell& shell, const std::filesystem::path& path) {
    OutputFile file(path);
    emit(shell.data(), [&](std::span<const std::byte> bytes) { file.write(bytes); });
    file.commit();
}

ThinShell load(const std::filesystem::path& path) {
    const FileSource source(path);
    // A sparse file may claim, and have, any size; what is read takes as much memory as the file has bytes.
    if (const std::uint64_t available = available_memory(); available > 0 && source.size() > available) {
        throw MemoryError(fmt::format("{}: needs {} of memory, and {} are free", path.string(),
                                      bytes_text(source.size()), bytes_text(available)));
    }
    return ThinShell(std::make_shared<const ShellData>(read_shell(source, path.string())));
}

}  // namespace its
