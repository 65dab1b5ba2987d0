// SPDX-License-Identifier: MIT
// Access to the elements of an ESI, for the sources of this folder. Everything here is [setup].
#pragma once

#include <algorithm>

#include <pugixml.hpp>

#include "ethercat/esi/esi.hpp"
#include "text/characters.hpp"

namespace hal::ethercat::esi {

using Xml = pugi::xml_node;

/// Returns the span of the element's name.
inline text::Span span_of(const Xml& node, std::string_view text) {
    const auto debug = node.offset_debug();
    const std::size_t at = debug < 0 ? 0 : std::min(static_cast<std::size_t>(debug), text.size());
    const std::size_t start = text.substr(0, at).rfind('\n') + 1;  // npos + 1 is 0
    text::Span out{1, 1, static_cast<std::uint32_t>(at),
                   static_cast<std::uint32_t>(std::string_view(node.name()).size())};
    out.line += static_cast<std::uint32_t>(
        std::count(text.begin(), text.begin() + static_cast<std::ptrdiff_t>(at), '\n'));
    out.column += characters(text.substr(start, at - start));
    return out;
}

/// Reads the numbers and flags of one file, and reports invalid ones.
struct Context {
    std::string_view text{};
    hal::text::Messages<Topic> report{};

    void warn(const Xml& at, std::string sentence) {
        if (report.all.size() < hal::text::most_errors) {
            report.warning(Topic::value, span_of(at, text), std::move(sentence));
        }
    }

    std::int64_t number_of(const Xml& at, std::string_view name, std::string_view value,
                           std::int64_t otherwise) {
        if (trimmed(value).empty()) return otherwise;
        if (const auto n = number(value)) return *n;
        warn(at, "invalid " + std::string(name) + " '" + std::string(trimmed(value).substr(0, 60)) +
                     "': expected a number, as in 12 or #x1F");
        return otherwise;
    }
    template <class T>
    T attribute(const Xml& at, const char* name, T otherwise = {}) {
        return static_cast<T>(
            number_of(at, name, at.attribute(name).value(), static_cast<std::int64_t>(otherwise)));
    }
    template <class T>
    T child(const Xml& at, const char* name, T otherwise = {}) {
        const Xml c = at.child(name);
        return c ? static_cast<T>(
                       number_of(c, name, c.child_value(), static_cast<std::int64_t>(otherwise)))
                 : otherwise;
    }
    static bool flag(const Xml& at, const char* name, bool otherwise = false) {
        const std::string_view value = trimmed(at.attribute(name).value());
        return value.empty() ? otherwise : value == "1" || same_word(value, "true");
    }
    std::vector<std::uint8_t> bytes(const Xml& at) {
        if (auto out = hex_bytes(at.child_value())) return *out;
        warn(at, "invalid data: expected hexadecimal bytes");
        return {};
    }
};

/// Returns the text of a child; among several languages the English one.
inline std::string text_of(const Xml& at, const char* name) {
    Xml best = at.child(name);
    for (Xml c = best; c; c = c.next_sibling(name)) {
        if (number(c.attribute("LcId").value()) == std::int64_t{1033}) {
            best = c;
            break;
        }
    }
    return std::string(trimmed(best.child_value()));
}

/// Reads Profile/Dictionary of a device or module: its objects, by index.
std::vector<Object> dictionary(Context&, const Xml& profile);

}  // namespace hal::ethercat::esi
