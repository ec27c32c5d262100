#include "manual.h"

#include <fmt/core.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cstdio>
#include <string_view>
#include <vector>

#include "its/version.h"

namespace its::cli {
namespace {

/// An option as shells see it.
struct Word {
    std::vector<std::string> names;    ///< "-o", "--output"; of a positional argument, its name
    std::string type;                  ///< what a value is called; empty for a flag
    std::vector<std::string> choices;  ///< all values that there are, or none
    std::string text;                  ///< description, in one line
    bool positional = false;

    bool takes_file() const {
        return choices.empty() &&
               std::any_of(std::begin(file_types), std::end(file_types),
                           [&](const char* name) { return type.find(name) != std::string::npos; });
    }

    static constexpr const char* file_types[] = {"OUT", "MESH", "SHELL", "POINTS", "FILE", "TEXT"};
};

std::string in_one_line(std::string text) {
    std::replace(text.begin(), text.end(), '\n', ' ');
    return text;
}

Word word_of(const CLI::Option& option) {
    Word word;
    word.positional = option.get_snames().empty() && option.get_lnames().empty();
    for (const std::string& name : option.get_snames()) word.names.push_back("-" + name);
    for (const std::string& name : option.get_lnames()) word.names.push_back("--" + name);
    if (word.positional) word.names = {option.get_name(true)};
    if (option.get_items_expected_max() > 0)
        word.type = option.get_type_name().empty() ? "TEXT" : option.get_type_name();
    word.choices = choices_of(option);
    word.text = in_one_line(option.get_description());
    return word;
}

std::vector<Word> words_of(const CLI::App& app) {
    std::vector<Word> words;
    for (const CLI::Option* option : app.get_options()) words.push_back(word_of(*option));
    return words;
}

/// The commands that the help lists.
std::vector<const CLI::App*> commands_of(const CLI::App& app) {
    return app.get_subcommands([](const CLI::App* command) { return !command->get_group().empty(); });
}

std::string replace_all(std::string text, std::string_view old, std::string_view by) {
    for (std::size_t at = text.find(old); at != std::string::npos; at = text.find(old, at + by.size()))
        text.replace(at, old.size(), by);
    return text;
}

/// Text of a manual page: no line of it is taken for a request, and a minus stays one when it is copied.
std::string roff(const std::string& text) {
    return replace_all(replace_all(replace_all("\\&" + text, "\\", "\\e"), "\\e&", "\\&"), "-", "\\-");
}

std::string manual_words(const CLI::App& app) {
    std::string page;
    for (const Word& word : words_of(app)) {
        page += ".TP\n";
        std::string names;
        for (const std::string& name : word.names)
            names += fmt::format("{}\\fB{}\\fR", names.empty() ? "" : ", ", roff(name));
        if (!word.type.empty() && !word.positional) names += fmt::format(" \\fI{}\\fR", roff(word.type));
        page += names + "\n" + roff(word.text) + "\n";
    }
    return page;
}

/// 'text' for the shells' single quotes.
std::string quoted(const std::string& text) {
    return "'" + replace_all(text, "'", "'\\''") + "'";
}

/// The names of all options, and all that the patterns of a case are made of.
std::vector<std::string> option_names(const std::vector<Word>& words) {
    std::vector<std::string> names;
    for (const Word& word : words)
        if (!word.positional) names.insert(names.end(), word.names.begin(), word.names.end());
    return names;
}

/// In zsh's specifications, brackets and colons have meanings of their own.
std::string zsh_text(const std::string& text) {
    return replace_all(replace_all(replace_all(text, "[", "\\["), "]", "\\]"), ":", "\\:");
}

std::string zsh_specification(const Word& word) {
    std::string value;
    if (!word.type.empty()) {
        const std::string action = !word.choices.empty() ? fmt::format("({})", fmt::join(word.choices, " "))
                                   : word.takes_file()   ? "_files"
                                                         : " ";
        value = fmt::format(":{}:{}", zsh_text(word.type), action);
    }
    std::string specification;
    for (const std::string& name : word.names)
        specification += fmt::format(
            " \\\n        {}",
            quoted(fmt::format("({}){}[{}]{}", fmt::join(word.names, " "), name, zsh_text(word.text), value)));
    return specification;
}

std::string fish_option(const std::string& command, const Word& word) {
    std::string line = fmt::format("complete -c its -n '__fish_seen_subcommand_from {}'", command);
    for (const std::string& name : word.names)
        line += name.starts_with("--") ? " -l " + name.substr(2) : " -s " + name.substr(1);
    if (!word.choices.empty())
        line += fmt::format(" -x -a {}", quoted(fmt::format("{}", fmt::join(word.choices, " "))));
    else if (!word.type.empty())
        line += word.takes_file() ? " -r -F" : " -x";
    return line + " -d " + quoted(replace_all(word.text, "\\", "\\\\")) + "\n";
}

}  // namespace

std::string manual_page(const CLI::App& app) {
    std::string page = fmt::format("'\\\" -*- coding: utf-8 -*-\n.TH ITS 1 \"\" \"its " ITS_VERSION
                                   "\" \"User Commands\"\n"
                                   ".SH NAME\nits \\- implicit thin shells of triangle meshes\n"
                                   ".SH SYNOPSIS\n\\fBits\\fR \\fICOMMAND\\fR [\\fIARGUMENT\\fR]...\n"
                                   ".SH DESCRIPTION\n{}\n.SH COMMANDS\n",
                                   roff(app.get_description()));
    for (const CLI::App* command : commands_of(app)) {
        page +=
            fmt::format(".SS \"its {}\"\n{}.\n", roff(command->get_name()), roff(command->get_description()));
        page += manual_words(*command);
        if (!command->get_footer().empty()) page += ".PP\n" + roff(in_one_line(command->get_footer())) + "\n";
    }
    page += ".SH NOTES\n" + roff(in_one_line(app.get_footer())) + "\n";
    return page;
}

std::string bash_completions(const CLI::App& app) {
    std::string names, values, options;
    for (const CLI::App* command : commands_of(app)) {
        const std::vector<Word> words = words_of(*command);
        names += command->get_name() + " ";
        for (const Word& word : words) {
            if (word.positional || word.type.empty()) continue;
            std::string pattern;
            for (const std::string& name : word.names)
                pattern += fmt::format("{}{}:{}", pattern.empty() ? "" : "|", command->get_name(), name);
            values += fmt::format(
                "        {}) {} ;;\n", pattern,
                !word.choices.empty()
                    ? fmt::format("words={}", quoted(fmt::format("{}", fmt::join(word.choices, " "))))
                : word.takes_file() ? "files=1"
                                    : "return");
        }
        options += fmt::format("            {}) words={} ;;\n", command->get_name(),
                               quoted(fmt::format("{}", fmt::join(option_names(words), " "))));
    }
    return fmt::format(R"(# Completions for bash, written by `its completions bash`.
_its() {{
    local word=${{COMP_WORDS[COMP_CWORD]}} before=${{COMP_WORDS[COMP_CWORD - 1]}} words='' files=''
    COMPREPLY=()
    case ${{COMP_WORDS[1]}}:$before in
{}    esac
    if ((COMP_CWORD == 1)); then
        words='{}help --help --version'
    elif [[ -z $words && -z $files && $word == -* ]]; then
        case ${{COMP_WORDS[1]}} in
{}        esac
    elif [[ -z $words ]]; then
        compopt -o default 2>/dev/null
        return
    fi
    mapfile -t COMPREPLY < <(compgen -W "$words" -- "$word")
}}
complete -F _its its
)",
                       values, names, options);
}

std::string zsh_completions(const CLI::App& app) {
    std::string names, cases;
    for (const CLI::App* command : commands_of(app)) {
        names += fmt::format("        {}\n",
                             quoted(command->get_name() + ":" + zsh_text(command->get_description())));
        cases += fmt::format("    {}) _arguments -S", command->get_name());
        for (const Word& word : words_of(*command))
            if (!word.positional) cases += zsh_specification(word);
        cases += " \\\n        '*:file:_files' ;;\n";
    }
    return fmt::format(R"(#compdef its
# Completions for zsh, written by `its completions zsh`.
_its() {{
    local -a commands=(
{}    )
    if ((CURRENT == 2)); then
        _describe command commands
        return
    fi
    shift words
    ((CURRENT--))
    case $words[1] in
{}    esac
}}
_its "$@"
)",
                       names, cases);
}

std::string fish_completions(const CLI::App& app) {
    std::string text = "# Completions for fish, written by `its completions fish`.\n";
    for (const CLI::App* command : commands_of(app)) {
        text += fmt::format("complete -c its -n __fish_use_subcommand -f -a {} -d {}\n", command->get_name(),
                            quoted(command->get_description()));
        for (const Word& word : words_of(*command))
            if (!word.positional) text += fish_option(command->get_name(), word);
    }
    return text;
}

Action add_manual(CLI::App& app) {
    CLI::App* const man = app.add_subcommand("man", "Print the manual page")->group("");
    CLI::App* const completions = app.add_subcommand("completions", "Print a shell's completions")->group("");
    using Writer = std::string (*)(const CLI::App&);
    const auto writer = std::make_shared<Writer>(manual_page);
    add_choice<Writer>(*completions, "SHELL",
                       {{"bash", bash_completions}, {"zsh", zsh_completions}, {"fish", fish_completions}},
                       *writer, "Which")
        ->required();
    return [&app, man, completions, writer] {
        if (man->parsed() || completions->parsed()) fmt::print("{}", (*writer)(app));
        return done;
    };
}

}  // namespace its::cli
