// SPDX-License-Identifier: MIT
// The texts that an editor has open, and the netlists to which they belong.
#pragma once

#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "lsp/checked_netlist.hpp"
#include "lsp/file_diagnostic.hpp"
#include "lsp/netlist_index.hpp"
#include "lsp/text_document.hpp"

namespace hal::tools {

/// A text that the editor has open.
struct OpenDocument {
    std::string uri;  ///< as the editor names it
    std::string path; ///< canonical
    std::int64_t version = 0;
    TextDocument text;
    TextDocument saved;  ///< as it was when it was opened, or last applied to a machine
    std::vector<std::string> not_sent = {};  ///< what was not applied then; it waits for a start
};

/// [setup]
class Workspace {
public:
    /// `path` is the document's canonical path, or its URI when it has no file.
    void open(const std::string& uri, std::int64_t version, std::string text);
    /// Applies `edit` to an open document. False: it is not open.
    bool change(const std::string& uri, std::int64_t version,
                const std::function<void(TextDocument&)>& edit);
    void close(const std::string& uri);
    /// Files on the disk have changed: everything is loaded again.
    void refresh();
    /// Sets the INI file of netlists that no INI file names.
    void set_ini(const std::string& path);
    /// Sets the components, or prefixes of names, that exist on the target machine only.
    void set_assumed(std::vector<std::string> names);

    const OpenDocument* find(const std::string& uri) const;
    OpenDocument* find(const std::string& uri);
    const std::map<std::string, OpenDocument>& documents() const { return documents_; }
    /// Returns the URI of a path: the editor's own if the document is open.
    std::string uri_of(const std::string& path) const;
    /// Returns the text of a file as the editor has it, else as on the disk; empty if unreadable.
    TextDocument text_of(const std::string& path) const;

    /// True while a netlist has changed since it was loaded.
    bool has_work() const;
    /// Loads one such netlist.
    void work();
    /// True while there are netlists that nothing uses any more.
    bool has_garbage() const { return !garbage_.empty(); }
    /// Frees them, which takes a good part of the time of a load.
    void free_garbage() { garbage_.clear(); }
    /// Returns the diagnostics of all netlists by path. Each open document has an entry.
    std::map<std::string, std::vector<FileDiagnostic>> diagnostics() const;

    /// Returns the netlist of a document, loaded as it is now; nullptr: it has none.
    CheckedNetlist* netlist_of(const std::string& path);
    /// Returns a netlist with the models of the document, as far as its lines have no errors.
    CheckedNetlist* model_of(const std::string& path);
    /// Returns where the netlist of a document mentions its names; nullptr: it has none.
    const NetlistIndex* index_of(const std::string& path);

private:
    struct Netlist {
        std::unique_ptr<CheckedNetlist> checked;  // nullptr: not loaded yet
        std::unique_ptr<CheckedNetlist> tolerant;  // without the lines that have errors
        std::unique_ptr<NetlistIndex> index;
        bool changed = true;
    };

    void update_roots();
    NetlistRoot root_of(const OpenDocument& document);
    void mark_changed(const std::string& path);
    void load(const NetlistRoot& root, Netlist& netlist);
    std::unique_ptr<CheckedNetlist> without_errors(const CheckedNetlist& checked) const;

    std::map<std::string, OpenDocument> documents_;  // by path
    std::map<std::string, std::string> path_by_uri_;
    std::map<std::string, NetlistRoot> static_roots_;  // by path: of find_root()
    std::map<std::string, NetlistRoot> roots_;  // by path
    std::map<NetlistRoot, Netlist> netlists_;
    std::vector<std::unique_ptr<CheckedNetlist>> garbage_;
    std::string ini_;
    std::vector<std::string> assumed_;
    std::string last_changed_;
};

}  // namespace hal::tools
