// SPDX-License-Identifier: MIT
#include "netlist/usage.hpp"

#include <algorithm>
#include <cstdint>
#include <unordered_map>

#include "text/quoting.hpp"

namespace hal {
namespace {

constexpr std::string_view between_forms = " | ";

std::vector<std::string_view> forms_of(std::string_view arguments) {
    std::vector<std::string_view> forms;
    for (std::size_t at; (at = arguments.find(between_forms)) != arguments.npos;
         arguments.remove_prefix(at + between_forms.size())) {
        forms.push_back(arguments.substr(0, at));
    }
    forms.push_back(arguments);
    return forms;
}

std::vector<UsageWord> words_of(std::string_view text) {
    std::vector<UsageWord> words;
    std::size_t at = 0;
    while (at < text.size()) {
        if (text[at] == ' ') {
            ++at;
            continue;
        }
        // A bracket may hold a blank: "[-t TYPE]" is one optional group of two words.
        const bool optional = text[at] == '[';
        auto end = optional ? text.find(']', at) : text.find(' ', at);
        if (end == text.npos) {
            end = text.size();
        }
        const std::size_t inner_begin = optional ? at + 1 : at;
        std::string_view inner = text.substr(inner_begin, end - inner_begin);
        if (optional) {
            ++end;
        }
        bool repeats = false;
        if (text.substr(end).starts_with("...")) {
            repeats = true;
            end += 3;
        }
        if (inner.ends_with("...")) {
            repeats = true;
            inner.remove_suffix(3);
        }
        for (std::size_t begin = 0; begin <= inner.size();) {
            const auto blank = std::min(inner.find(' ', begin), inner.size());
            words.push_back({inner.substr(begin, blank - begin), optional, repeats, begin > 0});
            begin = blank + 1;
        }
        at = end;
    }
    return words;
}

}  // namespace

std::string to_string(const Usage& usage) {
    std::string text;
    for (const std::string_view form : forms_of(usage.arguments)) {
        if (!text.empty()) {
            text += ", or ";
        }
        text += usage.name;
        if (!form.empty()) {
            (text += ' ') += form;
        }
    }
    return text;
}

const std::vector<std::vector<UsageWord>>& usage_forms(std::string_view arguments) {
    // each command of a file asks
    thread_local std::unordered_map<std::string_view, std::vector<std::vector<UsageWord>>> known;
    auto at = known.find(arguments);
    if (at == known.end()) {
        std::vector<std::vector<UsageWord>> forms;  // whole before it is known: memory may run out
        for (const std::string_view form : forms_of(arguments)) {
            forms.push_back(words_of(form));
        }
        at = known.emplace(arguments, std::move(forms)).first;
    }
    return at->second;
}

namespace {

/// Returns what to type in place of `NAME = VALUE` or `NAME=VALUE`; empty for any other arguments.
std::string without_equals_sign(std::string_view command, std::span<const Token> args) {
    std::string_view name;
    std::string_view value;
    if (args.size() == 3 && args[1].text == "=") {
        name = args[0].text;
        value = args[2].text;
    } else if (args.size() == 1) {
        const std::string_view text = args[0].text;
        const auto at = std::min(text.find('='), text.size());
        name = text.substr(0, at);
        value = text.substr(std::min(at + 1, text.size()));
    }
    if (name.empty() || value.empty()) return {};
    return "write it without '=': " + std::string(command) + " " + std::string(name) + " " +
           std::string(value);
}

}  // namespace

bool check_arity(const Usage& usage, const Token& name, std::span<const Token> args,
                 Diagnostics& diagnostics) {
    const auto& forms = usage_forms(usage.arguments);
    const auto by_option = std::find_if(forms.begin() + 1, forms.end(), [&](const auto& form) {
        return !form.empty() && !args.empty() && form.front().text == args.front().text;
    });
    std::size_t min = 0;
    std::size_t max = 0;
    for (const UsageWord& word : by_option == forms.end() ? forms.front() : *by_option) {
        if (!word.optional) {
            ++min;
        }
        max = word.repeats || max == SIZE_MAX ? SIZE_MAX : max + 1;
    }
    const std::size_t given = args.size();
    if (given >= min && given <= max) return true;
    const bool few = given < min;
    const std::size_t bound = few ? min : max;
    const char* const limit = few ? "at least " : "at most ";
    Span at = name.span;
    if (!few) {
        at = args[max].span;
        if (const Span last = args.back().span; last.source == at.source && last.end > at.end) {
            at.end = last.end;
        }
    }
    const std::string remedy = min == 2 ? without_equals_sign(usage.name, args) : "";
    diagnostics.error("wrong-arguments", at,
                      std::string(usage.name) + " takes " + (min == max ? "" : limit) +
                          counted(bound, "argument") + ", not " + std::to_string(given),
                      "", remedy.empty() ? to_string(usage) : remedy);
    return false;
}

}  // namespace hal
