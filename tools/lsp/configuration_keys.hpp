// SPDX-License-Identifier: MIT
// The keys of the configurations of buses, as their readers declare them: `hal canopen keys` and its
// like print them.
#pragma once

#include <map>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "lsp/root_finder.hpp"
#include "lsp/text_document.hpp"

namespace hal::tools {

/// [setup]
class ConfigurationKeys {
public:
    /// Returns a CompletionList for a position of a configuration: sections and keys at the
    /// beginning of a line, nothing behind.
    nlohmann::json complete(const ConfigurationKind& kind, const TextDocument& document,
                            TextPosition at);
    /// Returns Markdown about the key at the beginning of a line; empty when it is unknown.
    std::string hover(const ConfigurationKind& kind, const TextDocument& document, TextPosition at);

private:
    struct Key {
        std::string section;  ///< the heading of its table
        std::string name;  ///< "bitrate", "tpdoN", "slot ID OFFSET"
        std::string value;
        std::string fallback;
        std::string meaning;
    };
    const std::vector<Key>& keys_of(const ConfigurationKind& kind);
    static std::vector<Key> parse(const std::string& tables);
    static bool belongs(const Key& key, const std::string& section);
    static std::string text_about(const Key& key);

    std::map<std::string, std::vector<Key>> keys_;  // by the component
};

}  // namespace hal::tools
