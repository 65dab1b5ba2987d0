// SPDX-License-Identifier: MIT
#include "model/absence.hpp"

#include <algorithm>
#include <cctype>

#include "text/quoting.hpp"

namespace hal {
namespace {

std::string_view head_of(std::string_view name) { return name.substr(0, name.find('.')); }

/// One letter too many, missing, wrong or swapped with its neighbour. Other digits are another
/// name, not a typing error.
bool mistyped(std::string_view a, std::string_view b) {
    if (a.size() > b.size()) {
        std::swap(a, b);
    }
    if (b.size() < 3 || b.size() - a.size() > 1) return false;
    const auto differ = std::mismatch(a.begin(), a.end(), b.begin());
    const auto at = static_cast<std::size_t>(differ.first - a.begin());
    const auto digit = [](std::string_view text, std::size_t i) {
        return i < text.size() && std::isdigit(static_cast<unsigned char>(text[i]));
    };
    if (digit(a, at) || digit(b, at)) return false;
    if (a.size() != b.size()) return a.substr(at) == b.substr(at + 1);
    if (a.substr(std::min(at + 1, a.size())) == b.substr(std::min(at + 1, b.size()))) return true;
    return at + 1 < a.size() && a[at] == b[at + 1] && a[at + 1] == b[at] &&
           a.substr(at + 2) == b.substr(at + 2);
}

}  // namespace

Absences::Cause Absences::add(std::string what, std::string why, Span at, Scope scope) {
    causes_.push_back({std::move(what), std::move(why), at, scope});
    open_ = open_ || scope != Scope::names;
    return causes_.size() - 1;
}

void Absences::assume(const std::string& name) {
    const Cause cause = add(hal::quoted(name), "which is assumed to exist", {}, Scope::names);
    assumed_.emplace(name, cause);
    note(name, cause);
    std::string dashed = name;
    std::replace(dashed.begin(), dashed.end(), '_', '-');
    note(std::move(dashed), cause);
}

void Absences::note_program(const std::string& program, const std::vector<std::string>& names,
                            std::vector<std::string> arguments) {
    programs_.push_back({program, std::move(arguments)});
    const Cause cause =
        add("program " + hal::quoted(program), "which is not started here", {}, Scope::names);
    for (const std::string& name : names) {
        note(name, cause);
    }
}

const std::string* Absences::argument_of(const std::string& program) const {
    const auto last = std::find_if(programs_.rbegin(), programs_.rend(),
                                   [&](const Program& one) { return one.name == program; });
    if (last == programs_.rend() || last->arguments.empty()) return nullptr;
    return &last->arguments.front();
}

void Absences::note_missing_text(const std::string& path) {
    add("file " + hal::quoted(path), "which cannot be read", {}, Scope::file);
}

std::optional<Absences::Cause> Absences::assumed(const std::string& component) {
    const auto found = assumed_.find(component);
    if (found == assumed_.end()) {
        return {};
    }
    causes_[found->second].scope = Scope::component;
    open_ = true;
    return found->second;
}

void Absences::count(Cause cause) {
    last_ = cause;
    Entry& entry = causes_[cause];
    if (entry.lines > 0 && entry.counted.source == command_.source &&
        entry.counted.begin == command_.begin) {
        return;
    }
    if (entry.lines++ == 0) {
        entry.first = command_;
    }
    entry.counted = command_;
    const bool is_counted =
        unchecked_.source == command_.source && unchecked_.begin == command_.begin;
    if (unchecked_lines_ == 0 || !is_counted) {
        ++unchecked_lines_;
    }
    unchecked_ = command_;
}

/// Nothing that is there has such names, so it is not a typing error in one of them.
bool Absences::foreign(std::string_view name, Kind kind, const Model& model) {
    if (kind == Kind::signal || kind == Kind::thread) {
        const auto near = [&](const auto& index) {
            return std::any_of(index.begin(), index.end(),
                               [&](const auto& entry) { return mistyped(name, entry.first); });
        };
        return kind == Kind::signal ? !near(model.signal) : !near(model.thread);
    }
    if (const std::size_t names = model.pin.size() + model.function.size(); names != heads_of_) {
        heads_of_ = names;
        heads_.clear();
        for (const auto& [pin, object] : model.pin) {
            heads_.emplace(head_of(pin));
        }
        for (const auto& [function, object] : model.function) {
            heads_.emplace(head_of(function));
        }
        for (const auto& [instance, object] : model.instance) {
            heads_.emplace(head_of(instance));
        }
    }
    const std::string head(head_of(name));
    return !heads_.contains(head) &&
           std::none_of(heads_.begin(), heads_.end(),
                        [&](const std::string& one) { return mistyped(head, one); });
}

bool Absences::explains(std::string_view name, Kind kind, const Model& model) {
    last_.reset();
    if (names_.empty() && causes_.empty()) return false;
    for (std::size_t end = name.size(); end != std::string_view::npos && end != 0;
         end = name.rfind('.', end - 1)) {
        if (const auto found = names_.find(std::string(name.substr(0, end)));
            found != names_.end()) {
            if (found->second) {
                count(*found->second);
            }
            return true;
        }
    }
    const Scope min = kind == Kind::signal ? Scope::file : Scope::component;
    const auto may_have = [&](const Entry& entry) {
        return entry.scope >= min && !entry.what.empty();
    };
    const auto first = std::find_if(causes_.begin(), causes_.end(), may_have);
    if (first == causes_.end() || !foreign(name, kind, model)) return false;
    if (std::none_of(first + 1, causes_.end(), may_have)) {
        count(static_cast<Cause>(first - causes_.begin()));
        return true;
    }
    if (!several_) {
        several_ = add("", "", {}, Scope::names);
    }
    count(*several_);
    return true;
}

void Absences::report(Entry& entry, std::vector<Diagnostic>& all) const {
    const std::string lines = counted(entry.lines, "line");

    const std::string depend = entry.lines == 1 ? " depends on " : " depend on ";

    const std::string unchecked = entry.lines == 1 ? "it was not checked" : "they were not checked";
    const auto error = std::find_if(all.begin(), all.end(), [&](const Diagnostic& one) {
        return one.severity == Severity::error && !one.labels.empty() && entry.at.known() &&
               one.labels[0].span.source == entry.at.source &&
               one.labels[0].span.begin == entry.at.begin;
    });
    if (error != all.end()) {
        error->help.insert(error->help.begin(), lines + depend + "it; " + unchecked);
        return;
    }
    Diagnostic made{
        .severity = entry.at.known() || entry.what.empty() ? Severity::warning : Severity::note,
        .code = "unchecked-lines",
        .message = ""};
    made.labels.push_back({entry.first, entry.lines == 1 ? "" : "the first of them"});
    if (!entry.what.empty()) {
        made.message = lines + depend + entry.what + ", " + entry.why + "; " + unchecked;
        if (entry.at.known()) {
            made.labels.push_back({entry.at, "missing from here on"});
        }
    } else {
        made.message = lines + (entry.lines == 1 ? " refers" : " refer") +
                       " to names that no loaded component has; " + unchecked;
        std::vector<std::string> missing;
        for (const Entry& one : causes_) {
            if (one.scope != Scope::names) {
                missing.push_back(one.what);
            }
        }
        made.help.push_back("possibly from " + listed(missing));
    }
    all.push_back(std::move(made));
}

void Absences::report(Diagnostics& diagnostics) {
    if (std::none_of(causes_.begin(), causes_.end(),
                     [](const Entry& entry) { return entry.lines > 0; })) {
        return;
    }
    std::vector<Diagnostic> all = diagnostics.all();
    for (Entry& entry : causes_) {
        if (entry.lines > 0) {
            report(entry, all);
        }
        entry.lines = 0;
    }
    diagnostics.clear();
    for (Diagnostic& one : all) {
        diagnostics.add(std::move(one));
    }
}

}  // namespace hal
