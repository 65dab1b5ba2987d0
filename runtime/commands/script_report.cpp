// SPDX-License-Identifier: MIT
// The end of a transaction of a text, and what is printed about it.
#include <algorithm>
#include <map>
#include <new>
#include <set>
#include <utility>

#include "commands/script.hpp"
#include "netlist/line.hpp"
#include "text/quoting.hpp"

namespace hal {
namespace {

constexpr std::size_t most_labels = 5;  // of a diagnostic, those of values included

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
            text += (text.empty() ? "" : ", ") + counted(number, noun);
        }
    };
    add(errors, "error");
    add(warnings, "warning");
    add(notes, "note");
    return text;
}

/// "lines 1 to 4 and 7 of a.hal, line 2 of b.hal". Lines of `others` end a run.
std::string lines_of(const Sources& sources, const std::vector<Span>& spans,
                     const std::vector<Span>& others, bool several) {
    std::map<std::uint32_t, std::set<std::uint32_t>> lines, breaks;
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
        std::vector<std::pair<std::uint32_t, std::uint32_t>> runs;
        for (const std::uint32_t line : lines[source]) {
            const auto between = runs.empty() ? breaks[source].end()
                                              : breaks[source].lower_bound(runs.back().second);
            if (runs.empty() || (between != breaks[source].end() && *between <= line)) {
                runs.push_back({line, line});
            } else {
                runs.back().second = line;
            }
        }
        std::string row;
        for (std::size_t i = 0; i < runs.size(); ++i) {
            if (i == 0) {
                row += "";
            } else if (i + 1 == runs.size()) {
                row += " and ";
            } else {
                row += ", ";
            }
            row += std::to_string(runs[i].first);
            if (runs[i].second != runs[i].first) {
                row += " to " + std::to_string(runs[i].second);
            }
        }
        text += text.empty() ? "" : ", ";
        text += (runs.size() == 1 && runs[0].first == runs[0].second ? "line " : "lines ") + row;
        if (several) {
            text += " of " + sources.get(source).name;
        }
    }
    return text;
}

}  // namespace

void Script::finish() {
    if (!transaction_ && edits_ == 0 && pending_.all().empty()) return;
    const std::size_t edits = std::exchange(edits_, 0);
    const bool open = transaction_.has_value();
    if (locks_ && transaction_) {
        transaction_->when_committed(
            [&session = session_, locks = *locks_] { session.locked = locks; });
    }
    const bool took_effect = open && transaction_->commit(pending_);
    transaction_.reset();
    locks_.reset();
    Diagnostics found;
    found.take(pending_);
    const bool failed = found.failed() || (open && !took_effect);
    auto& where = failed ? idle_ : effective_;
    where.insert(where.end(), lines_.begin(), lines_.end());
    lines_.clear();
    report(found, edits, took_effect);
    if (!failed) return;
    errors_ += found.errors();
    failed_ = true;
    if (!separately()) {
        stopped_ = true;
    }
}

void Script::report(Diagnostics& found, std::size_t edits, bool took_effect) {
    const ShellOptions& options = shell_.options;
    if (options.level == Level::nothing) return;
    look_up_names(found);
    Diagnostics shown;
    for (const Diagnostic& one : found.all()) {
        if (one.severity != Severity::note || options.notes || options.level >= Level::results) {
            shown.add(with_values(one));
        }
    }
    if (!shown.all().empty()) {
        std::string text = render(shown, session_.sources, options.color);
        const std::string counts = "\n" + summary(shown.errors(), shown.warnings(), shown.notes());
        if (!separately() && options.check) {
            if (edits > 0 || shown.errors() > 1) {
                text += counts + "\n";
            }
        } else if (!separately() && shown.failed()) {
            if (const std::string became = outcome(edits > 0); !became.empty()) {
                text += counts + "; " + became + "\n";
            }
        } else if (!separately() && edits > 0) {
            text += counts + "; the edit took effect\n";
        }
        output_.err(text);
    } else if (options.level >= Level::results && edits > 0 && took_effect) {
        output_.err(counted(edits, "edit") + " took effect\n");
    }
}

Diagnostic Script::with_values(Diagnostic diagnostic) const {
    if (diagnostic.severity != Severity::error || diagnostic.labels.empty()) return diagnostic;
    const std::string_view text = session_.sources.text(diagnostic.labels.front().span);
    const Ini& ini = state_.ini ? *state_.ini : session_.ini;
    bool has_comment = false;
    for (std::size_t at = text.find('['); at != text.npos && diagnostic.labels.size() < most_labels;
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
        has_comment = has_comment || entry->value.find(" #") != std::string::npos ||
                      entry->value.find(" ;") != std::string::npos;
    }
    if (has_comment) {
        diagnostic.help.push_back(
            "in an INI file a comment has a line of its own: behind a value it is part of the "
            "value");
    }
    return diagnostic;
}

namespace {

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

/// Many similar names take long to find: meanwhile others use the machine. No transaction is open
/// here.
void Script::look_up_names(Diagnostics& found) {
    const auto unknown = [](const Diagnostic& one) { return one.unknown.has_value(); };
    if (std::none_of(found.all().begin(), found.all().end(), unknown)) return;
    session_.offer_names(found);
    for (const Diagnostic& one : found.all()) {
        if (one.unknown && one.unknown->among) {
            names_.insert(one.unknown->among);
        }
    }
    lock_.unlock();
    try {
        found = looked_up(found, session_);
    } catch (const std::bad_alloc&) {  // render() looks them up
    }
    lock_.lock();
}

std::string Script::outcome(bool edited) const {
    std::vector<Span> without = idle_;
    for (std::size_t i = collected_before_; i < state_.collected.size(); ++i) {
        without.push_back(state_.collected[i].span);
    }
    const bool alone = without.size() <= 1;  // nothing but the line with the error
    for (auto row = rows_.rbegin(); row != rows_.rend(); ++row) {
        for (std::size_t i = row->next; i < row->end; ++i) {
            without.push_back((*row->commands)[i].span);
        }
    }
    if (effective_.empty() && !half_done_) {
        return edited || !alone || without.size() > 1 ? "nothing was changed" : "";
    }
    bool several = false;
    const Span* first = nullptr;
    for (const auto* const spans : {&effective_, &std::as_const(without)}) {
        for (const Span& span : *spans) {
            if (!span.known()) continue;
            if (!first) {
                first = &span;
            }
            several = several || span.source != first->source;
        }
    }
    std::string text;
    if (!effective_.empty()) {
        text = lines_of(session_.sources, effective_, without, several) + " took effect";
    }
    if (!without.empty()) {
        text += (text.empty() ? "" : "; ") +
                lines_of(session_.sources, without, effective_, several) + " had no effect";
    }
    return text;
}

bool Script::ended(const Command& command) {
    if (!session_.ending()) return false;
    if (!pending_.failed()) {
        report_end(command);
    }
    finish();
    stopped_ = true;
    return true;
}

void Script::report_end(const Command& command) {
    pending_.error("interrupted", command.span,
                   "'" + command.name.text + "' was interrupted: the machine ends");
}

bool Script::interrupted(Context& context) {
    if (!state_.cancelled.load(std::memory_order_relaxed) && !session_.ending()) return false;
    if (!context.diagnostics.failed()) {
        context.diagnostics.error("interrupted", context.command.span,
                                  "'" + context.command.name.text + "' was interrupted");
    }
    return true;
}

bool Context::interrupted() { return script.interrupted(*this); }

}  // namespace hal
