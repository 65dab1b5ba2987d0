// SPDX-License-Identifier: MIT
#include "lsp/language_features.hpp"

#include <algorithm>
#include <filesystem>
#include <fmt/format.h>
#include <map>
#include <set>
#include <utility>

#include "commands/files.hpp"
#include "lsp/completion_items.hpp"
#include "lsp/hover_text.hpp"
#include "lsp/outline.hpp"
#include "lsp/quick_fixes.hpp"
#include "lsp/semantic_tokens.hpp"
#include "lsp/text_document.hpp"
#include "netlist/line.hpp"
#include "netlist/netlist.hpp"
#include "run/applied_changes.hpp"

namespace hal::tools {

using protocol::ErrorCode;
using protocol::Json;
using protocol::RequestError;

namespace {

constexpr const char* apply_command = "halcyon.apply";

bool is_ini(const std::string& path) { return path.ends_with(".ini"); }

bool is_netlist(const std::string& path) {
    return path.ends_with(".hal") || !path.starts_with('/');
}

bool overlap(const TextRange& a, const TextRange& b) {
    return a.begin <= b.end && b.begin <= a.end;
}

/// Returns one edit that replaces the lines which differ; nothing when none does.
std::optional<TextEdit> difference(const TextDocument& before, const TextDocument& after) {
    if (before.text() == after.text()) return std::nullopt;
    const std::uint32_t lines = std::min(before.line_count(), after.line_count());
    std::uint32_t first = 0;
    while (first < lines && before.line(first) == after.line(first)) {
        ++first;
    }
    std::uint32_t same_end = 0;
    while (same_end < lines - first && before.line(before.line_count() - 1 - same_end) ==
                                           after.line(after.line_count() - 1 - same_end)) {
        ++same_end;
    }
    const std::size_t begin = before.line_start(first);
    const std::size_t end = std::max(begin, before.line_start(before.line_count() - same_end));
    const std::size_t new_begin = after.line_start(first);
    const std::size_t new_end =
        std::max(new_begin, after.line_start(after.line_count() - same_end));
    return TextEdit{before.range(begin, end), after.text().substr(new_begin, new_end - new_begin)};
}

}  // namespace

Json LanguageFeatures::capabilities() {
    return {
        {"completionProvider", {{"triggerCharacters", {" ", ".", "["}}}},
        {"hoverProvider", true},
        {"definitionProvider", true},
        {"referencesProvider", true},
        {"documentHighlightProvider", true},
        {"documentSymbolProvider", true},
        {"renameProvider", {{"prepareProvider", true}}},
        {"codeActionProvider", {{"codeActionKinds", {"quickfix"}}}},
        {"semanticTokensProvider",
         {{"legend", semantic_legend()}, {"full", true}, {"range", true}}},
        {"documentFormattingProvider", true},
        {"inlayHintProvider", true},
        {"executeCommandProvider", {{"commands", {apply_command}}}},
    };
}

const OpenDocument& LanguageFeatures::document_of(const Json& params) const {
    const OpenDocument* const document =
        std::as_const(workspace_).find(protocol::text_at(params, "textDocument/uri"));
    if (!document) throw RequestError(ErrorCode::invalid_params, "the document is not open");
    return *document;
}

std::string LanguageFeatures::path_of(const Json& params) const {
    const OpenDocument* const document =
        std::as_const(workspace_).find(protocol::text_at(params, "textDocument/uri"));
    return document ? document->path : "";
}

std::optional<NamedThing> LanguageFeatures::thing_at(const Json& params) {
    const OpenDocument& document = document_of(params);
    const std::size_t offset = document.text.offset(protocol::position_at(params, "position"));
    const NetlistIndex* const index = workspace_.index_of(document.path);
    return index ? index->at(document.path, offset) : std::nullopt;
}

Json LanguageFeatures::completion(const Json& params) {
    const OpenDocument& document = document_of(params);
    const TextPosition at = protocol::position_at(params, "position");
    if (const ConfigurationKind* const kind = configuration_kind(document.path)) {
        return keys_.complete(*kind, document.text, at);
    }
    CheckedNetlist* const model =
        is_netlist(document.path) ? workspace_.model_of(document.path) : nullptr;
    if (!model) return {{"isIncomplete", false}, {"items", Json::array()}};
    return complete_netlist(*model, document.text, at);
}

Json LanguageFeatures::hover(const Json& params) {
    const OpenDocument& document = document_of(params);
    if (const ConfigurationKind* const kind = configuration_kind(document.path)) {
        const TextPosition at = protocol::position_at(params, "position");
        const std::string about = keys_.hover(*kind, document.text, at);
        if (about.empty()) return nullptr;
        return {{"contents", {{"kind", "markdown"}, {"value", about}}}};
    }
    const auto thing = thing_at(params);
    if (!thing) return nullptr;
    std::string text = hover_text(*workspace_.index_of(document.path),
                                  *workspace_.model_of(document.path), *thing);
    if (thing->kind == NameKind::pin || thing->kind == NameKind::signal) {
        const auto values = machine_.values({thing->name});
        if (const auto value = values.find(thing->name); value != values.end()) {
            text += fmt::format("\nvalue in the machine `{}`: **{}**\n", machine_.instance(),
                                value->second);
        }
    }
    if (text.empty()) return nullptr;
    return {{"contents", {{"kind", "markdown"}, {"value", text}}},
            {"range", protocol::to_json(document.text.range(thing->begin, thing->end))}};
}

Json LanguageFeatures::location(const Occurrence& mention) const {
    const TextDocument text = workspace_.text_of(mention.path);
    return {{"uri", workspace_.uri_of(mention.path)},
            {"range", protocol::to_json(text.range(mention.begin, mention.end))}};
}

/// Returns the beginning of the file that a word names.
Json LanguageFeatures::file_location(const OpenDocument& document, const NamedThing& thing) const {
    std::string path;
    std::string text;
    std::string ignored;
    const std::string folder = folder_of(document.path);
    if (!read_netlist(thing.name, folder, path, text, ignored)) return Json::array();
    return {{"uri", workspace_.uri_of(canonical_path(path))},
            {"range", protocol::to_json(TextRange{})}};
}

/// Returns where the INI file has the value of a [SECTION]KEY under the cursor.
Json LanguageFeatures::ini_location(const OpenDocument& document, std::size_t offset) {
    const CheckedNetlist* const netlist = workspace_.netlist_of(document.path);
    if (!netlist) return nullptr;
    const std::string_view text = document.text.text();
    const std::size_t line = document.text.line_start(document.text.position(offset).line);
    for (std::size_t at = text.find('[', line); at <= offset; at = text.find('[', at + 1)) {
        const Reference reference = reference_at(text, at);
        const bool contains = at + reference.length >= offset;
        if (reference.kind != Reference::key || !contains) continue;
        Session& session = *netlist->sessions().front();
        const Ini::Entry* const entry = session.ini.find(reference.section, reference.name);
        if (!entry || !entry->at.known()) return nullptr;
        const TextDocument& ini = netlist->document(session, entry->at.source);
        return {{"uri", workspace_.uri_of(netlist->path_of(session.sources, entry->at.source))},
                {"range", protocol::to_json(ini.range(entry->at.begin, entry->at.end))}};
    }
    return nullptr;
}

Json LanguageFeatures::definition(const Json& params) {
    const OpenDocument& document = document_of(params);
    const std::size_t offset = document.text.offset(protocol::position_at(params, "position"));
    if (Json at = ini_location(document, offset); !at.is_null()) return at;
    const auto thing = thing_at(params);
    if (!thing) return nullptr;
    if (thing->kind == NameKind::file) return file_location(document, *thing);
    Json found = Json::array();
    for (const Occurrence& made : workspace_.index_of(document.path)->definitions(*thing)) {
        if (!made.path.empty()) {
            found.push_back(location(made));
        }
    }
    return found;
}

Json LanguageFeatures::references(const Json& params) {
    const OpenDocument& document = document_of(params);
    const auto thing = thing_at(params);
    if (!thing) return Json::array();
    const Json& with_definitions = protocol::member(params, "context/includeDeclaration");
    const bool all = !with_definitions.is_boolean() || with_definitions.get<bool>();
    Json found = Json::array();
    for (const Occurrence& one : workspace_.index_of(document.path)->mentions(*thing)) {
        if (!one.path.empty() && (all || !one.defines)) {
            found.push_back(location(one));
        }
    }
    return found;
}

Json LanguageFeatures::highlights(const Json& params) {
    const OpenDocument& document = document_of(params);
    const auto thing = thing_at(params);
    Json found = Json::array();
    if (!thing) return found;
    for (const Occurrence& one : workspace_.index_of(document.path)->mentions(*thing)) {
        if (one.path == document.path) {
            found.push_back(
                {{"range", protocol::to_json(document.text.range(one.begin, one.end))}});
        }
    }
    return found;
}

Json LanguageFeatures::symbols(const Json& params) {
    const OpenDocument& document = document_of(params);
    const NetlistIndex* const index = workspace_.index_of(document.path);
    return index ? outline(*index, document.text, document.path) : Json::array();
}

Json LanguageFeatures::prepare_rename(const Json& params) {
    const OpenDocument& document = document_of(params);
    const auto thing = thing_at(params);
    if (!thing) return nullptr;
    check_renaming(*workspace_.index_of(document.path), *thing);
    return {{"range", protocol::to_json(document.text.range(thing->begin, thing->end))},
            {"placeholder", thing->name}};
}

Json LanguageFeatures::edits_to_json(const FileEdits& edits) const {
    Json changes = Json::object();
    for (const auto& [path, all] : edits) {
        Json& of_file = changes[workspace_.uri_of(path)] = Json::array();
        for (const TextEdit& edit : all) {
            of_file.push_back({{"range", protocol::to_json(edit.range)}, {"newText", edit.text}});
        }
    }
    return {{"changes", std::move(changes)}};
}

Json LanguageFeatures::rename(const Json& params) {
    const OpenDocument& document = document_of(params);
    const auto thing = thing_at(params);
    if (!thing) throw RequestError(ErrorCode::request_failed, "there is no name under the cursor");
    return edits_to_json(hal::tools::rename(workspace_, *workspace_.netlist_of(document.path),
                                            *workspace_.index_of(document.path), *thing,
                                            protocol::text_at(params, "newName")));
}

Json LanguageFeatures::code_actions(const Json& params) {
    const OpenDocument& document = document_of(params);
    const TextRange range = protocol::range_at(params, "range");
    const auto uri_of = [this](const std::string& path) { return workspace_.uri_of(path); };
    const auto all = workspace_.diagnostics();
    Json actions = Json::array();
    for (const FileDiagnostic& one : all.at(document.path)) {
        if (!overlap(one.range, range)) continue;
        const std::vector<QuickFix> fixes = quick_fixes(one, document.text);
        for (const QuickFix& fix : fixes) {
            actions.push_back(
                {{"title", fix.title},
                 {"kind", "quickfix"},
                 {"isPreferred", fixes.size() == 1},
                 {"diagnostics", {protocol::to_json(one, uri_of)}},
                 {"edit", edits_to_json({{document.path, {{fix.range, fix.text}}}})}});
        }
    }
    return actions;
}

Json LanguageFeatures::all_tokens(const Json& params) {
    const OpenDocument& document = document_of(params);
    const NetlistIndex* const index = workspace_.index_of(document.path);
    if (!index || !is_netlist(document.path)) return {{"data", Json::array()}};
    return semantic_tokens(*index, document.text, document.path,
                           document.text.range(0, document.text.text().size()));
}

Json LanguageFeatures::tokens_of_range(const Json& params) {
    const OpenDocument& document = document_of(params);
    const TextRange range = protocol::range_at(params, "range");
    const NetlistIndex* const index = workspace_.index_of(document.path);
    if (!index || !is_netlist(document.path)) return {{"data", Json::array()}};
    return semantic_tokens(*index, document.text, document.path, range);
}

/// As `hal fmt`: a text with a syntax error is left as it is.
Json LanguageFeatures::formatting(const Json& params) {
    const OpenDocument& document = document_of(params);
    if (!is_netlist(document.path)) return Json::array();
    Sources sources;
    Diagnostics diagnostics;
    const std::uint32_t source = sources.add(document.path, document.text.text());
    std::string formatted = format(sources, source, diagnostics);
    if (diagnostics.failed()) {
        throw RequestError(ErrorCode::request_failed,
                           "not formatted: " + diagnostics.all().front().message);
    }
    const auto edit = difference(document.text, TextDocument(std::move(formatted)));
    if (!edit) return Json::array();
    return Json::array({{{"range", protocol::to_json(edit->range)}, {"newText", edit->text}}});
}

namespace {

/// A hint behind a place of a text.
Json hint(TextPosition at, const std::string& label, const std::string& tooltip) {
    return {{"position", protocol::to_json(at)},
            {"label", label},
            {"tooltip", tooltip},
            {"paddingLeft", true}};
}

/// Returns the mentions of pins and signals in a range; of a net line only the signal, whose value
/// its pins have.
std::vector<const Occurrence*> mentions_with_values(const std::vector<Occurrence>& all,
                                                    const TextDocument& text, TextRange range) {
    const std::size_t begin = text.offset(range.begin);
    const std::size_t end = text.offset(range.end);
    std::vector<const Occurrence*> found;
    std::set<std::uint32_t> lines_with_signal;
    for (const Occurrence& one : all) {
        const bool has_value = one.kind == NameKind::pin || one.kind == NameKind::signal;
        if (!has_value || !one.verbatim || one.end < begin || one.begin > end) continue;
        const std::uint32_t line = text.position(one.begin).line;
        if (one.kind == NameKind::signal) {
            lines_with_signal.insert(line);
        } else if (lines_with_signal.contains(line)) {
            continue;
        }
        found.push_back(&one);
    }
    return found;
}

/// Returns where a text mentions what a fault is about: a function rather than an instance, an
/// instance rather than the thread.
const Occurrence* subject_of(const LiveMachine::Fault& fault, const std::vector<Occurrence>& all) {
    constexpr NameKind kinds[] = {NameKind::function, NameKind::instance, NameKind::thread};
    for (const NameKind kind : kinds) {
        for (const Occurrence& one : all) {
            const bool is_thread = kind == NameKind::thread && one.name == fault.thread;
            const bool named = fault.sentence.find(one.name) != std::string::npos;
            if (one.kind == kind && (named || is_thread)) return &one;
        }
    }
    return nullptr;
}

/// Returns a line about the errors of a netlist that does not load; empty: it loads.
std::string load_errors(const CheckedNetlist& netlist) {
    const auto count =
        std::ranges::count(netlist.diagnostics(), Severity::error, &FileDiagnostic::severity);
    if (netlist.good() || count == 0) return "";
    return fmt::format("{} has {} and cannot be started again as it is\n", netlist.root().path,
                       count == 1 ? "an error" : fmt::format("{} errors", count));
}

}  // namespace

void LanguageFeatures::add_faults(const OpenDocument& document, const NetlistIndex& index,
                                  Json& all) {
    const std::vector<Occurrence>& mentions = index.in_text(document.path);
    std::set<std::uint32_t> lines;
    for (const LiveMachine::Fault& fault : machine_.faults()) {
        const Occurrence* const subject = subject_of(fault, mentions);
        if (!subject) continue;
        const std::uint32_t line = document.text.position(subject->begin).line;
        if (!lines.insert(line).second) continue;  // the newest
        const std::size_t end = document.text.line_start(line) + document.text.line(line).size();
        all.push_back(hint(document.text.position(end), "fault: " + fault.sentence,
                           "fault of the machine " + machine_.instance()));
    }
}

Json LanguageFeatures::hints(const Json& params) {
    const OpenDocument& document = document_of(params);
    const TextRange range = protocol::range_at(params, "range");
    Json all = Json::array();
    if (!machine_.connect()) return all;
    const NetlistIndex* const index = workspace_.index_of(document.path);
    if (!index) return all;
    const auto mentions = mentions_with_values(index->in_text(document.path), document.text, range);
    std::vector<std::string> names;
    for (const Occurrence* const one : mentions) {
        names.push_back(one->name);
    }
    const std::map<std::string, std::string> values = machine_.values(names);
    for (const Occurrence* const one : mentions) {
        const auto value = values.find(one->name);
        if (value == values.end()) continue;
        all.push_back(hint(document.text.position(one->end), "= " + value->second,
                           "value in the machine " + machine_.instance()));
    }
    add_faults(document, *index, all);
    return all;
}

Json LanguageFeatures::inlay_hints(const Json& params) {
    hint_params_ = params;
    hints_ = hints(params);
    return hints_;
}

bool LanguageFeatures::hints_have_changed() {
    if (hint_params_.is_null()) return false;
    if (path_of(hint_params_).empty()) {
        hint_params_ = nullptr;
        return false;
    }
    Json now = hints(hint_params_);
    if (now == hints_) return false;
    hints_ = std::move(now);
    return true;
}

/// Returns a line for each open INI file that was changed since it was opened.
std::string LanguageFeatures::changed_ini_files() const {
    std::string lines;
    for (const auto& [path, document] : workspace_.documents()) {
        if (is_ini(path) && document.saved.text() != document.text.text()) {
            lines += fmt::format(
                "{} has changed since it was opened: a machine has its values "
                "from its start\n",
                path.substr(path.rfind('/') + 1));
        }
    }
    return lines;
}

/// The command "halcyon.apply" [URI]: sends the changed lines of a document to the machine. Returns
/// {"applied":…,"message":…}.
Json LanguageFeatures::execute_command(const Json& params) {
    const Json& arguments = protocol::member(params, "arguments");
    const bool has_uri = arguments.is_array() && !arguments.empty() && arguments[0].is_string();
    OpenDocument* const document =
        has_uri ? workspace_.find(arguments[0].get<std::string>()) : nullptr;
    if (protocol::text_at(params, "command") != apply_command || !document) {
        throw RequestError(ErrorCode::invalid_params,
                           std::string("write ") + apply_command + " with the URI of a document");
    }
    if (is_ini(document->path)) {
        return {{"applied", false},
                {"message",
                 "an INI file has values for netlists and no commands: a machine "
                 "has them from its start"}};
    }
    const CheckedNetlist* const netlist = workspace_.netlist_of(document->path);
    if (!netlist) throw RequestError(ErrorCode::request_failed, "the document is not a netlist");
    const Ini& ini = netlist->sessions().front()->ini;
    const NetlistChanges changes =
        netlist_changes(document->saved.text(), document->text.text(), ini);
    std::string message = load_errors(*netlist) + changed_ini_files();
    for (const std::string& reason : changes.not_sent) {
        message += reason + "\n";
    }
    if (changes.removed.empty() && changes.changed.empty()) {
        for (const std::string& reason : document->not_sent) {
            message += "not sent before: " + reason + "\n";
        }
        const bool has_reason = !changes.not_sent.empty() || !document->not_sent.empty();
        message += has_reason ? "no other line has changed" : "no line has changed";
        return {{"applied", false}, {"message", message}};
    }
    const LiveMachine::Applied applied =
        machine_.apply({{"<removed lines>", changes.removed}, {document->path, changes.changed}},
                       ini, folder_of(document->path));
    if (!applied.good) return {{"applied", false}, {"message", message + applied.text}};
    document->saved = document->text;
    document->not_sent.insert(document->not_sent.end(), changes.not_sent.begin(),
                              changes.not_sent.end());
    return {{"applied", true},
            {"message",
             message + applied.text +
                 fmt::format("the changes took effect in the machine '{}'", machine_.instance())}};
}

}  // namespace hal::tools
