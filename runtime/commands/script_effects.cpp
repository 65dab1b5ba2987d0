// SPDX-License-Identifier: MIT
#include "commands/script_effects.hpp"

#include <algorithm>
#include <map>
#include <new>
#include <utility>

#include "netlist/line.hpp"
#include "text/quoting.hpp"

namespace hal {
namespace {

constexpr std::size_t max_labels = 5;  // of a diagnostic, those of values included

/// Returns the value as a message has it: the beginning of a long one.
std::string shortened(const std::string& value) {
    constexpr std::size_t max_size = 80;
    if (value.size() <= max_size) return value;
    std::size_t end = max_size;
    // not within a character
    while (end > 0 && (static_cast<unsigned char>(value[end]) & 0xC0) == 0x80) {
        --end;
    }
    return value.substr(0, end) + "…";
}

/// " # rest" or " ; rest" behind a value of an INI file.
bool seems_to_have_comment(const std::string& value) {
    return value.find(" #") != std::string::npos || value.find(" ;") != std::string::npos;
}

Diagnostics without_names(Diagnostic one) {
    one.unknown.reset();
    Diagnostics single;
    single.add(std::move(one));
    return single;
}

std::string summary(std::size_t errors, std::size_t warnings, std::size_t notes) {
    std::string text;
    const auto add = [&](std::size_t number, const char* noun) {
        if (number > 0) {
            append_item(text, counted(number, noun));
        }
    };
    add(errors, "error");
    add(warnings, "warning");
    add(notes, "note");
    return text;
}

using Lines = std::map<std::uint32_t, std::set<std::uint32_t>>;  // by source
using LineRun = std::pair<std::uint32_t, std::uint32_t>;         // the first and the last line

/// Returns the lines of a source as runs. Lines of `breaks` end a run.
std::vector<LineRun> runs_of(const std::set<std::uint32_t>& lines,
                             const std::set<std::uint32_t>& breaks) {
    std::vector<LineRun> runs;
    for (const std::uint32_t line : lines) {
        bool continues = !runs.empty();
        if (continues) {
            const auto between = breaks.lower_bound(runs.back().second);
            continues = between == breaks.end() || *between > line;
        }
        if (continues) {
            runs.back().second = line;
        } else {
            runs.push_back({line, line});
        }
    }
    return runs;
}

/// "line 4", "lines 1 to 4 and 7"
std::string text_of(const std::vector<LineRun>& runs) {
    std::vector<std::string> texts;
    for (const auto& [first, last] : runs) {
        const std::string range = last == first ? "" : " to " + std::to_string(last);
        texts.push_back(std::to_string(first) + range);
    }
    std::string text = texts.front();
    for (std::size_t i = 1; i < texts.size(); ++i) {
        text += (i + 1 == texts.size() ? " and " : ", ") + texts[i];
    }
    const bool single = runs.size() == 1 && runs[0].first == runs[0].second;
    return (single ? "line " : "lines ") + text;
}

/// "lines 1 to 4 and 7 of a.hal, line 2 of b.hal". Lines of `others` end a run.
std::string lines_of(const Sources& sources, const std::vector<Span>& spans,
                     const std::vector<Span>& others, bool several) {
    Lines lines, breaks;
    std::vector<std::uint32_t> order;
    for (const Span span : spans) {
        if (!span.known()) continue;
        if (!lines.contains(span.source)) {
            order.push_back(span.source);
        }
        lines[span.source].insert(sources.place(span).line);
    }
    for (const Span span : others) {
        if (span.known()) {
            breaks[span.source].insert(sources.place(span).line);
        }
    }
    std::string text;
    for (const std::uint32_t source : order) {
        append_item(text, text_of(runs_of(lines[source], breaks[source])));
        if (several) {
            text += " of " + sources.get(source).name;
        }
    }
    return text;
}

/// Returns true when the known ones are of several sources.
bool of_several_sources(const std::vector<Span>& spans, const std::vector<Span>& others) {
    std::set<std::uint32_t> sources;
    for (const auto* const all : {&spans, &others}) {
        for (const Span& span : *all) {
            if (span.known()) {
                sources.insert(span.source);
            }
        }
    }
    return sources.size() > 1;
}

/// Returns the same diagnostics with the similar names of the first ones, one after the other, so
/// that the end of the machine interrupts it.
Diagnostics looked_up(const Diagnostics& found, const Session& session) {
    constexpr std::size_t max_count = 100;  // as many as are rendered
    Diagnostics all;
    for (const Diagnostic& one : found.all()) {
        Diagnostics single;
        single.add(one);
        if (session.ending()) {
            single = without_names(one);
        } else if (all.all().size() < max_count) {
            single.look_up(session.end_token());
        }
        all.take(single);
    }
    return all;
}

}  // namespace

void ScriptEffects::report(Diagnostics& found, const ScriptOutcome& outcome) {
    auto& where = outcome.failed ? idle_ : effective_;
    where.insert(where.end(), lines_.begin(), lines_.end());
    lines_.clear();
    errors_ += found.errors();
    const ShellOptions& options = shell_.options;
    if (options.level == Level::nothing) return;
    look_up_names(found);
    const bool with_notes = options.notes || options.level >= Level::results;
    Diagnostics shown;
    for (const Diagnostic& one : found.all()) {
        if (one.severity != Severity::note || with_notes) {
            shown.add(with_values(one));
        }
    }
    if (!shown.all().empty()) {
        if (options.observer) {
            options.observer->reported(shown, state_.session.sources);
        }
        output_.err(render_shown(shown, outcome));
    } else if (options.level >= Level::results && outcome.edits > 0 && outcome.took_effect) {
        output_.err(counted(outcome.edits, "edit") + " took effect\n");
    }
}

std::string ScriptEffects::render_shown(const Diagnostics& shown,
                                        const ScriptOutcome& outcome) const {
    const bool edited = outcome.edits > 0;
    std::string text = render(shown, state_.session.sources, shell_.options.color);
    if (outcome.separately) return text;
    const std::string counts = "\n" + summary(shown.errors(), shown.warnings(), shown.notes());
    if (shell_.options.check) {
        return edited || shown.errors() > 1 ? text + counts + "\n" : text;
    }
    if (shown.failed()) {
        const std::string became = failure_text(outcome);
        return became.empty() ? text : text + counts + "; " + became + "\n";
    }
    return edited ? text + counts + "; the edit took effect\n" : text;
}

/// Adds where the INI file has the values that the words at the main span of an error have.
Diagnostic ScriptEffects::with_values(Diagnostic diagnostic) const {
    if (diagnostic.severity != Severity::error || diagnostic.labels.empty()) return diagnostic;
    const std::string_view text = state_.session.sources.text(diagnostic.labels.front().span);
    const Ini& ini = state_.ini ? *state_.ini : state_.session.ini;
    bool has_comment = false;
    for (std::size_t at = text.find('['); at != text.npos && diagnostic.labels.size() < max_labels;
         at = text.find('[', at + 1)) {
        const Reference reference = reference_at(text, at);
        const Ini::Entry* const entry = reference.kind == Reference::key
                                            ? ini.find(reference.section, reference.name)
                                            : nullptr;
        if (!entry) continue;
        std::string value = std::string(text.substr(at, reference.length)) + " is '" +
                            shortened(entry->value) + "'";
        if (!entry->at.known() && !entry->place.empty()) {
            value += " in " + entry->place;
        }
        diagnostic.labels.push_back({entry->at, std::move(value)});
        has_comment = has_comment || seems_to_have_comment(entry->value);
    }
    if (has_comment) {
        diagnostic.help.push_back(
            "in an INI file a comment has a line of its own: behind a value it is part of the "
            "value");
    }
    return diagnostic;
}

/// Many similar names take long to find: meanwhile others use the machine. No transaction is open
/// here.
void ScriptEffects::look_up_names(Diagnostics& found) {
    const auto unknown = [](const Diagnostic& one) { return one.unknown.has_value(); };
    if (std::none_of(found.all().begin(), found.all().end(), unknown)) return;
    state_.session.offer_names(found);
    for (const Diagnostic& one : found.all()) {
        if (one.unknown && one.unknown->among) {
            names_.insert(one.unknown->among);
        }
    }
    lock_.unlock();
    try {
        found = looked_up(found, state_.session);
    } catch (const std::bad_alloc&) {  // render() looks them up
    }
    lock_.lock();
}

/// After a failure: "nothing was changed", or which lines took effect and which did not.
std::string ScriptEffects::failure_text(const ScriptOutcome& outcome) const {
    std::vector<Span> without = idle_;
    without.insert(without.end(), outcome.collected.begin(), outcome.collected.end());
    const bool alone = without.size() <= 1;  // nothing but the line with the error
    without.insert(without.end(), outcome.not_reached.begin(), outcome.not_reached.end());
    if (effective_.empty() && !half_done_) {
        const bool several_lines = !alone || without.size() > 1;
        return outcome.edits > 0 || several_lines ? "nothing was changed" : "";
    }
    const Sources& sources = state_.session.sources;
    const bool several = of_several_sources(effective_, without);
    std::string text;
    if (!effective_.empty()) {
        text = lines_of(sources, effective_, without, several) + " took effect";
    }
    if (without.empty()) return text;
    return text + (text.empty() ? "" : "; ") + lines_of(sources, without, effective_, several) +
           " had no effect";
}

}  // namespace hal
