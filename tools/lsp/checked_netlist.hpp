// SPDX-License-Identifier: MIT
// A netlist, or the netlists of an INI file, loaded as `hal check` does: components are
// constructed, nothing runs.
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "cells/cell.hpp"
#include "commands/shell.hpp"
#include "lsp/file_diagnostic.hpp"
#include "machine/session.hpp"

namespace hal::tools {

/// What is loaded.
struct NetlistRoot {
    std::string path;  ///< a netlist or an INI file; "untitled:1": a text without a file
    std::string ini = {};        ///< for [SECTION]KEY of a netlist; empty: none
    std::string command = {};    ///< instead of the file: the command that loads it
    std::vector<std::string> assumed = {};  ///< components of the target machine only
    auto operator<=>(const NetlistRoot&) const = default;
};

/// [setup]
class CheckedNetlist final : public ShellObserver {
public:
    /// Reads all files from the EditorTexts, else from the disk.
    explicit CheckedNetlist(NetlistRoot root);
    ~CheckedNetlist() override;
    CheckedNetlist(const CheckedNetlist&) = delete;

    /// A text of the netlist. Its commands point into the sources of the session.
    struct Text {
        std::string path;  ///< canonical; empty: of a text without a file
        Session* session;
        std::uint32_t source;
        std::vector<Command> commands;
    };

    const NetlistRoot& root() const { return root_; }
    /// False: there were errors, and the models of sessions() are empty.
    bool good() const { return good_; }
    /// All diagnostics, each once, those without a span at the beginning of the root.
    const std::vector<FileDiagnostic>& diagnostics() const { return diagnostics_; }
    /// The canonical paths of all files that were read.
    const std::set<std::string>& files() const { return files_; }
    /// The texts in the order of loading; of a netlist for several machines once for each.
    const std::vector<Text>& texts() const { return texts_; }
    /// One for each machine; at least one.
    const std::vector<Session*>& sessions() const { return sessions_; }
    Shell& shell() { return *shells_.front(); }
    /// Returns the path of a source and the text as an editor counts it.
    const TextDocument& document(Session& session, std::uint32_t source) const;
    std::string path_of(const Sources& sources, std::uint32_t source) const;

    void parsed(const Sources& sources, std::uint32_t source,
                const std::vector<Command>& commands) override;
    void reported(const Diagnostics& diagnostics, const Sources& sources) override;

private:
    using DocumentKey = std::pair<const Sources*, std::uint32_t>;

    void load();
    void load_nodes(std::vector<NodeLine> nodes, const ShellOptions& options);
    bool run(Shell& shell, Output& output) const;
    const TextDocument& document_of(const Sources& sources, std::uint32_t source) const;
    std::optional<DiagnosticPlace> place(const Sources& sources, Span span, std::string text) const;
    void add(const Diagnostic& diagnostic, const Sources& sources);

    NetlistRoot root_;
    std::string directory_;
    std::unique_ptr<Session> session_;
    std::unique_ptr<Cell> cell_;
    std::vector<std::unique_ptr<Shell>> own_shells_;
    std::vector<Shell*> shells_;
    std::vector<Session*> sessions_;
    std::vector<FileDiagnostic> diagnostics_;
    std::set<FileDiagnostic> known_diagnostics_;
    std::set<std::string> files_;
    std::vector<Text> texts_;
    mutable std::map<DocumentKey, TextDocument> documents_;
    mutable std::map<std::string, std::string> paths_;  // by the name of a source
    bool good_ = false;
};

}  // namespace hal::tools
