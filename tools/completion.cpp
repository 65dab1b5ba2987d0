// SPDX-License-Identifier: MIT
// `hal completion SHELL`: a completion script, made from the table of subcommands.
#include "completion.hpp"

#include <algorithm>
#include <fmt/core.h>
#include <iterator>

#include "classic_commands.hpp"
#include "cli/output.hpp"
#include "command_line.hpp"
#include "text/quoting.hpp"

namespace hal::tools {

namespace {

/// Replaces each occurrence.
void replace(std::string& text, std::string_view what, std::string_view by) {
    for (std::size_t at = 0; (at = text.find(what, at)) != text.npos; at += by.size()) {
        text.replace(at, what.size(), by);
    }
}

// --- bash ---------------------------------------------------------------------------------------

constexpr std::string_view bash_script =
    R"BASH(# bash completion of hal; use it with: source <(hal completion bash)
_hal_names() {
    local command
    for command in getp gets; do
        COMP_LINE="halcmd $command $1" COMP_POINT='' hal completion words 2>/dev/null
    done
}
_hal() {
    local word=${COMP_WORDS[COMP_CWORD]} options='' IFS=$' \t\n'
    local commands='@COMMANDS@'
    if [ "$COMP_CWORD" -eq 1 ]; then
        COMPREPLY=($(compgen -W "$commands" -- "$word"))
        return
    fi
    if [[ $word == -* ]]; then
        case ${COMP_WORDS[1]} in
@OPTIONS@        esac
        COMPREPLY=($(compgen -W "$options" -- "$word"))
        return
    fi
    case ${COMP_WORDS[1]} in
        help) COMPREPLY=($(compgen -W "$commands" -- "$word")) ;;
        doc | explain) COMPREPLY=($(compgen -W "$(hal "${COMP_WORDS[1]}" | cut -d ' ' -f 1)" -- "$word")) ;;
        shell) COMPREPLY=($(COMP_LINE="halcmd ${COMP_WORDS[*]:2:COMP_CWORD-1}" COMP_POINT='' hal completion words 2>/dev/null)) ;;
        scope | watch | meter) COMPREPLY=($(_hal_names "$word")) ;;
        record)
            if [ "$COMP_CWORD" -eq 2 ]; then compopt -o default 2>/dev/null
            else COMPREPLY=($(_hal_names "$word")); fi ;;
        new) COMPREPLY=($(compgen -W component -- "$word")) ;;
        completion) COMPREPLY=($(compgen -W '@SHELLS@' -- "$word")) ;;
@GROUPS@        *) compopt -o default 2>/dev/null ;;
    esac
}
complete -F _hal hal
complete -C 'halcmd -C' halcmd
)BASH";

template <class Word>
std::string joined(const std::vector<Word>& all) {
    std::string text;
    for (const Word& one : all) {
        append_item(text, one.name, " ");
    }
    return text;
}

std::string for_bash(const std::vector<CompletionEntry>& entries) {
    std::string commands = "help";
    std::string options;
    std::string groups;
    for (const CompletionEntry& entry : entries) {
        append_item(commands, entry.name, " ");
        options +=
            fmt::format("            {}) options='{}' ;;\n", entry.name, joined(entry.options));
        if (entry.words.empty()) continue;
        groups += fmt::format(
            "        {}) if [ \"$COMP_CWORD\" -eq 2 ]; then COMPREPLY=($(compgen -W '{}' -- "
            "\"$word\")); "
            "else compopt -o default 2>/dev/null; fi ;;\n",
            entry.name, joined(entry.words));
    }
    std::string text(bash_script);
    replace(text, "@COMMANDS@", commands);
    replace(text, "@OPTIONS@", options);
    replace(text, "@GROUPS@", groups);
    return text;
}

// --- zsh ----------------------------------------------------------------------------------------

constexpr std::string_view zsh_script =
    R"ZSH(#compdef hal halcmd
# zsh completion of hal; a file _hal in a folder of fpath, or: source <(hal completion zsh)
_hal_lines() {
    local -a lines
    lines=(${(f)"$(COMP_LINE="$1" COMP_POINT='' hal completion words 2>/dev/null)"})
    compadd -a lines
}
_hal_names() {
    _hal_lines "halcmd getp $PREFIX"
    _hal_lines "halcmd gets $PREFIX"
}
_hal() {
    local -a commands options group listed
    if [[ $service == halcmd ]]; then
        _hal_lines "${words[1,CURRENT]}"
        return
    fi
    commands=(
        'help:print the help of a command'
@COMMANDS@    )
    if ((CURRENT == 2)); then
        _describe -V command commands
        return
    fi
    if [[ $PREFIX == -* ]]; then
        case $words[2] in
@OPTIONS@        esac
        _describe -V -o option options
        return
    fi
    case $words[2] in
        help) _describe -V command commands ;;
        doc | explain)
            listed=(${(f)"$(hal $words[2] | cut -d ' ' -f 1)"})
            compadd -a listed ;;
        shell) _hal_lines "halcmd ${words[3,CURRENT]}" ;;
        scope | watch | meter) _hal_names ;;
        record) if ((CURRENT == 3)); then _files; else _hal_names; fi ;;
        new) compadd component ;;
        completion) compadd @SHELLS@ ;;
@GROUPS@        *) _files ;;
    esac
}
if [[ $funcstack[1] == _hal ]]; then _hal "$@"; else compdef _hal hal halcmd; fi
)ZSH";

/// An item of _describe: the colon ends the name, and the whole is in single quotes.
std::string zsh_item(const CompletionWord& word) {
    std::string name = word.name;
    replace(name, ":", "\\:");
    std::string text = name + ":" + word.text;
    replace(text, "'", "'\\''");
    return "'" + text + "'";
}

template <class Word>
std::string zsh_items(const std::vector<Word>& words) {
    std::string text;
    for (const Word& word : words) {
        append_item(text, zsh_item(word), " ");
    }
    return text;
}

std::string for_zsh(const std::vector<CompletionEntry>& entries) {
    std::string commands;
    std::string options;
    std::string groups;
    for (const CompletionEntry& entry : entries) {
        commands += fmt::format("        {}\n", zsh_item({entry.name, entry.text}));
        options +=
            fmt::format("            {}) options=({}) ;;\n", entry.name, zsh_items(entry.options));
        if (entry.words.empty()) continue;
        groups += fmt::format(
            "        {})\n            if ((CURRENT == 3)); then\n                group=({})\n"
            "                _describe -V command group\n            else _files; fi ;;\n",
            entry.name, zsh_items(entry.words));
    }
    std::string text(zsh_script);
    replace(text, "@COMMANDS@", commands);
    replace(text, "@OPTIONS@", options);
    replace(text, "@GROUPS@", groups);
    return text;
}

// --- fish ---------------------------------------------------------------------------------------

constexpr std::string_view fish_script =
    R"FISH(# fish completion of hal; a file hal.fish in a folder completions, or: hal completion fish | source
function __hal_lines
    env COMP_LINE="$argv" COMP_POINT= hal completion words 2>/dev/null
end
function __hal_names
    __hal_lines halcmd getp (commandline -ct)
    __hal_lines halcmd gets (commandline -ct)
end
function __hal_word
    set -l typed (commandline -opc)
    test (count $typed) -eq $argv[1]; and contains -- "$typed[2]" $argv[2..]
end
function __hal_after
    set -l typed (commandline -opc)
    test (count $typed) -ge $argv[1]; and contains -- "$typed[2]" $argv[2..]
end
complete -c hal -n 'test (count (commandline -opc)) -eq 1' -f -a help -d 'print the help of a command'
@COMMANDS@complete -c hal -n '__hal_after 2 help' -f -a '@NAMES@'
complete -c hal -n '__hal_after 2 doc' -f -a '(hal doc | string split -f 1 " ")'
complete -c hal -n '__hal_after 2 explain' -f -a '(hal explain | string split -f 1 " ")'
complete -c hal -n '__hal_after 2 shell' -f -a '(__hal_lines halcmd (commandline -opc)[3..] (commandline -ct))'
complete -c hal -n '__hal_after 2 scope watch meter' -f -a '(__hal_names)'
complete -c hal -n '__hal_after 3 record' -f -a '(__hal_names)'
complete -c hal -n '__hal_word 2 new' -f -a component
complete -c hal -n '__hal_word 2 completion' -f -a '@SHELLS@'
complete -c halcmd -f -a '(__hal_lines (commandline -opc) (commandline -ct))'
)FISH";

std::string fish_quoted(std::string text) {
    replace(text, "\\", "\\\\");
    replace(text, "'", "\\'");
    return "'" + text + "'";
}

/// `--for` is long, `-N` short.
std::string fish_option(const std::string& command, const CompletionOption& option) {
    const bool is_long = option.name.starts_with("--");
    const char* const kind = is_long ? "-l" : "-s";
    const std::string name = option.name.substr(is_long ? 2 : 1);
    const char* const value = option.takes_value ? " -r" : "";
    return fmt::format("complete -c hal -n '__hal_after 2 {}' {} {}{} -d {}\n", command, kind, name,
                       value, fish_quoted(option.text));
}

std::string for_fish(const std::vector<CompletionEntry>& entries) {
    std::string lines;
    std::string names;
    for (const CompletionEntry& entry : entries) {
        append_item(names, entry.name, " ");
        lines += fmt::format(
            "complete -c hal -n 'test (count (commandline -opc)) -eq 1' -f -a {} -d {}\n",
            entry.name, fish_quoted(entry.text));
        for (const CompletionWord& word : entry.words) {
            lines += fmt::format("complete -c hal -n '__hal_word 2 {}' -f -a {} -d {}\n",
                                 entry.name, word.name, fish_quoted(word.text));
        }
        for (const CompletionOption& option : entry.options) {
            lines += fish_option(entry.name, option);
        }
    }
    std::string text(fish_script);
    replace(text, "@COMMANDS@", lines);
    replace(text, "@NAMES@", names);
    return text;
}

// --- the table of shells ------------------------------------------------------------------------

struct Shell {
    const char* name;
    std::string (*write)(const std::vector<CompletionEntry>& entries);
};

constexpr Shell shells[] = {{"bash", for_bash}, {"zsh", for_zsh}, {"fish", for_fish}};

std::string names_of_shells(std::string_view separator) {
    std::string names;
    for (const Shell& shell : shells) {
        append_item(names, shell.name, separator);
    }
    return names;
}

}  // namespace

int run_completion(const CompletionOptions& options) {
    const std::string name = options.words.size() == 1 ? options.words.front() : "";
    if (name == "words") return complete_word();  // for the scripts
    const auto* const shell = std::find_if(std::begin(shells), std::end(shells),
                                           [&](const Shell& one) { return name == one.name; });
    if (shell == std::end(shells)) {
        return fail(options,
                    fmt::format("unsupported shell; type: hal completion SHELL with one of {}",
                                names_of_shells(", ")));
    }
    std::string text = shell->write(completions());
    replace(text, "@SHELLS@", names_of_shells(" "));
    return exit_code(print(text));
}

}  // namespace hal::tools
