// SPDX-License-Identifier: MIT
// `hal completion bash`: a completion script, made from the table of subcommands.
#include "completion.hpp"

#include <fmt/core.h>

#include "cli/output.hpp"
#include "command_line.hpp"
#include "text/quoting.hpp"

namespace hal::tools {

namespace {

constexpr std::string_view script =
    R"BASH(# bash completion of hal; use it with: source <(hal completion bash)
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
        shell) COMPREPLY=($(COMP_LINE="halcmd ${COMP_WORDS[*]:2:COMP_CWORD-1}" COMP_POINT='' halcmd -C 2>/dev/null)) ;;
        new) COMPREPLY=($(compgen -W component -- "$word")) ;;
        completion) COMPREPLY=($(compgen -W bash -- "$word")) ;;
@GROUPS@        *) compopt -o default 2>/dev/null ;;
    esac
}
complete -F _hal hal
complete -C 'halcmd -C' halcmd
)BASH";

void replace(std::string& text, std::string_view what, std::string_view by) {
    text.replace(text.find(what), what.size(), by);
}

}  // namespace

int run_completion(const CompletionOptions& options) {
    if (options.words != std::vector<std::string>{"bash"}) {
        return fail(options, "unsupported shell; type: hal completion bash");
    }
    std::string commands = "help", cases, groups;
    for (const CompletionEntry& completion : completions()) {
        commands += " " + completion.name;
        std::string all;
        for (const std::string& option : completion.options) {
            append_item(all, option, " ");
        }
        cases += fmt::format("            {}) options='{}' ;;\n", completion.name, all);
        if (completion.words.empty()) continue;
        std::string words;
        for (const std::string& word : completion.words) {
            append_item(words, word, " ");
        }
        groups += fmt::format(
            "        {}) if [ \"$COMP_CWORD\" -eq 2 ]; then COMPREPLY=($(compgen -W '{}' -- "
            "\"$word\")); "
            "else compopt -o default 2>/dev/null; fi ;;\n",
            completion.name, words);
    }
    std::string text(script);
    replace(text, "@COMMANDS@", commands);
    replace(text, "@OPTIONS@", cases);
    replace(text, "@GROUPS@", groups);
    return exit_code(print(text));
}

}  // namespace hal::tools
