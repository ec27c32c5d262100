#include "manifest.h"

#include <fmt/core.h>

#include <cstdint>
#include <iterator>
#include <utility>

#include "its/base.h"

namespace its::cli {

Manifest::Manifest(const std::filesystem::path& path) : path_(path), hold_(path) {
    if (!hold_.held()) throw FileError(fmt::format("{}: another run is at work in this folder", path.string()));
    read();
    file_.open(path_, std::ios::app | std::ios::binary);
}

const Json* Manifest::find(const std::string& mesh) const {
    const auto found = lines_.find(mesh);
    return found == lines_.end() ? nullptr : &found->second;
}

void Manifest::add(const std::string& mesh, Json line) {
    file_ << line.dump(-1, ' ', false, Json::error_handler_t::replace) << '\n' << std::flush;
    if (!file_) throw FileError(fmt::format("cannot write '{}'", path_.string()));
    lines_[mesh] = std::move(line);
}

namespace {

/// Whether what is read later has the types that are written.
bool is_line(const Json& line) {
    if (!line.is_object()) return false;
    const auto is = [&](const char* name, auto&& right) { return !line.contains(name) || right(line[name]); };
    const auto text = [](const Json& value) { return value.is_string(); };
    const auto number = [](const Json& value) { return value.is_number(); };
    return line.contains("mesh") && is("mesh", text) && is("status", text) && is("job", text) &&
           is("error", text) && is("size", number) && is("modified", number) && is("seconds", number) &&
           is("peak_bytes", number) && is("result", [](const Json& value) { return value.is_object(); });
}

}  // namespace

/// A run that was killed may have left half a line: it is cut off.
void Manifest::read() {
    std::ifstream file(path_, std::ios::binary);
    const std::string text((std::istreambuf_iterator<char>(file)), std::istreambuf_iterator<char>());
    std::uint64_t number = 0;
    std::size_t begin = 0;
    for (std::size_t end; (end = text.find('\n', begin)) != std::string::npos; begin = end + 1) {
        ++number;
        Json line = Json::parse(text.begin() + std::ptrdiff_t(begin), text.begin() + std::ptrdiff_t(end),
                                nullptr, false);
        if (!is_line(line))
            throw FileError(fmt::format("{}: line {} is none of a manifest", path_.string(), number));
        const std::string mesh = line["mesh"];
        lines_[mesh] = std::move(line);
    }
    if (begin < text.size()) std::filesystem::resize_file(path_, begin);
}

}  // namespace its::cli
