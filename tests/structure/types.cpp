#include <fmt/core.h>

#include <algorithm>
#include <cctype>
#include <fstream>
#include <map>
#include <sstream>

#include "structure/structure.h"

namespace its::structure {
namespace {

namespace fs = std::filesystem;

/// A word of C++ or a single sign, and the line it stands on.
struct Token {
    std::string text;
    int line;
};

bool is_word(char c) {
    return std::isalnum(static_cast<unsigned char>(c)) != 0 || c == '_';
}

/// Comments, literals and lines of the preprocessor are left out.
std::vector<Token> tokens_of(const fs::path& file) {
    std::ostringstream stream;
    stream << std::ifstream(file).rdbuf();
    const std::string text = stream.str();
    std::vector<Token> tokens;
    int line = 1;
    bool line_is_empty = true;
    const auto skip_to = [&](std::size_t from, std::size_t to) {
        to = std::min(to, text.size());
        line += static_cast<int>(
            std::count(text.begin() + std::ptrdiff_t(from), text.begin() + std::ptrdiff_t(to), '\n'));
        return to;
    };
    for (std::size_t i = 0; i < text.size();) {
        const char c = text[i];
        if (c == '\n') {
            line_is_empty = true;
            i = skip_to(i, i + 1);
        } else if (std::isspace(static_cast<unsigned char>(c)) != 0) {
            ++i;
        } else if (text.compare(i, 2, "//") == 0 || (c == '#' && line_is_empty)) {
            std::size_t end = text.find('\n', i);
            while (c == '#' && end != std::string::npos && text[end - 1] == '\\')
                end = text.find('\n', end + 1);
            i = skip_to(i, end);
        } else if (text.compare(i, 2, "/*") == 0) {
            i = skip_to(i, text.find("*/", i + 2) + 2);
        } else if (text.compare(i, 2, "R\"") == 0) {
            const std::string end = fmt::format("){}\"", text.substr(i + 2, text.find('(', i) - i - 2));
            i = skip_to(i, text.find(end, i) + end.size());
        } else if (c == '"' || (c == '\'' && (i == 0 || !is_word(text[i - 1])))) {
            std::size_t end = i + 1;
            while (end < text.size() && text[end] != c) end += text[end] == '\\' ? 2 : 1;
            i = skip_to(i, end + 1);
        } else {
            std::size_t end = i + 1;
            if (is_word(c))
                while (end < text.size() && (is_word(text[end]) || text[end] == '\'')) ++end;
            tokens.push_back({text.substr(i, end - i), line});
            line_is_empty = false;
            i = end;
        }
    }
    return tokens;
}

/// A type that is defined, or a namespace that is opened, outside of functions and other types.
struct Definition {
    std::string space;  ///< "its::octree"; an anonymous namespace is "its::octree::"
    std::string name;   ///< of a type; empty for a namespace
    int line;
};

class Parser {
public:
    explicit Parser(const fs::path& file) : tokens_(tokens_of(file)) {}

    std::vector<Definition> definitions() {
        for (at_ = 0; at_ < tokens_.size(); ++at_) {
            const std::string& text = tokens_[at_].text;
            if (text == "}" && !open_.empty()) {
                open_.pop_back();
            } else if (text == "{") {
                open_.emplace_back("{");
            } else if (in_namespace()) {
                if (text == "namespace") open_namespace();
                if (text == "struct" || text == "class" || text == "enum" || text == "union") define_type();
                if (text == "using" && word(2) == "=") add(word(1));
            }
        }
        return found_;
    }

private:
    std::string word(std::size_t ahead) const {
        return at_ + ahead < tokens_.size() ? tokens_[at_ + ahead].text : "";
    }
    bool in_namespace() const { return std::find(open_.begin(), open_.end(), "{") == open_.end(); }
    void add(const std::string& name) {
        std::string space;
        for (const std::string& part : open_) space += fmt::format("{}{}", space.empty() ? "" : "::", part);
        found_.push_back({space, name, tokens_[at_].line});
    }

    /// Not of aliases: namespace fs = …
    void open_namespace() {
        std::string name;
        std::size_t ahead = 1;
        for (; word(ahead) != "{"; ++ahead) {
            if (word(ahead) == "=" || word(ahead) == ";" || word(ahead).empty()) return;
            if (word(ahead) != "ITS_API") name += word(ahead);
        }
        at_ += ahead;
        open_.push_back(name);
        add("");
    }

    /// A definition's name is followed by {, by a base or by final; a specialisation's by <, and is none.
    void define_type() {
        const bool is_template_parameter =
            at_ > 0 && (tokens_[at_ - 1].text == "<" || tokens_[at_ - 1].text == ",");
        const std::size_t name = word(1) == "class" || word(1) == "struct" ? 2 : 1;
        const std::string after = word(name + 1);
        const bool is_scope = after == ":" && word(name + 2) == ":";
        if (!is_template_parameter && !is_scope && (after == "{" || after == ":" || after == "final"))
            add(word(name));
        at_ += name;
    }

    std::vector<Token> tokens_;
    std::size_t at_ = 0;
    std::vector<std::string> open_;  ///< names of namespaces, and "{" for other braces
    std::vector<Definition> found_;
};

/// The namespace of a module's private code. Modules whose name is that of a public function have another.
std::string namespace_of(const std::string& module) {
    static const std::map<std::string, std::string> others = {{"inspect", "its::inspector"},
                                                              {"simplify", "its::simplifier"},
                                                              {"verify", "its::verifier"},
                                                              {"wrap", "its::wrapper"}};
    const auto found = others.find(module);
    return found == others.end() ? fmt::format("its::{}", module) : found->second;
}

bool is_within(const std::string& space, const std::string& outer) {
    return space == outer || space.starts_with(outer + "::");
}

/// What is wrong with the place of a definition in src/, or nothing. base and vectors are every module's.
std::string judge_place(const fs::path& file, const std::string& module, const Definition& definition) {
    if (module == "base" || file.filename() == "vec3.h") return "";
    const std::string own = namespace_of(module);
    const bool anonymous = definition.space.empty() || definition.space.ends_with("::");
    if (is_within(definition.space, own) || anonymous) return "";
    if (!definition.name.empty())
        return fmt::format("{}::{} is private and belongs into {}", definition.space, definition.name, own);
    if (file.extension() == ".h")
        return fmt::format("opens namespace {}; private headers of {} are in {}", definition.space, module,
                           own);
    return "";
}

}  // namespace

Violations check_types(const fs::path& root) {
    Violations violations;
    std::map<std::string, std::string> first;  // place of each type
    for (const char* const folder : {"include/its", "src"}) {
        if (!fs::exists(root / folder)) continue;
        std::vector<fs::path> files;
        for (const auto& entry : fs::recursive_directory_iterator(root / folder))
            if (entry.path().extension() == ".h" || entry.path().extension() == ".cpp")
                files.push_back(entry.path());
        std::sort(files.begin(), files.end());
        for (const fs::path& file : files) {
            const std::string name = fs::relative(file, root).string();
            const std::string module =
                folder == std::string("src") ? name.substr(4, name.find('/', 4) - 4) : "";
            for (const Definition& definition : Parser(file).definitions()) {
                const std::string place = fmt::format("{}:{}: ", name, definition.line);
                const std::string wrong = module.empty() ? "" : judge_place(file, module, definition);
                if (!wrong.empty()) violations.push_back(place + wrong);
                // Of anonymous namespaces, and within one file, the compiler sees to it.
                if (definition.name.empty() || definition.space.ends_with("::")) continue;
                const std::string type = definition.space + "::" + definition.name;
                const auto [earlier, is_new] = first.try_emplace(type, place);
                if (!is_new && !earlier->second.starts_with(name + ":"))
                    violations.push_back(fmt::format("{}{} is defined a second time; first at {}", place, type,
                                                     earlier->second));
            }
        }
    }
    return violations;
}

}  // namespace its::structure
