// SPDX-License-Identifier: MIT
// One function per rule about a whole file.
#include <algorithm>
#include <fmt/format.h>
#include <map>

#include "comp/syntax.hpp"
#include "text/characters.hpp"

namespace hal::comp {
namespace {

struct Checking {
    const Tree& tree;
    std::string_view path, code;
    Diagnostics& found;
    Span first;  // the beginning of the file, for what is missing

    void error(Span at, std::string message, std::string label = "", std::string help = "") const {
        found.error("bad-component-source", at, std::move(message), std::move(label),
                    std::move(help));
    }
};

void component_has_the_files_name(const Checking& c) {
    if (!c.tree.name.given()) {
        return c.error(c.first, "missing component declaration", "",
                       "begin it with: component NAME \"what it does\";");
    }
    std::string_view file = c.path.substr(c.path.rfind('/') + 1);
    file = file.substr(0, file.rfind(".comp"));
    if (!c.path.ends_with(".comp") || file == c.tree.name.text) return;
    const bool word =
        file.find_first_not_of("abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ_0123456789") ==
        std::string_view::npos;
    c.error(
        c.tree.name.span,
        "component '" + c.tree.name.text + "' is declared in file '" + std::string(file) + ".comp'",
        "",
        "name the file " + c.tree.name.text + ".comp" +
            (word ? ", or the component " + std::string(file) : ""));
}

void license_is_given(const Checking& c) {
    if (c.tree.license.empty()) {
        c.error(c.tree.name.given() ? c.tree.name.span : c.first, "missing license declaration", "",
                "add: license \"GPL\";");
    }
}

// The two name spaces of a netlist that a component's names go into.
void netlist_names_differ(const Checking& c) {
    std::map<std::string, Span> items, functions;
    const auto claim = [&](std::map<std::string, Span>& names, const std::string& name, Span at) {
        const auto [other, added] = names.emplace(name, at);
        if (added || other->second.begin == at.begin) return;
        c.found.add({Severity::error,
                     "bad-component-source",
                     "duplicate name '" + name + "'",
                     {{at, "again"}, {other->second, "first"}},
                     {"in netlists _ becomes -, and a - or . at the end is dropped"}});
    };
    for (const Item& item : c.tree.items) {
        if (item.size == 0) {
            claim(items, item.name.hal, item.name.span);
        } else {
            for (unsigned i = 0; i < item.size; ++i) {
                claim(items, numbered(item.name.hal, i), item.name.span);
            }
        }
    }
    for (const Function& function : c.tree.functions) {
        claim(functions, function.name.hal, function.name.span);
        for (const char* time : {"time", "tmax", "tmax-increased"}) {
            claim(items, function.name.hal.empty() ? time : function.name.hal + "." + time,
                  function.name.span);
        }
    }
}

void c_names_differ(const Checking& c) {
    static constexpr const char* reserved[] = {"comp_id",        "fperiod",     "rtapi_app_main",
                                               "rtapi_app_exit", "extra_setup", "extra_cleanup",
                                               "post_export"};
    static constexpr const char* keywords[] = {
        "auto",    "break",  "case",     "char",   "const",    "continue", "default",
        "do",      "double", "else",     "enum",   "extern",   "float",    "for",
        "goto",    "if",     "inline",   "int",    "long",     "register", "restrict",
        "return",  "short",  "signed",   "sizeof", "static",   "struct",   "switch",
        "typedef", "union",  "unsigned", "void",   "volatile", "while"};
    std::map<std::string, Span> names;
    const auto claim = [&](const Name& name) {
        const bool keyword =
            std::find(std::begin(keywords), std::end(keywords), name.c) != std::end(keywords);
        if (keyword || name.c.starts_with("__comp_") ||
            std::find(std::begin(reserved), std::end(reserved), name.c) != std::end(reserved)) {
            return c.error(name.span, "invalid C name '" + name.c + "'",
                           keyword ? "a C keyword" : "reserved for code that hal compile adds",
                           "append '_', which keeps the name in netlists: " + name.text + "_");
        }
        if (name.c.empty() || is_digit(name.c[0])) {
            return c.error(name.span, "invalid C name '" + name.text + "'");
        }
        const auto [other, added] = names.emplace(name.c, name.span);
        if (added) return;
        c.found.add({Severity::error,
                     "bad-component-source",
                     "duplicate C name '" + name.c + "'",
                     {{name.span, "second"}, {other->second, "first"}},
                     {}});
    };
    for (const Item& item : c.tree.items) {
        claim(item.name);
    }
    for (const Function& function : c.tree.functions) {
        claim(function.name);
    }
    for (const Variable& variable : c.tree.variables) {
        claim(variable.name);
    }
}

void arrays_have_their_hash(const Checking& c) {
    for (const Item& item : c.tree.items) {
        const std::size_t first = item.name.text.find('#');

        const std::size_t behind = item.name.text.find_first_not_of('#', first);
        if (first == std::string::npos && item.size != 0) {
            c.error(item.name.span,
                    "the element names of array '" + item.name.text +
                        "' have no placeholder for the number",
                    "", "write " + item.name.text + "-#");
        } else if (first != std::string::npos && item.size == 0) {
            c.error(item.name.span,
                    "'" + item.name.text + "' has a placeholder for a number but is not an array",
                    "", "give its size: " + item.name.text + "[4]");
        } else if (first != std::string::npos && behind != std::string::npos &&
                   item.name.text.find('#', behind) != std::string::npos) {
            c.error(item.name.span, "'" + item.name.text + "' has two placeholders for one number");
        }
    }
}

void expressions_know_the_personality_only(const Checking& c) {
    const auto look = [&](const Text& expression) {
        for (std::size_t i = 0; i < expression.text.size(); ++i) {
            const auto letter = [&](std::size_t at) {
                return at < expression.text.size() &&
                       (std::isalnum(static_cast<unsigned char>(expression.text[at])) ||
                        expression.text[at] == '_');
            };
            if (!letter(i)) continue;
            std::size_t end = i;
            while (letter(end)) {
                ++end;
            }
            const std::string word = expression.text.substr(i, end - i);
            if (!std::isdigit(static_cast<unsigned char>(word[0])) && word != "personality") {
                return c.error(expression.span,
                               "a condition consists of numbers and 'personality'; unknown name '" +
                                   word + "'",
                               "", "for instance: if personality & 0x100");
            }
            i = end;
        }
    };
    for (const Item& item : c.tree.items) {
        look(item.condition);
        look(item.count);
    }
}

void ports_have_no_start(const Checking& c) {
    for (const Item& item : c.tree.items) {
        if (item.type == HAL_TYPE_PORT && (item.start.given() || item.parameter)) {
            c.error(
                item.start.given() ? item.start.span : item.name.span,
                item.parameter ? "a parameter cannot be a port" : "a port has no initial value");
        }
    }
}

void functions_are_there(const Checking& c) {
    if (c.tree.has("userspace") && !c.tree.functions.empty()) {
        return c.error(c.tree.functions[0].name.span, "a program cannot have functions for threads",
                       "", "put the code into user_mainloop(), or remove: option userspace");
    }
    const Option* const app = c.tree.option("rtapi_app");
    if (app && !app->on() && find_word(c.code, "rtapi_app_main") == std::string_view::npos) {
        c.error(app->name.span, "this option needs rtapi_app_main() in the C code", "",
                "write: int rtapi_app_main(void) { … export(\"name\", 0) … }");
    }
    if (!c.tree.code.known() && !c.tree.functions.empty()) {
        return c.error(c.tree.functions[0].name.span, "missing C code of the functions", "",
                       "write it after a line that consists of ;;");
    }
    if (implicit_function(c.tree, c.code)) return;
    for (const Function& function : c.tree.functions) {
        bool there = false;
        for (std::size_t at = 0;
             !there && (at = find_word(c.code, "FUNCTION", at)) != std::string_view::npos;
             at += 8) {
            const std::size_t open = c.code.find_first_not_of(" \t", at + 8);
            if (open == std::string_view::npos || c.code[open] != '(') {
                continue;
            }
            const std::string_view inside =
                c.code.substr(open + 1, std::min(c.code.find(')', open), c.code.size()) - open - 1);
            there = find_word(inside, function.name.c) != std::string_view::npos;
        }
        if (!there) {
            c.error(function.name.span,
                    "the C code does not define function '" + function.name.text + "'", "",
                    "write: FUNCTION(" + function.name.c + ") { … }");
        }
    }
}

// An option that calls something needs the something, and the other way round.
void hooks_are_there(const Checking& c) {
    struct Hook {
        const char *option, *word, *text;
    };
    for (const Hook& hook :
         {Hook{"extra_setup", "EXTRA_SETUP", "EXTRA_SETUP() { … return 0; }"},
          Hook{"extra_cleanup", "EXTRA_CLEANUP", "EXTRA_CLEANUP() { … }"},
          Hook{"post_export", "POST_EXPORT", "POST_EXPORT() { … return 0; }"},
          Hook{"count_function", "get_count", "int get_count(void) { … }"},
          Hook{"userspace", "user_mainloop", "void user_mainloop(void) { for (;;) { … } }"},
          Hook{"userinit", "userinit", "void userinit(int argc, char **argv) { … }"}}) {
        const std::size_t at = find_word(c.code, hook.word);
        const bool there = at != std::string_view::npos;
        if (c.tree.has(hook.option) && !there) {
            c.error(c.tree.option(hook.option)->name.span,
                    "the C code has no " + std::string(hook.word) + " for this option", "",
                    "write: " + std::string(hook.text));
        }
        if (!c.tree.has(hook.option) && there &&
            std::string_view(hook.option) != "count_function") {
            const auto begin = static_cast<std::uint32_t>(c.tree.code.begin + at);
            const Span span{c.tree.code.source, begin,
                            begin + static_cast<std::uint32_t>(std::string_view(hook.word).size())};
            c.found.warning("bad-component-source", span, "unused function", "",
                            "declare: option " + std::string(hook.option) + ";");
        }
    }
}

void options_are_known(const Checking& c) {
    static const std::vector<std::string> known{"singleton",
                                                "default_count",
                                                "count_function",
                                                "rtapi_app",
                                                "data",
                                                "extra_setup",
                                                "extra_cleanup",
                                                "post_export",
                                                "userspace",
                                                "userinit",
                                                "extra_link_args",
                                                "extra_compile_args",
                                                "constructable",
                                                "no_convenience_defines",
                                                "default_personality",
                                                "personality",
                                                "homemod",
                                                "tpmod",
                                                "period"};
    for (const Option& option : c.tree.options) {
        if (std::find(known.begin(), known.end(), option.name.text) == known.end()) {
            std::string help = did_you_mean(option.name.text, known);
            c.found.warning("bad-component-source", option.name.span,
                            "option '" + option.name.text + "' has no effect here", "",
                            help.empty() ? "options: " + listed(known, known.size()) : help);
        }
    }
}

void numbers_are_numbers(const Checking& c) {
    for (const char* name : {"default_count", "default_personality"}) {
        const Option* const option = c.tree.option(name);
        if (!option) continue;
        const std::string& text = option->value.text;
        const bool hex = text.starts_with("0x") && std::string_view(name) == "default_personality";
        const std::string digits = hex ? text.substr(2) : text;
        if (digits.empty() || digits.size() > 8 ||
            digits.find_first_not_of(hex ? "0123456789abcdefABCDEF" : "0123456789") !=
                std::string::npos) {
            c.error(option->value.given() ? option->value.span : option->name.span,
                    "option " + std::string(name) + " takes a whole number");
        }
    }
}

// Unsupported options; the help of each names the alternative.
void features_are_supported(const Checking& c) {
    const auto reject = [&](const char* option, bool asked, std::string why, std::string help) {
        if (asked) {
            c.found.error("unsupported-component", c.tree.option(option)->name.span, std::move(why),
                          "", std::move(help));
        }
    };
    const std::string name = c.tree.name.text;
    const auto compiled = [&](const char* key, const char* option) {
        return fmt::format(
            "a compiled module works: build this file with LinuxCNC's own halcompile --install "
            "(package linuxcnc-uspace-dev), then write {} = {} in the "
            "INI file, or type: hal linuxcnc {} {} FILE.ini",
            key, name, option, name);
    };
    reject("homemod", c.tree.has("homemod"),
           "a homing module includes sources of LinuxCNC's motion controller, and cannot be "
           "compiled here",
           compiled("[EMCMOT]HOMEMOD", "-m"));
    reject("tpmod", c.tree.has("tpmod"),
           "a trajectory planner includes sources of LinuxCNC's motion controller, and cannot be "
           "compiled here",
           compiled("[TRAJ]TPMOD", "-t"));
}

}  // namespace

void check(const Tree& tree, const Sources& sources, std::uint32_t source,
           Diagnostics& diagnostics) {
    const Checking c{tree,
                     sources.get(source).name,
                     tree.code.known() ? sources.text(tree.code) : std::string_view(),
                     diagnostics,
                     {source, 0, 0}};
    options_are_known(c);
    features_are_supported(c);
    if (diagnostics.failed()) return;
    component_has_the_files_name(c);
    license_is_given(c);
    arrays_have_their_hash(c);
    c_names_differ(c);
    netlist_names_differ(c);
    expressions_know_the_personality_only(c);
    ports_have_no_start(c);
    numbers_are_numbers(c);
    functions_are_there(c);
    hooks_are_there(c);
}

}  // namespace hal::comp
