// SPDX-License-Identifier: MIT
// The answers to requests about a text: completion, hover, definitions, renaming and so on.
#pragma once

#include <nlohmann/json.hpp>
#include <optional>
#include <string>

#include "lsp/configuration_keys.hpp"
#include "lsp/live_machine.hpp"
#include "lsp/netlist_index.hpp"
#include "lsp/protocol.hpp"
#include "lsp/renaming.hpp"
#include "lsp/workspace.hpp"

namespace hal::tools {

/// Each member answers the request of its name with `params` of Language Server Protocol 3.17, or
/// throws protocol::RequestError. A text without a netlist has empty answers. [setup]
class LanguageFeatures {
public:
    using Json = protocol::Json;

    /// Both must outlive it.
    LanguageFeatures(Workspace& workspace, LiveMachine& machine)
        : workspace_(workspace), machine_(machine) {}

    /// Returns what `initialize` states about these requests.
    static Json capabilities();
    /// Returns the path of the document of a request; empty when the document is not open.
    std::string path_of(const Json& params) const;

    Json completion(const Json& params);
    Json hover(const Json& params);
    Json definition(const Json& params);
    Json references(const Json& params);
    Json highlights(const Json& params);
    Json symbols(const Json& params);
    Json prepare_rename(const Json& params);
    Json rename(const Json& params);
    Json code_actions(const Json& params);
    Json all_tokens(const Json& params);
    Json tokens_of_range(const Json& params);
    Json formatting(const Json& params);
    Json inlay_hints(const Json& params);
    Json execute_command(const Json& params);
    /// Returns true when the hints of the last request would differ now.
    bool hints_have_changed();
    /// Returns true while hints were requested and a machine is connected.
    bool has_hints() const { return !hint_params_.is_null() && !machine_.instance().empty(); }

private:
    std::string changed_ini_files() const;
    const OpenDocument& document_of(const Json& params) const;
    /// Returns the name under the cursor.
    std::optional<NamedThing> thing_at(const Json& params);
    Json location(const Occurrence& mention) const;
    Json edits_to_json(const FileEdits& edits) const;
    Json file_location(const OpenDocument& document, const NamedThing& thing) const;
    Json ini_location(const OpenDocument& document, std::size_t offset);

    Json hints(const Json& params);
    void add_faults(const OpenDocument& document, const NetlistIndex& index, Json& all);

    Workspace& workspace_;
    LiveMachine& machine_;
    ConfigurationKeys keys_;
    Json hint_params_;  // of the last request
    Json hints_;        // its answer
};

}  // namespace hal::tools
