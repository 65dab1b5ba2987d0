// SPDX-License-Identifier: MIT
#include "text/diagnostic.hpp"

#include <iterator>
#include <map>

#include "text/rendered_order.hpp"

namespace hal {

void Diagnostics::add(Diagnostic diagnostic) {
    errors_ += diagnostic.severity == Severity::error;
    warnings_ += diagnostic.severity == Severity::warning;
    all_.push_back(std::move(diagnostic));
}

namespace {

Diagnostic simple(Severity severity, Code code, Span at, std::string message, std::string label,
                  std::string help) {
    Diagnostic made{.severity = severity, .code = code, .message = std::move(message)};
    made.labels.push_back({at, std::move(label)});
    if (!help.empty()) {
        made.help.push_back(std::move(help));
    }
    return made;
}

}  // namespace

void Diagnostics::error(Code code, Span at, std::string message, std::string label,
                        std::string help) {
    add(simple(Severity::error, code, at, std::move(message), std::move(label), std::move(help)));
}

void Diagnostics::warning(Code code, Span at, std::string message, std::string label,
                          std::string help) {
    add(simple(Severity::warning, code, at, std::move(message), std::move(label), std::move(help)));
}

void Diagnostics::note(Code code, Span at, std::string message, std::string label,
                       std::string help) {
    add(simple(Severity::note, code, at, std::move(message), std::move(label), std::move(help)));
}

void Diagnostics::error(Code code, Span at, std::string message, UnknownName unknown,
                        std::string help) {
    Diagnostic made = simple(Severity::error, code, at, std::move(message), "", std::move(help));
    made.unknown = std::move(unknown);
    add(std::move(made));
}

void Diagnostics::offer(
    const std::function<std::shared_ptr<const NameIndex>(std::uint32_t)>& names) {
    std::map<std::uint32_t, std::shared_ptr<const NameIndex>> offered;
    for (Diagnostic& one : all_) {
        if (!one.unknown || one.unknown->among) continue;
        auto& among = offered[one.unknown->group];
        if (!among) {
            among = names(one.unknown->group);
        }
        one.unknown->among = among;
    }
}

void Diagnostics::look_up(const std::stop_token& stop) {
    for (const std::size_t i : rendered_order(*this)) {
        Diagnostic& one = all_[i];
        if (!one.unknown || !one.unknown->among) continue;
        one.labels[0].text =
            did_you_mean(one.unknown->name, *one.unknown->among, one.unknown->before, stop);
        one.unknown.reset();
    }
}

void Diagnostics::clear() {
    all_.clear();
    errors_ = warnings_ = 0;
}

void Diagnostics::take(Diagnostics& other) {
    errors_ += other.errors_;
    warnings_ += other.warnings_;
    all_.insert(all_.end(), std::make_move_iterator(other.all_.begin()),
                std::make_move_iterator(other.all_.end()));
    other.clear();
}

}  // namespace hal
