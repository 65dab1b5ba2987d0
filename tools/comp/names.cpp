// SPDX-License-Identifier: MIT
#include <algorithm>

#include "comp/syntax.hpp"
#include "text/characters.hpp"

namespace hal::comp {
namespace {

bool separates(char c) { return c == '.' || c == '_' || c == '-'; }
bool is_word(char c) { return is_alphanumeric(c) || c == '_'; }

// `code` from `at` on: behind the comment or the literal that starts there, or at itself.
std::size_t behind_text(std::string_view code, std::size_t at) {
    if (code.substr(at).starts_with("//")) return std::min(code.find('\n', at), code.size());
    if (code.substr(at).starts_with("/*")) {
        const std::size_t end = code.find("*/", at + 2);
        return end == std::string_view::npos ? code.size() : end + 2;
    }
    if (code[at] != '"' && code[at] != '\'') return at;
    const char quote = code[at];
    for (++at; at < code.size() && code[at] != quote && code[at] != '\n'; ++at) {
        if (code[at] == '\\') {
            ++at;
        }
    }
    return std::min(at + 1, code.size());
}

}  // namespace

Name spelled(Text written) {
    Name name;
    const std::string& text = written.text;
    name.hal = text;
    std::replace(name.hal.begin(), name.hal.end(), '_', '-');
    while (!name.hal.empty() && (name.hal.back() == '-' || name.hal.back() == '.')) {
        name.hal.pop_back();
    }
    for (const char c : text) {
        if (c == '#') {
            while (!name.c.empty() && separates(name.c.back())) {
                name.c.pop_back();
            }
        } else if (separates(c)) {
            if (!name.c.ends_with('_')) {
                name.c += '_';
            }
        } else {
            name.c += c;
        }
    }
    static_cast<Text&>(name) = std::move(written);
    return name;
}

std::string numbered(const std::string& name, unsigned index) {
    const std::size_t at = name.find('#');
    if (at == std::string::npos) return name;
    const std::size_t width = std::min(name.find_first_not_of('#', at), name.size()) - at;
    std::string digits = std::to_string(index);
    if (digits.size() < width) {
        digits.insert(0, width - digits.size(), '0');
    }
    return std::string(name).replace(at, width, digits);
}

std::size_t find_word(std::string_view code, std::string_view word, std::size_t from) {
    for (std::size_t at = from; at < code.size();) {
        if (const std::size_t behind = behind_text(code, at); behind != at) {
            at = behind;
        } else if (is_word(code[at])) {
            const std::size_t begin = at;
            at = end_of_run(code, begin, is_word);
            if (code.substr(begin, at - begin) == word) return begin;
        } else {
            ++at;
        }
    }
    return std::string_view::npos;
}

bool implicit_function(const Tree& tree, std::string_view code) {
    return tree.functions.size() == 1 && code.find("FUNCTION") == std::string_view::npos;
}

}  // namespace hal::comp
