// SPDX-License-Identifier: MIT
#include "lsp/checked_netlist.hpp"

#include <algorithm>
#include <filesystem>

#include "base/region.hpp"
#include "cli/no_output.hpp"
#include "commands/files.hpp"
#include "link/bus_key.hpp"
#include "lsp/editor_texts.hpp"
#include "run/offline.hpp"

namespace hal::tools {

namespace {

/// What `hal check` does, at each change of a text.
SessionOptions in_editor() {
    SessionOptions options = offline();
    options.hardware_allowed = false;
    return options;
}

std::uint64_t load_number = 0;  // of the newest load

bool is_file(const std::string& path) {
    if (!path.starts_with('/')) return false;
    std::error_code none;
    return EditorTexts::instance().find(path) || std::filesystem::is_regular_file(path, none);
}

}  // namespace

CheckedNetlist::CheckedNetlist(NetlistRoot root)
    : root_(std::move(root)), directory_(folder_of(root_.path)) {
    const region::Scope memory;
    EditorTexts::Recorder recorder;
    ++load_number;
    load();
    files_ = std::move(recorder.paths);
    files_.insert(root_.path);
    known_diagnostics_.clear();
}

CheckedNetlist::~CheckedNetlist() = default;

void CheckedNetlist::load() {
    ShellOptions options;
    options.check = true;
    options.keep_going = true;
    options.notes = true;
    options.directory = directory_;
    options.observer = this;
    const bool is_netlist = root_.command.empty() && root_.path.starts_with('/');
    auto nodes = is_netlist ? nodes_of({root_.path}, root_.ini) : std::vector<NodeLine>{};
    if (!nodes.empty()) return load_nodes(std::move(nodes), options);
    session_ = std::make_unique<Session>(in_editor());
    sessions_ = {session_.get()};
    for (const std::string& name : root_.assumed) {
        session_->absences().assume(name);
    }
    own_shells_.push_back(std::make_unique<Shell>(*session_, options));
    shells_ = {own_shells_.front().get()};
    NoOutput output;
    good_ = run(*shells_.front(), output);
}

void CheckedNetlist::load_nodes(std::vector<NodeLine> nodes, const ShellOptions& options) {
    cell_ = std::make_unique<Cell>(cell_name({root_.path}), std::move(nodes), in_editor(), options);
    for (std::size_t i = 0; i < cell_->size(); ++i) {
        sessions_.push_back(&cell_->session(i));
        shells_.push_back(&cell_->shell(i));
    }
    NoOutput output;
    good_ = cell_->load({root_.path}, root_.ini, output);
}

bool CheckedNetlist::run(Shell& shell, Output& output) const {
    if (!root_.ini.empty() && shell.read_ini(root_.ini, output) != 0) return false;
    if (!root_.command.empty()) return shell.run_text("<editor>", root_.command, output) == 0;
    if (root_.path.starts_with('/')) return shell.run_file(root_.path, output) == 0;
    const std::string* const text = EditorTexts::instance().find(root_.path);
    return shell.run_text(root_.path, text ? *text : "", output) == 0;
}

void CheckedNetlist::parsed(const Sources& sources, std::uint32_t source,
                            const std::vector<Command>& commands) {
    for (Session* const session : sessions_) {
        if (&session->sources != &sources) continue;
        session->sources.hold(source);  // for as long as the session
        texts_.push_back({path_of(sources, source), session, source, commands});
    }
}

std::string CheckedNetlist::path_of(const Sources& sources, std::uint32_t source) const {
    const std::string& name = sources.get(source).name;
    if (name.starts_with('<')) return "";
    if (name == root_.path) return name;
    const auto [known, fresh] = paths_.try_emplace(name);
    if (fresh) {
        const std::string path = canonical_path(resolve_path(name, directory_));
        known->second = is_file(path) ? path : "";
    }
    return known->second;
}

const TextDocument& CheckedNetlist::document(Session& session, std::uint32_t source) const {
    return document_of(session.sources, source);
}

const TextDocument& CheckedNetlist::document_of(const Sources& sources,
                                                std::uint32_t source) const {
    const auto [at, fresh] = documents_.try_emplace(DocumentKey{&sources, source});
    if (fresh) {
        at->second = TextDocument(sources.get(source).text);
    }
    return at->second;
}

std::optional<DiagnosticPlace> CheckedNetlist::place(const Sources& sources, Span span,
                                                     std::string text) const {
    if (!span.known()) return std::nullopt;
    std::string path = path_of(sources, span.source);
    if (path.empty()) return std::nullopt;
    const TextDocument& document = document_of(sources, span.source);
    return DiagnosticPlace{std::move(path), document.range(span.begin, span.end), std::move(text)};
}

void CheckedNetlist::reported(const Diagnostics& diagnostics, const Sources& sources) {
    documents_.clear();  // the number of a text that was dropped is used again
    for (const Diagnostic& one : diagnostics.all()) {
        add(one, sources);
    }
    documents_.clear();
}

void CheckedNetlist::add(const Diagnostic& diagnostic, const Sources& sources) {
    FileDiagnostic finding{.path = root_.path,
                           .range = {},
                           .severity = diagnostic.severity,
                           .code = std::string(diagnostic.code.name()),
                           .message = diagnostic.message,
                           .label = {},
                           .help = diagnostic.help,
                           .related = {}};
    bool placed = false;
    for (const Label& label : diagnostic.labels) {
        auto found = place(sources, label.span, label.text);
        const bool is_main = &label == diagnostic.labels.data();
        if (is_main) {
            finding.label = label.text;
            placed = found.has_value();
        }
        if (!found) continue;
        if (is_main) {
            finding.path = found->path;
            finding.range = found->range;
        } else {
            finding.related.push_back(std::move(*found));
        }
    }
    // of a command that no editor shows
    if (!placed && !root_.command.empty()) return;
    if (known_diagnostics_.insert(finding).second) {
        diagnostics_.push_back(std::move(finding));
    }
}

}  // namespace hal::tools

std::uint64_t hal_load_number() { return hal::tools::load_number; }
