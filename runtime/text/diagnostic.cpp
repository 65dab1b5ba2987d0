// SPDX-License-Identifier: MIT
#include "text/diagnostic.hpp"

#include <iterator>

namespace hal {

void Diagnostics::add(Diagnostic diagnostic) {
    errors_ += diagnostic.severity == Severity::error;
    warnings_ += diagnostic.severity == Severity::warning;
    all_.push_back(std::move(diagnostic));
}

namespace {

Diagnostic simple(Severity severity, Code code, Span at, std::string message, std::string label, std::string help) {
    Diagnostic made{.severity = severity, .code = code, .message = std::move(message)};
    made.labels.push_back({at, std::move(label)});
    if (!help.empty()) made.help.push_back(std::move(help));
    return made;
}

}  // namespace

void Diagnostics::error(Code code, Span at, std::string message, std::string label, std::string help) {
    add(simple(Severity::error, code, at, std::move(message), std::move(label), std::move(help)));
}

void Diagnostics::warning(Code code, Span at, std::string message, std::string label, std::string help) {
    add(simple(Severity::warning, code, at, std::move(message), std::move(label), std::move(help)));
}

void Diagnostics::note(Code code, Span at, std::string message, std::string label, std::string help) {
    add(simple(Severity::note, code, at, std::move(message), std::move(label), std::move(help)));
}

void Diagnostics::clear() {
    all_.clear();
    errors_ = warnings_ = 0;
}

void Diagnostics::take(Diagnostics& other) {
    errors_ += other.errors_;
    warnings_ += other.warnings_;
    all_.insert(all_.end(), std::make_move_iterator(other.all_.begin()), std::make_move_iterator(other.all_.end()));
    other.clear();
}

}  // namespace hal
