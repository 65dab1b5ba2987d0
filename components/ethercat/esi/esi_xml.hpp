// SPDX-License-Identifier: MIT
// Access to the elements of an ESI, for the sources of this folder. Everything here is [setup].
#pragma once

#include <algorithm>
#include <limits>
#include <type_traits>

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

/// Returns whether a number can only be hexadecimal, although it has no prefix, as in 1A00.
inline bool bare_hex(std::string_view text) {
    return !text.empty() && text.find_first_not_of("0123456789abcdefABCDEF") == text.npos;
}

template <class T>
constexpr std::int64_t max_number =
    sizeof(T) < sizeof(std::int64_t) ? static_cast<std::int64_t>(std::numeric_limits<T>::max())
                                     : std::numeric_limits<std::int64_t>::max();

/// Reads the numbers and flags of one file, and reports invalid ones.
struct Context {
    std::string_view text{};
    hal::text::Messages<Topic> report{};

    void warn(const Xml& at, std::string sentence) {
        if (report.all.size() < hal::text::max_errors) {
            report.warning(Topic::value, span_of(at, text), std::move(sentence));
        }
    }

    void error(const Xml& at, std::string sentence, std::string help) {
        if (report.all.size() < hal::text::max_errors) {
            report.error(Topic::value, span_of(at, text), std::move(sentence), std::move(help));
        }
    }

    /// Reads a number of the type T; the signed spelling of an unsigned number is an error.
    template <class T>
    T number_of(const Xml& at, std::string_view name, std::string_view value, T otherwise = {}) {
        if (trimmed(value).empty()) return otherwise;
        const std::string shown =
            std::string(name) + " '" + std::string(trimmed(value).substr(0, 60)) + "'";
        auto n = number(value);
        if (!n && bare_hex(trimmed(value))) {
            n = number("#x" + std::string(trimmed(value)));
            warn(at, shown + " has no #x; read as hexadecimal");
        }
        if (!n && trimmed(value).starts_with("#x0x")) {
            n = number("#x" + std::string(trimmed(value).substr(4)));
            if (n) warn(at, shown + " has two prefixes; read as hexadecimal");
        }
        if (!n) {
            error(at, "invalid " + shown, "write a number, as in 12 or #x1F");
            return otherwise;
        }
        if (sizeof(T) < sizeof(std::int64_t) &&
            (*n < static_cast<std::int64_t>(std::numeric_limits<T>::min()) || *n > max_number<T>)) {
            error(at, "out of range: " + shown,
                  "the range is " + std::to_string(std::numeric_limits<T>::min()) + ".." +
                      std::to_string(max_number<T>));
            return otherwise;
        }
        return static_cast<T>(*n);
    }
    template <class T>
    T attribute(const Xml& at, const char* name, T otherwise = {}) {
        return number_of<T>(at, name, at.attribute(name).value(), otherwise);
    }
    template <class T>
    T child(const Xml& at, const char* name, T otherwise = {}) {
        const Xml c = at.child(name);
        return c ? number_of<T>(c, name, c.child_value(), otherwise) : otherwise;
    }
    static bool flag(const Xml& at, const char* name, bool otherwise = false) {
        const std::string_view value = trimmed(at.attribute(name).value());
        return value.empty() ? otherwise : value == "1" || same_word(value, "true");
    }
    std::vector<std::uint8_t> bytes(const Xml& at) {
        if (auto out = hex_bytes(at.child_value())) return *out;
        error(at, "invalid data: expected hexadecimal bytes", "write two digits for each byte");
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
