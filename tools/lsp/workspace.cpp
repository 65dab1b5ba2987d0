// SPDX-License-Identifier: MIT
#include "lsp/workspace.hpp"

#include <algorithm>
#include <utility>

#include "commands/files.hpp"
#include "lsp/editor_texts.hpp"
#include "lsp/file_uri.hpp"
#include "lsp/root_finder.hpp"
#include "panel/panel_layout.hpp"

namespace hal::tools {

namespace {

constexpr int max_attempts = 3;  // to load a netlist

/// Replaces the lines of `ranges`, and the lines that continue them, by blanks.
void blank_lines(TextDocument& document, std::set<std::uint32_t> lines) {
    std::string text = document.text();
    for (std::uint32_t line = 0; line < document.line_count(); ++line) {
        if (!lines.contains(line)) continue;
        const std::string_view content = document.line(line);
        if (content.ends_with('\\')) {
            lines.insert(line + 1);
        }
        const std::size_t begin = document.line_start(line);
        std::fill_n(text.begin() + static_cast<std::ptrdiff_t>(begin), content.size(), ' ');
    }
    document = TextDocument(std::move(text));
}

/// Returns the first physical line of the logical line that contains `line`.
std::uint32_t logical_begin(const TextDocument& document, std::uint32_t line) {
    while (line > 0 && document.line(line - 1).ends_with('\\')) {
        --line;
    }
    return line;
}

bool has_diagnostics(const std::string& path) {
    if (path.ends_with(".panel")) return false;
    return !path.ends_with(".ini") || names_netlists(path);
}

/// A panel is read by no machine.
std::vector<FileDiagnostic> panel_diagnostics(const OpenDocument& document) {
    std::vector<FileDiagnostic> found;
#if HALCYON_PACKAGE_PANEL
    if (!document.path.ends_with(".panel")) return found;
    const Diagnostics errors = check_panel_text(document.text.text());
    for (const Diagnostic& one : errors.all()) {
        const Span at = one.labels.empty() ? Span{} : one.labels.front().span;
        found.push_back({.path = document.path,
                         .range = document.text.range(at.begin, at.end),
                         .severity = one.severity,
                         .code = std::string(one.code.name()),
                         .message = one.message,
                         .label = {},
                         .help = one.help,
                         .related = {}});
    }
#else
    (void)document;
#endif
    return found;
}

}  // namespace

void Workspace::open(const std::string& uri, std::int64_t version, std::string text) {
    std::string path = path_of_uri(uri);
    if (path.starts_with('/')) {
        path = canonical_path(path);
    }
    EditorTexts::instance().set(path, text);
    path_by_uri_[uri] = path;
    OpenDocument& document = documents_[path];
    document = {uri, path, version, TextDocument(text), TextDocument(text)};
    static_roots_.erase(path);
    mark_changed(path);
    update_roots();
}

bool Workspace::change(const std::string& uri, std::int64_t version,
                       const std::function<void(TextDocument&)>& edit) {
    OpenDocument* const document = find(uri);
    if (!document) return false;
    edit(document->text);
    document->version = version;
    EditorTexts::instance().set(document->path, document->text.text());
    mark_changed(document->path);
    return true;
}

void Workspace::close(const std::string& uri) {
    const auto path = path_by_uri_.find(uri);
    if (path == path_by_uri_.end()) return;
    EditorTexts::instance().erase(path->second);
    mark_changed(path->second);
    documents_.erase(path->second);
    static_roots_.erase(path->second);
    path_by_uri_.erase(path);
    update_roots();
}

void Workspace::refresh() {
    static_roots_.clear();
    for (auto& [root, netlist] : netlists_) {
        netlist.changed = true;
    }
    update_roots();
}

void Workspace::set_ini(const std::string& path) {
    ini_ = path.empty() ? "" : canonical_path(path);
    refresh();
}

void Workspace::set_assumed(std::vector<std::string> names) {
    assumed_ = std::move(names);
    refresh();
}

const OpenDocument* Workspace::find(const std::string& uri) const {
    const auto path = path_by_uri_.find(uri);
    return path == path_by_uri_.end() ? nullptr : &documents_.at(path->second);
}

OpenDocument* Workspace::find(const std::string& uri) {
    const auto path = path_by_uri_.find(uri);
    return path == path_by_uri_.end() ? nullptr : &documents_.at(path->second);
}

std::string Workspace::uri_of(const std::string& path) const {
    const auto document = documents_.find(path);
    return document == documents_.end() ? uri_of_path(path) : document->second.uri;
}

TextDocument Workspace::text_of(const std::string& path) const {
    const auto document = documents_.find(path);
    if (document != documents_.end()) return document->second.text;
    std::string text;
    std::string ignored;
    read_text_file(path, text, ignored);
    return TextDocument(std::move(text));
}

void Workspace::mark_changed(const std::string& path) {
    last_changed_ = path;
    for (auto& [root, netlist] : netlists_) {
        const bool reads =
            root.path == path || (netlist.checked && netlist.checked->files().contains(path));
        netlist.changed = netlist.changed || reads;
    }
}

/// Returns what has to be loaded for a document: a loaded netlist that reads it, else what
/// find_root() returns.
NetlistRoot Workspace::root_of(const OpenDocument& document) {
    const auto [found, fresh] = static_roots_.try_emplace(document.path);
    if (fresh) {
        found->second = find_root(document.path);
        if (!found->second.path.ends_with(".ini")) {
            found->second.ini = ini_;
        }
        found->second.assumed = assumed_;
    }
    if (found->second.path != document.path) return found->second;
    for (const auto& [root, netlist] : netlists_) {
        const bool reads = netlist.checked && root.path != document.path &&
                           netlist.checked->files().contains(document.path);
        if (reads) return root;
    }
    return found->second;
}

/// Keeps the netlists of the open documents, and no others.
void Workspace::update_roots() {
    roots_.clear();
    for (const auto& [path, document] : documents_) {
        if (has_diagnostics(path)) {
            roots_[path] = root_of(document);
        }
    }
    std::map<NetlistRoot, Netlist> kept;
    for (const auto& [path, root] : roots_) {
        const auto before = netlists_.find(root);
        if (before != netlists_.end()) {
            kept.insert(netlists_.extract(before));
        } else {
            kept.try_emplace(root);
        }
    }
    netlists_ = std::move(kept);
}

bool Workspace::has_work() const {
    return std::any_of(netlists_.begin(), netlists_.end(),
                       [](const auto& entry) { return entry.second.changed; });
}

void Workspace::work() {
    auto next = netlists_.end();
    if (const auto root = roots_.find(last_changed_); root != roots_.end()) {
        next = netlists_.find(root->second);
    }
    if (next == netlists_.end() || !next->second.changed) {
        next = std::find_if(netlists_.begin(), netlists_.end(),
                            [](const auto& entry) { return entry.second.changed; });
    }
    if (next != netlists_.end()) {
        load(next->first, next->second);
    }
}

void Workspace::load(const NetlistRoot& root, Netlist& netlist) {
    free_garbage();  // of keystrokes without a pause between them: at most one old model remains
    netlist.index.reset();
    for (auto* const replaced : {&netlist.tolerant, &netlist.checked}) {
        if (*replaced) {
            garbage_.push_back(std::move(*replaced));
        }
    }
    netlist.checked = std::make_unique<CheckedNetlist>(root);
    netlist.changed = false;
    update_roots();
}

std::map<std::string, std::vector<FileDiagnostic>> Workspace::diagnostics() const {
    std::map<std::string, std::vector<FileDiagnostic>> all;
    std::set<FileDiagnostic> known;
    for (const auto& [path, document] : documents_) {
        all[path] = panel_diagnostics(document);
    }
    for (const auto& [root, netlist] : netlists_) {
        if (!netlist.checked) continue;
        for (const FileDiagnostic& finding : netlist.checked->diagnostics()) {
            if (known.insert(finding).second) {
                all[finding.path].push_back(finding);
            }
        }
    }
    return all;
}

CheckedNetlist* Workspace::netlist_of(const std::string& path) {
    // what is loaded may turn out to be a part of something else
    for (int attempt = 0; attempt < max_attempts; ++attempt) {
        const auto root = roots_.find(path);
        if (root == roots_.end()) return nullptr;
        const auto netlist = netlists_.find(root->second);
        if (!netlist->second.changed) return netlist->second.checked.get();
        load(netlist->first, netlist->second);
    }
    return nullptr;
}

CheckedNetlist* Workspace::model_of(const std::string& path) {
    CheckedNetlist* const checked = netlist_of(path);
    if (!checked || checked->good()) return checked;
    Netlist& netlist = netlists_.at(checked->root());
    if (!netlist.tolerant) {
        netlist.tolerant = without_errors(*checked);
    }
    return netlist.tolerant.get();
}

const NetlistIndex* Workspace::index_of(const std::string& path) {
    const CheckedNetlist* const model = model_of(path);
    if (!model) return nullptr;
    Netlist& netlist = netlists_.at(model->root());
    if (!netlist.index) {
        netlist.index = std::make_unique<NetlistIndex>(*netlist.checked, *model);
    }
    return netlist.index.get();
}

std::unique_ptr<CheckedNetlist> Workspace::without_errors(const CheckedNetlist& checked) const {
    std::map<std::string, TextDocument> texts;
    std::unique_ptr<CheckedNetlist> loaded;
    const CheckedNetlist* last = &checked;
    for (int attempt = 0; attempt < max_attempts; ++attempt) {
        std::map<std::string, std::set<std::uint32_t>> lines;
        for (const FileDiagnostic& finding : last->diagnostics()) {
            if (finding.severity != Severity::error) continue;
            const auto [text, fresh] = texts.try_emplace(finding.path);
            if (fresh) {
                text->second = text_of(finding.path);
            }
            lines[finding.path].insert(logical_begin(text->second, finding.range.begin.line));
        }
        std::map<std::string, std::string> overrides;
        for (auto& [path, text] : texts) {
            blank_lines(text, lines[path]);
            overrides[path] = text.text();
        }
        const EditorTexts::Override without(std::move(overrides));
        loaded = std::make_unique<CheckedNetlist>(checked.root());
        if (loaded->good()) break;
        last = loaded.get();
    }
    return loaded;
}

}  // namespace hal::tools
