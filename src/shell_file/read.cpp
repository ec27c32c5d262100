#include <fmt/format.h>

#include <algorithm>
#include <cstring>
#include <memory>
#include <new>

#include "base/input_file.h"
#include "base/names.h"
#include "base/parallel.h"
#include "base/quote.h"
#include "its/inspect.h"
#include "its/memory.h"
#include "its/shell_file.h"
#include "shell/access.h"
#include "shell/validate.h"
#include "shell_file/format.h"
#include "shell_file/shell_file.h"

namespace its {
using namespace shell_file;

namespace {

constexpr Named<LoadCheck> checks[] = {{LoadCheck::full, "full"}, {LoadCheck::quick, "quick"}};

constexpr const char* rebuild = "; copy it again, or build it anew";

template <class... Args>
void require(bool holds, fmt::format_string<Args...> text, Args&&... args) {
    if (!holds) throw InputError(fmt::format(text, std::forward<Args>(args)...));
}

using Bytes = std::span<const std::byte>;

Header read_header(Bytes file) {
    require(file.size() >= sizeof(magic), "is not an .its file");
    Header header{};
    std::memcpy(&header, file.data(), std::min(file.size(), sizeof(Header)));
    require(header.magic == magic, "is not an .its file");
    require(file.size() >= sizeof(Header), "is cut short{}", rebuild);
    require(header.byte_order == byte_order, "has its bytes in another order{}", rebuild);
    require(header.version >= 1 && header.version <= version,
            "has format version {}, and this program reads versions 1 to {}; rebuild it", header.version,
            version);
    require(header.file_bytes == file.size(), "should have {} bytes and has {}{}", header.file_bytes,
            file.size(), rebuild);
    return header;
}

/// The table, checked as far as possible without knowing what is in the sections: after this every section lies
/// in the file, none overlaps another, and bytes = count · element_bytes.
std::vector<Section> read_table(Bytes file, const Header& header) {
    require(header.header_bytes <= file.size() &&
                header.header_bytes == sizeof(Header) + std::uint64_t{header.sections} * sizeof(Section),
            "has a damaged header{}", rebuild);
    const Bytes bytes = file.first(header.header_bytes);
    require(header_checksum(bytes) == header.checksum, "has a damaged header{}", rebuild);
    require(header.reserved == decltype(header.reserved){}, "has a damaged header{}", rebuild);

    std::vector<Section> table(header.sections);
    if (!table.empty())
        std::memcpy(table.data(), bytes.data() + sizeof(Header), table.size() * sizeof(Section));
    std::uint64_t end = header.header_bytes;
    for (const Section& section : table) {
        const bool fits = section.offset == aligned(end) && section.offset <= file.size() &&
                          section.bytes <= file.size() - section.offset && section.element_bytes > 0 &&
                          section.bytes / section.element_bytes == section.count &&
                          section.bytes % section.element_bytes == 0;
        require(fits, "has a damaged section table{}", rebuild);
        end = section.offset + section.bytes;
    }
    require(aligned(end) == file.size(), "has a damaged section table{}", rebuild);
    return table;
}

/// No byte of the file is without meaning: the gaps between sections are zero.
void check_padding(Bytes file, const Header& header, const std::vector<Section>& table) {
    std::uint64_t end = header.header_bytes;
    const auto check = [&](std::uint64_t next) {
        const auto zero = [](std::byte b) { return b == std::byte{0}; };
        require(std::ranges::all_of(file.subspan(end, next - end), zero), "is damaged{}", rebuild);
    };
    for (const Section& section : table) {
        check(section.offset);
        end = section.offset + section.bytes;
    }
    check(file.size());
}

void check_sums(Bytes file, const std::vector<Section>& table, LoadCheck check) {
    parallel_for(table.size(), 1, [&](std::uint64_t i) {
        const Section& section = table[i];
        if (check == LoadCheck::quick && is_payload(section.kind)) return;
        require(checksum(file.subspan(section.offset, section.bytes)) == section.checksum, "is damaged{}",
                rebuild);
    });
}

void read_facts(Bytes file, const Section& section, std::uint32_t file_version, shell::ShellData& shell) {
    const std::size_t count = file_version == 1 ? fact_words_of_version_1 : fact_words;
    require(section.kind == facts && section.level == 0 && section.element_bytes == sizeof(std::uint64_t) &&
                section.count == count,
            "has an unknown section");
    std::vector<std::uint64_t> words(count);
    std::memcpy(words.data(), file.data() + section.offset, section.bytes);
    std::size_t known = 0;
    bool good = true;
    visit_facts(shell, file_version, [&](std::size_t i, auto& member) {
        good &= from_word(words[i], member);
        known = i + 1;
    });
    for (; known < words.size(); ++known) good &= words[known] == 0;
    good &= file_version == 1 || shell.grid_points > 0;
    const int deepest = shell.info.adaptive ? max_adaptive_depth : max_depth;
    require(good && shell.lattice.depth >= 0 && shell.lattice.depth <= deepest && shell.info.depth >= 0 &&
                shell.info.depth <= shell.lattice.depth,
            "has damaged numbers");
    shell.lattice.room = shell.lattice.depth - shell.info.depth;
}

template <class T>
void refer(Array<T>& array, Bytes bytes, const std::shared_ptr<const void>& owner) {
    static_assert(alignof(T) <= alignment);
    array = {std::span(reinterpret_cast<const T*>(bytes.data()), bytes.size() / sizeof(T)), owner};
}
void refer(std::string& text, Bytes bytes, const std::shared_ptr<const void>&) {
    text.assign(reinterpret_cast<const char*>(bytes.data()), bytes.size());
}

/// Lets every array refer to its section.
void refer_to_sections(const FileBytes& file, std::uint32_t file_version, const std::vector<Section>& table,
                       shell::ShellData& shell, OldArrays& old) {
    const auto levels = static_cast<std::size_t>(shell.lattice.depth) + 1;
    shell.octree.depth = shell.lattice.depth;
    shell.octree.levels.resize(levels);
    shell.field.values.resize(levels);
    shell.sides.inside.resize(levels);
    old.first.resize(levels);
    std::size_t next = 1;
    const auto visit = [&](Kind kind, std::uint32_t level, auto& array) {
        require(next < table.size(), "has {} sections, too few at depth {}", table.size(), shell.lattice.depth);
        const Section& section = table[next++];
        require(section.kind == kind && section.level == level && section.element_bytes == sizeof(array[0]),
                "has an unknown section");
        refer(array, file.bytes.subspan(section.offset, section.bytes), file.owner);
    };
    if (file_version == 1)
        visit_arrays_of_version_1(shell, old, visit);
    else
        visit_arrays(shell, file_version, visit);
    require(next == table.size(), "has {} sections, too many at depth {}", table.size(), shell.lattice.depth);
}

/// Version 1 lacks the exact sides of cells, has the running numbers of masks, which follow from them, and
/// plain lists. Nothing is validated yet.
void convert_version_1(const OldArrays& old, shell::ShellData& shell) {
    require(shell.info.sign == SignRule::unsigned_rule,
            "was written before shells knew the exact sides of their cells; build it anew");
    shell.sides = signs::no_inside(shell.octree);
    for (std::size_t k = 0; k < old.first.size(); ++k) {
        const octree::Level& level = shell.octree.levels[k];
        const octree::Ranks& ranks = level.first;
        bool good = level.mask.size() == level.groups() && old.first[k].size() == ranks.size();
        for (std::size_t g = 0; good && g < ranks.size(); ++g) good = old.first[k][g] == ranks[g];
        require(good, "level {}: index of a group is wrong", k);
    }
    const std::uint64_t cells = shell.octree.surface_cells();
    bool good =
        old.offset.size() == cells + 1 && old.offset[0] == 0 && old.offset[cells] == old.triangle.size();
    for (std::uint64_t c = 0; good && c < cells; ++c) good = old.offset[c] <= old.offset[c + 1];
    for (std::uint64_t c = 0; good && c < cells; ++c)
        for (std::uint64_t i = old.offset[c] + 1; good && i < old.offset[c + 1]; ++i)
            good = old.triangle[i - 1] < old.triangle[i];
    require(good, "the triangle lists of surface cells are wrong");
    shell.surface.lists = shell::pack_lists(shell.octree.levels[0], old.offset, old.triangle);
}

shell::ShellData read_shell(const FileBytes& file, const std::string& name, LoadCheck check) {
    try {
        const Header header = read_header(file.bytes);
        const std::vector<Section> table = read_table(file.bytes, header);
        require(!table.empty(), "has no sections");
        check_padding(file.bytes, header, table);
        shell::ShellData shell;
        OldArrays old;
        read_facts(file.bytes, table[0], header.version, shell);
        refer_to_sections(file, header.version, table, shell, old);
        if (header.version == 1) check = LoadCheck::full;  // its lists are converted, and so read anyway
        check_sums(file.bytes, table, check);
        for (octree::Level& level : shell.octree.levels) level = {level.parent, level.mask, level.leaf};
        if (header.version == 1) convert_version_1(old, shell);
        shell::validate_structure(shell);
        if (check == LoadCheck::full) shell::validate_payload(shell);
        return shell;
    } catch (const InputError& error) {
        throw InputError(fmt::format("{}: {}", name, error.what()));
    } catch (const std::bad_alloc&) {
        throw MemoryError(fmt::format("{}: needs more memory than is free", name));
    }
}

}  // namespace

shell::ShellData shell_file::decode(std::span<const std::byte> bytes, const std::string& name,
                                    LoadCheck check) {
    const auto copy = std::make_shared<const std::vector<std::byte>>(bytes.begin(), bytes.end());
    return read_shell({*copy, copy}, name, check);
}

void shell_file::mend_checksums(std::span<std::byte> bytes) {
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

std::string_view name(LoadCheck check) {
    return name_in(checks, check);
}

std::optional<LoadCheck> parse_load_check(std::string_view name) {
    return value_in(checks, name);
}

ThinShell load(const std::filesystem::path& path, const LoadOptions& options) {
    return with_threads(options.run.threads, [&] {
        const FileBytes file = options.map ? map_bytes(path) : read_bytes(path);
        return shell::Access::make(read_shell(file, shown(path), options.check));
    });
}

ThinShell decode(std::span<const std::byte> bytes, const LoadOptions& options) {
    return with_threads(options.run.threads,
                        [&] { return shell::Access::make(shell_file::decode(bytes, "shell", options.check)); });
}

}  // namespace its
