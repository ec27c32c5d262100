#include <xxhash.h>

#include <algorithm>
#include <cstring>

#include "base/output_file.h"
#include "base/parallel.h"
#include "its/shell_file.h"
#include "shell/access.h"
#include "shell_file/format.h"
#include "shell_file/shell_file.h"

namespace its {
using namespace shell_file;

namespace shell_file {

std::uint64_t checksum(std::span<const std::byte> bytes) {
    return XXH3_64bits(bytes.data(), bytes.size());
}

std::uint64_t header_checksum(std::span<const std::byte> header_and_table) {
    std::vector<std::byte> copy(header_and_table.begin(), header_and_table.end());
    std::fill_n(copy.begin() + offsetof(Header, checksum), sizeof(std::uint64_t), std::byte{0});
    return checksum(copy);
}

}  // namespace shell_file

namespace {

using Facts = std::array<std::uint64_t, fact_words>;

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
Layout lay_out(const shell::ShellData& shell, Facts& words) {
    words.fill(0);
    visit_facts(shell, version, [&](std::size_t i, const auto& member) { words[i] = to_word(member); });
    Layout layout;
    const auto add = [&](Kind kind, std::uint32_t level, const auto& array) {
        const auto bytes = std::as_bytes(std::span(array));
        layout.parts.push_back({{kind, level, 0, bytes.size(), array.size(), sizeof(array[0]), 0}, bytes});
    };
    add(facts, 0, words);
    visit_arrays(shell, version, add);
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
void emit(shell::ShellData shell, Write&& write) {
    if (shell.grid_points == 0) shell.grid_points = octree::count_grid_points(shell.octree);
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

}  // namespace

std::vector<std::byte> shell_file::encode(const shell::ShellData& shell) {
    std::vector<std::byte> file;
    emit(shell, [&](std::span<const std::byte> bytes) { file.insert(file.end(), bytes.begin(), bytes.end()); });
    return file;
}

std::vector<std::byte> encode(const ThinShell& shell, const Run& run) {
    return with_threads(run.threads, [&] { return shell_file::encode(shell::Access::data(shell)); });
}

void save(const ThinShell& shell, const std::filesystem::path& path, const Run& run) {
    with_threads(run.threads, [&] {
        OutputFile file(path);
        emit(shell::Access::data(shell), [&](std::span<const std::byte> bytes) { file.write(bytes); });
        file.commit();
    });
}

}  // namespace its
