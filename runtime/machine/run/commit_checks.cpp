// SPDX-License-Identifier: MIT
#include "machine/run/commit_checks.hpp"

#include <algorithm>
#include <set>
#include <string_view>

#include "model/check/check.hpp"

namespace hal {
namespace {

// What may still be incomplete after a single shell line (net before addf) is checked for whole
// files only.
void check_all(const Model& model, CommitChecks::Scope scope, Diagnostics& diagnostics) {
    check_periods(model, diagnostics);
    check_spread_pins(model, diagnostics);
    check_repeated_steps(model, diagnostics);
    check_arrows(model, diagnostics);
    if (!scope.whole) return;
    // a file that has looked at its values before its first addf is not complete yet
    const bool scheduled =
        std::any_of(model.threads.begin(), model.threads.end(),
                    [](const auto& thread) { return !thread->functions.empty(); });
    if ((scope.complete || scheduled) && !scope.open) {
        check_unthreaded_functions(model, Unthreaded::all, diagnostics);
    }
    check_cross_thread_io(model, diagnostics);
    check_stale_reads(model, diagnostics);
}

}  // namespace

void CommitChecks::run(const Model& model, Scope scope, Diagnostics& diagnostics) {
    Diagnostics found;
    check_all(model, scope, found);
    forget_fixed(found, scope.whole);
    report_removed_functions(model, diagnostics);
    check_lost_writers(model, diagnostics);
    for (const Diagnostic& one : found.all()) {
        const bool is_new = reported_.emplace(one.message, scope.whole).second;
        if (is_new || (one.severity == Severity::error && !scope.complete)) {
            diagnostics.add(one);
        }
    }
}

/// Forgets the messages that this check would have found but did not: they no longer hold.
void CommitChecks::forget_fixed(const Diagnostics& found, bool whole) {
    if (reported_.empty()) return;
    std::set<std::string_view> messages;
    for (const Diagnostic& one : found.all()) {
        messages.insert(one.message);
    }
    std::erase_if(reported_, [&](const auto& entry) {
        return (whole || !entry.second) && !messages.contains(entry.first);
    });
}

/// Warns of the functions that this edit removed from their threads, also when it is a single
/// command, and each time that they are removed.
void CommitChecks::report_removed_functions(const Model& model, Diagnostics& diagnostics) {
    Diagnostics removed;
    check_unthreaded_functions(model, Unthreaded::removed, removed);
    for (const Diagnostic& one : removed.all()) {
        reported_.insert_or_assign(one.message, true);
        diagnostics.add(one);
    }
}

}  // namespace hal
