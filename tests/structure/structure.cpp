#include "structure/structure.h"

#include <fmt/core.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <fstream>
#include <regex>
#include <sstream>
#include <string_view>

namespace its::structure {
namespace {

namespace fs = std::filesystem;

/// From the bottom up. A module includes itself and those of lower layers, never a sibling in its own layer.
const std::vector<std::vector<std::string>> layers = {
    {"base"},
    {"geometry"},
    {"mesh"},
    {"formats", "octree", "winding"},
    {"inspect"},
    {"distance"},
    {"signs"},
    {"field"},
    {"adaptive"},
    {"shell"},
    {"query", "surface", "simplify", "verify", "shell_file"},
    {"wrap"},
    {"display"},
    {"picture", "page", "vdb"},
};

/// What verify may include of other modules: the declarations of a shell's arrays, and arithmetic of vectors.
const std::vector<std::string> allowed_in_verify = {"shell/shell_data.h", "octree/lattice.h", "geometry/vec3.h",
                                                    "shell/access.h"};

int layer_of(const std::string& module) {
    for (std::size_t i = 0; i < layers.size(); ++i)
        if (std::find(layers[i].begin(), layers[i].end(), module) != layers[i].end())
            return static_cast<int>(i);
    return -1;
}

struct Line {
    int number;
    std::string text;
};

struct Include {
    int line;
    std::string name;
    bool quoted;
};

std::vector<Line> read_lines(const fs::path& file) {
    std::vector<Line> lines;
    std::ifstream stream(file);
    int number = 0;
    for (std::string text; std::getline(stream, text);) lines.push_back({++number, text});
    return lines;
}

std::vector<Include> includes_of(const fs::path& file) {
    std::vector<Include> includes;
    for (const Line& line : read_lines(file)) {
        std::size_t at = line.text.find_first_not_of(" \t");
        if (at == std::string::npos || line.text[at] != '#') continue;
        at = line.text.find_first_not_of(" \t", at + 1);
        if (at == std::string::npos || line.text.compare(at, 7, "include") != 0) continue;
        at = line.text.find_first_of("\"<", at);
        if (at == std::string::npos) continue;
        const bool quoted = line.text[at] == '"';
        const std::size_t end = line.text.find(quoted ? '"' : '>', at + 1);
        if (end != std::string::npos)
            includes.push_back({line.number, line.text.substr(at + 1, end - at - 1), quoted});
    }
    return includes;
}

std::vector<fs::path> files_below(const fs::path& folder, const std::vector<std::string>& extensions) {
    std::vector<fs::path> files;
    if (!fs::exists(folder)) return files;
    for (const auto& entry : fs::recursive_directory_iterator(folder)) {
        const std::string extension = entry.path().extension().string();
        if (entry.is_regular_file() &&
            std::find(extensions.begin(), extensions.end(), extension) != extensions.end())
            files.push_back(entry.path());
    }
    std::sort(files.begin(), files.end());
    return files;
}

std::vector<fs::path> sources_below(const fs::path& folder) {
    return files_below(folder, {".h", ".cpp"});
}

std::string place(const fs::path& root, const fs::path& file, int line) {
    return fmt::format("{}:{}: ", fs::relative(file, root).string(), line);
}

std::string first_folder(const std::string& name) {
    const std::size_t slash = name.find('/');
    return slash == std::string::npos ? "" : name.substr(0, slash);
}

/// Public headers belong to the module of their name; export.h, version.h, memory.h and stopwatch.h to the
/// lowest, those of files to formats, weld.h to inspect, verify_cage.h to verify.
std::string module_of_include(const std::string& name) {
    if (first_folder(name) != "its") return first_folder(name);
    const std::string stem = fs::path(name).stem().string();
    return stem == "export" || stem == "version" || stem == "memory" || stem == "stopwatch" ? "base"
           : stem == "mesh_file" || stem == "points"                                        ? "formats"
           : stem == "verify_cage"                                                          ? "verify"
           : stem == "weld"                                                                 ? "inspect"
                                                                                            : stem;
}

/// What is wrong with a header of others that a file in `module` includes, or nothing.
std::string judge_foreign(const std::string& module, const Include& include) {
    if (first_folder(include.name) == "its")
        return fmt::format("includes <{}>; our own headers stand in quotes", include.name);
    const bool parallel = include.name.starts_with("oneapi/tbb") || include.name.starts_with("tbb/");
    if (parallel && module != "base")
        return fmt::format("includes <{}>: base/parallel.h is the one parallel layer", include.name);
    return "";
}

/// What is wrong with one include of a file in `module`, or nothing.
std::string judge(const fs::path& root, const std::string& module, const Include& include) {
    if (!include.quoted) return judge_foreign(module, include);
    const bool is_public = first_folder(include.name) == "its";
    if (!fs::exists(root / (is_public ? "include" : "src") / include.name) ||
        include.name.find("..") != std::string::npos)
        return fmt::format("includes \"{}\", which is neither its/FILE.h nor MODULE/FILE.h", include.name);
    const std::string other = module_of_include(include.name);
    if (other == module) return "";
    const int from = layer_of(module), to = layer_of(other);
    if (to < 0) return fmt::format("includes \"{}\" of the unknown module {}", include.name, other);
    if (to >= from)
        return fmt::format("{} includes \"{}\": {} is {} it; allowed below {} are {}", module, include.name,
                           other, to == from ? "beside" : "above", module,
                           fmt::join(std::vector(layers.begin(), layers.begin() + from), " "));
    const bool shared =
        is_public || other == "base" ||
        std::find(allowed_in_verify.begin(), allowed_in_verify.end(), include.name) != allowed_in_verify.end();
    if (module == "verify" && !shared)
        return fmt::format("verify includes \"{}\": it must share no code with the builder; allowed are {}",
                           include.name, fmt::join(allowed_in_verify, ", "));
    return "";
}

}  // namespace

Violations check_library(const fs::path& root) {
    Violations violations;
    for (const fs::path& file : sources_below(root / "src")) {
        const std::string module = first_folder(fs::relative(file, root / "src").string());
        if (layer_of(module) < 0) {
            violations.push_back(place(root, file, 1) + "is in no known module; add its layer to this test");
            continue;
        }
        for (const Include& include : includes_of(file)) {
            const std::string wrong = judge(root, module, include);
            if (!wrong.empty()) violations.push_back(place(root, file, include.line) + wrong);
        }
    }
    return violations;
}

namespace {

/// What may stand after its:: in a name that the verifier's code uses: itself; base; Vec3 and its arithmetic;
/// what it is given and gives back. Of a shell it may ask where the arrays are, and f as it is shipped.
const std::vector<std::string> allowed_symbols = {"DoubleDouble",
                                                  "exact_sum",
                                                  "exact_sum_of_ordered",
                                                  "exact_product",
                                                  "inverse",
                                                  "square_root",
                                                  "sum_of_products",
                                                  "verifier",
                                                  "verify",
                                                  "verify_cage",
                                                  "VerifyCageOptions",
                                                  "VerifyCageReport",
                                                  "detail",
                                                  "Stage",
                                                  "Array",
                                                  "for_chunks",
                                                  "fold_chunks",
                                                  "parallel_for",
                                                  "chunk_count",
                                                  "with_threads",
                                                  "require_threads",
                                                  "parallel_sort",
                                                  "Error",
                                                  "InputError",
                                                  "OptionError",
                                                  "MemoryError",
                                                  "Cancelled",
                                                  "Vec3",
                                                  "Box",
                                                  "dot",
                                                  "cross",
                                                  "norm",
                                                  "finite",
                                                  "Mesh",
                                                  "VerifyOptions",
                                                  "VerifyCheck",
                                                  "VerifyReport",
                                                  "Parts",
                                                  "run_call",
                                                  "Stopwatch",
                                                  "to_mesh"};
const std::vector<std::string> allowed_of_shell = {"value"};

/// The names before the arguments: "_ZNK3its9ThinShell5valueERKNS_4Vec3E" gives its, ThinShell, value. Empty if
/// it begins otherwise, "operator" for the name of one.
std::vector<std::string> scope_of(const std::string& mangled) {
    std::size_t at = 2;
    if (mangled.compare(0, 2, "_Z") != 0) return {};
    if (mangled.compare(at, 2, "GV") == 0) at += 2;          // guard of a static variable
    if (at < mangled.size() && mangled[at] == 'T') at += 2;  // table or description of a type
    while (at < mangled.size() && std::string_view("ZNKVRO").find(mangled[at]) != std::string_view::npos) ++at;
    std::vector<std::string> names;
    while (at < mangled.size() && std::isdigit(static_cast<unsigned char>(mangled[at])) != 0) {
        std::size_t length = 0;
        for (; at < mangled.size() && std::isdigit(static_cast<unsigned char>(mangled[at])) != 0; ++at)
            length = 10 * length + std::size_t(mangled[at] - '0');
        names.push_back(mangled.substr(at, length));
        at += length;
    }
    if (names.size() == 1 && at < mangled.size() && std::islower(static_cast<unsigned char>(mangled[at])) != 0)
        names.emplace_back("operator");
    return names;
}

bool contains(const std::vector<std::string>& list, const std::string& name) {
    return std::find(list.begin(), list.end(), name) != list.end();
}

}  // namespace

Violations check_verifier_symbols(const std::vector<std::string>& mangled) {
    Violations violations;
    for (const std::string& symbol : mangled) {
        const std::vector<std::string> names = scope_of(symbol);
        if (names.empty() || names[0] != "its") continue;
        const bool good =
            names.size() > 1 &&
            (names[1] == "operator" || contains(allowed_symbols, names[1]) ||
             (names[1] == "ThinShell" && names.size() > 2 && contains(allowed_of_shell, names[2])) ||
             (names[1] == "shell" && names.size() > 3 && names[2] == "Access" && names[3] == "data"));
        if (!good)
            violations.push_back(fmt::format("verify uses {}, of another module", fmt::join(names, "::")));
    }
    return violations;
}

Violations check_public_headers(const fs::path& root) {
    Violations violations;
    for (const fs::path& file : sources_below(root / "include")) {
        const std::string module = module_of_include("its/" + file.filename().string());
        for (const Include& include : includes_of(file)) {
            std::string wrong;
            if (!include.quoted && include.name.find_first_of("./") != std::string::npos)
                wrong = fmt::format("a public header includes <{}>, not of the standard library", include.name);
            else if (include.quoted && first_folder(include.name) != "its")
                wrong = fmt::format("a public header includes the private \"{}\"", include.name);
            else
                wrong = judge(root, module, include);
            if (!wrong.empty()) violations.push_back(place(root, file, include.line) + wrong);
        }
    }
    return violations;
}

Violations check_users(const fs::path& root) {
    Violations violations;
    for (const std::string folder : {"cli", "examples", "python"}) {
        for (const fs::path& file : sources_below(root / folder)) {
            for (const Include& include : includes_of(file)) {
                const bool is_public = first_folder(include.name) == "its" && include.quoted &&
                                       fs::exists(root / "include" / include.name);
                const bool own = include.quoted && include.name.find("..") == std::string::npos &&
                                 fs::exists(file.parent_path() / include.name);
                const bool foreign = !include.quoted && first_folder(include.name) != "its" &&
                                     !fs::exists(root / "src" / include.name);
                if (!is_public && !own && !foreign)
                    violations.push_back(
                        place(root, file, include.line) +
                        fmt::format("{} includes {}; it may use public headers (\"its/FILE.h\"), its "
                                    "own files and other libraries",
                                    folder, include.name));
            }
        }
    }
    return violations;
}

Violations check_version(const fs::path& root) {
    const fs::path home = root / "include" / "its" / "version.h";
    std::string version;
    for (const Line& line : read_lines(home)) {
        const std::string_view define = "#define ITS_VERSION \"";
        if (line.text.compare(0, define.size(), define) == 0)
            version = line.text.substr(define.size(), line.text.rfind('"') - define.size());
    }
    if (version.empty()) return {"include/its/version.h: defines no ITS_VERSION"};

    std::vector<fs::path> files = {root / "CMakeLists.txt"};
    for (const char* folder :
         {"include", "src", "cli", "cmake", "scripts", "examples", "python", "web", "bench"}) {
        const auto more = files_below(root / folder, {".h", ".cpp", ".txt", ".cmake", ".in", ".sh", ".py",
                                                      ".toml", ".json", ".ts", ".js"});
        files.insert(files.end(), more.begin(), more.end());
    }
    Violations violations;
    for (const fs::path& file : files) {
        if (file == home || file.string().find("node_modules") != std::string::npos) continue;
        for (const Line& line : read_lines(file)) {
            const std::size_t at = line.text.find(version);
            if (at == std::string::npos) continue;
            const auto digit_or_dot = [&](std::size_t i) {
                return i < line.text.size() &&
                       (std::isdigit(static_cast<unsigned char>(line.text[i])) != 0 || line.text[i] == '.');
            };
            if (digit_or_dot(at - 1) || digit_or_dot(at + version.size())) continue;  // part of a longer number
            violations.push_back(
                place(root, file, line.number) +
                fmt::format("states the version {}; read it from include/its/version.h", version));
        }
    }
    return violations;
}

Violations check_silence(const fs::path& root) {
    constexpr std::array<std::string_view, 8> forbidden = {"std::cout",    "std::cerr",   "std::clog",
                                                           "std::printf(", "fmt::print(", "std::exit(",
                                                           "std::abort(",  "<iostream>"};
    Violations violations;
    for (const fs::path& file : sources_below(root / "src"))
        for (const Line& line : read_lines(file))
            for (const std::string_view word : forbidden)
                if (line.text.find(word) != std::string::npos)
                    violations.push_back(place(root, file, line.number) +
                                         fmt::format("uses {}; the library never prints or exits", word));
    return violations;
}

Violations check_platform(const fs::path& root) {
    // Of compilers and machines; headers of POSIX, Linux and Windows; and the kernel's files.
    constexpr std::array<std::string_view, 30> forbidden = {
        "__attribute__", "__declspec",   "__builtin_",  "__restrict",  "__asm",       "__has_include",
        "__GNUC__",      "__clang__",    "_MSC_VER",    "_WIN32",      "__linux__",   "__APPLE__",
        "__x86_64__",    "__aarch64__",  "__SSE",       "__AVX",       "#pragma GCC", "#pragma clang",
        "_Pragma",       "<unistd.h>",   "<fcntl.h>",   "<sys/",       "<pthread.h>", "<dlfcn.h>",
        "intrin.h>",     "<arm_neon.h>", "<windows.h>", "long double", "\"/proc/",    "\"/sys/"};
    Violations violations;
    for (const char* folder : {"include", "src", "cli"})
        for (const fs::path& file : sources_below(root / folder)) {
            const std::string name = fs::relative(file, root).generic_string();
            if (name.starts_with("src/base/platform/") || name == "cli/platform.cpp") continue;
            for (const Line& line : read_lines(file)) {
                for (const std::string_view word : forbidden)
                    if (line.text.find(word) != std::string::npos)
                        violations.push_back(place(root, file, line.number) +
                                             fmt::format("names {}; base/platform is the place for it", word));
            }
        }
    return violations;
}

Violations check_wording(const fs::path& root) {
    // Within a string literal of one line; comments may say what they like.
    const std::regex option(R"re(^[^"]*("[^"]*"[^"]*)*"[^"]*--[a-z])re"), command(R"re("[^"]*`its [a-z]+)re");
    Violations violations;
    for (const fs::path& file : sources_below(root / "src"))
        for (const Line& line : read_lines(file)) {
            const std::string code = line.text.substr(0, line.text.find("//"));
            if (std::regex_search(code, option) || std::regex_search(code, command))
                violations.push_back(place(root, file, line.number) +
                                     "speaks of the command line; the library's words must suit any caller");
        }
    return violations;
}

}  // namespace its::structure
