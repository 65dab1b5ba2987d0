// SPDX-License-Identifier: MIT
// Elements and attributes of LinuxCNC's ethercat-conf.xml, and the errors about them. Everything
// here is [setup].
#pragma once

#include <algorithm>
#include <cstdio>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "ethercat/config/config_text.hpp"
#include "ethercat/esi/esi_xml.hpp"

namespace hal::ethercat::config {

using esi::Xml;

class LcecXml {
public:
    explicit LcecXml(std::string_view text) : text_(text) {}

    void error(Topic topic, const Xml& at, std::string sentence, std::string help = {}) {
        if (!report_.failed() || report_.all.size() <= text::max_errors) {
            report_.error(topic, esi::span_of(at, text_), std::move(sentence), std::move(help));
        }
    }
    /// Reports attributes that the element does not have.
    void attributes(const Xml& node, const std::vector<std::string>& known) {
        for (const auto a : node.attributes()) {
            if (std::find(known.begin(), known.end(), a.name()) == known.end()) {
                error(Topic::line, node,
                      "unknown attribute '" + std::string(a.name()) + "' of <" + node.name() + ">",
                      known.empty() ? "the element has none"
                                    : suggestion(a.name(), known, "the attributes are"));
            }
        }
    }
    void children(const Xml& node, const std::vector<std::string>& known,
                  const std::function<void(const Xml&)>& read) {
        for (const Xml child : node.children()) {
            if (child.type() != pugi::node_element) continue;
            if (std::find(known.begin(), known.end(), child.name()) != known.end()) {
                read(child);
            } else {
                error(
                    Topic::line, child,
                    "unknown element <" + std::string(child.name()) + "> in <" + node.name() + ">",
                    known.empty() ? "the element is empty"
                                  : suggestion(child.name(), known, "the elements are"));
            }
        }
    }

    std::optional<std::int64_t> number(const Xml& node, const char* name, std::int64_t min,
                                       std::int64_t max, bool hexadecimal = false,
                                       bool required = false) {
        const std::string_view value = trimmed(node.attribute(name).value());
        if (!node.attribute(name)) {
            if (required) {
                error(Topic::value, node,
                      "missing attribute '" + std::string(name) + "' of <" + node.name() + ">",
                      "write " + std::string(name) + "=\"" + (hexadecimal ? "6040" : "0") + "\"");
            }
            return {};
        }
        const bool prefixed = value.starts_with("0x") || value.starts_with("0X") || !hexadecimal;
        const auto n = esi::number(prefixed ? std::string(value) : "0x" + std::string(value));
        if (n && *n >= min && *n <= max) return n;
        if (const auto lenient = hexadecimal ? leading_digits(value) : std::nullopt;
            lenient && *lenient >= min && *lenient <= max) {
            char digits[20];
            std::snprintf(digits, sizeof digits, "%llX", static_cast<long long>(*lenient));
            report_.warning(Topic::value, esi::span_of(node, text_),
                            std::string(name) + " '" + std::string(value) + "' of <" + node.name() +
                                "> is read as " + digits + ", as lcec does",
                            "write " + std::string(name) + "=\"" + digits + "\"");
            return lenient;
        }
        char range[96];
        std::snprintf(range, sizeof range,
                      hexadecimal ? "a hexadecimal number of %llX..%llX" : "a number of %lld..%lld",
                      static_cast<long long>(min), static_cast<long long>(max));
        error(Topic::value, node,
              "invalid " + std::string(name) + " '" + std::string(value) + "' of <" + node.name() +
                  ">",
              "write " + std::string(range));
        return {};
    }
    /// Returns what lcec reads of a hexadecimal number with a wrong character: the digits before it.
    /// The letter O is read as 0.
    static std::optional<std::int64_t> leading_digits(std::string_view value) {
        if (value == "O" || value == "o") return 0;
        const std::size_t end = value.find_first_not_of("0123456789abcdefABCDEF");
        if (end == 0 || end == std::string_view::npos) return {};
        return esi::number("0x" + std::string(value.substr(0, end)));
    }

    bool flag(const Xml& node, const char* name, bool otherwise) {
        const std::string_view value = node.attribute(name).value();
        if (value.empty()) return otherwise;
        if (same_word(value, "true") || value == "1") return true;
        if (!same_word(value, "false") && value != "0") {
            error(Topic::value, node,
                  "invalid " + std::string(name) + " '" + std::string(value) + "' of <" +
                      node.name() + ">",
                  "write true or false");
        }
        return false;
    }
    std::string_view text_;
    Report report_;
};

}  // namespace hal::ethercat::config
