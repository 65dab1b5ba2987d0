// SPDX-License-Identifier: MIT
// Where a netlist mentions its names: for definitions, references, renaming, the outline, colours.
#pragma once

#include <cstddef>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "lsp/checked_netlist.hpp"

namespace hal::tools {

enum class NameKind { command, component, instance, pin, signal, function, thread, file, value };

/// One mention of a name in a text.
struct Occurrence {
    NameKind kind;
    std::string name;  ///< in full, after substitution and ranges
    std::string path;  ///< canonical; empty: of a text without a file
    std::size_t begin = 0;
    std::size_t end = 0;  ///< bytes of the text
    bool verbatim = true;  ///< the text has the name itself, not a range or a reference to it
    bool defines = false;
    /// of a pin or function: its instance, with which the name begins unless it declares whole names
    std::string instance = {};
    /// of a name that is the whole value of [SECTION]KEY: where the INI file has it
    std::optional<DiagnosticPlace> ini_value = {};
};

/// A name and its kind, as a cursor selects them.
struct NamedThing {
    NameKind kind;
    std::string name;
    std::size_t begin = 0;
    std::size_t end = 0;  ///< of the name in the text under the cursor
};

/// [setup]
class NetlistIndex {
public:
    /// `netlist` has the texts, `model` the instances; both may be the same.
    NetlistIndex(const CheckedNetlist& netlist, const CheckedNetlist& model);

    /// Returns the mentions in a text, by offset.
    const std::vector<Occurrence>& in_text(const std::string& path) const;
    /// Returns the name at an offset of a text.
    std::optional<NamedThing> at(const std::string& path, std::size_t offset) const;
    /// Returns all mentions of a name; of an instance also those of its pins and functions, of which
    /// only the part with its name counts.
    std::vector<Occurrence> mentions(const NamedThing& thing) const;
    /// Returns where a name is made; a pin or function where its instance is.
    std::vector<Occurrence> definitions(const NamedThing& thing) const;

    const Pin* find_pin(std::string_view name) const;
    const Signal* find_signal(std::string_view name) const;
    const LoadedFunction* find_function(std::string_view name) const;
    const Instance* find_instance(std::string_view name) const;
    const Thread* find_thread(std::string_view name) const;

private:
    void add(const CheckedNetlist::Text& text, const Command& command);
    void add_argument(const CheckedNetlist::Text& text, const Command& command,
                      std::string_view usage, const Token& argument);
    void add_names(const CheckedNetlist::Text& text, const Token& argument);
    void add_file(const CheckedNetlist::Text& text, const Token& argument, std::string_view file);
    void add_unnamed_instances(const CheckedNetlist& model);
    void put(const CheckedNetlist::Text& text, NameKind kind, const Token& token, bool defines);
    std::optional<NameKind> kind_of(std::string_view usage, const Command& command,
                                    const std::string& name) const;
    std::string instance_of(NameKind kind, const std::string& name) const;
    std::optional<DiagnosticPlace> ini_value(const CheckedNetlist::Text& text,
                                             const Token& token) const;

    const CheckedNetlist& netlist_;
    std::vector<const Model*> models_;
    std::map<std::string, std::vector<Occurrence>> texts_;
};

}  // namespace hal::tools
