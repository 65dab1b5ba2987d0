// SPDX-License-Identifier: MIT
// How a link is opened under the journal of the program that uses it. [setup]
#pragma once

#include <functional>
#include <string>
#include <utility>

#include "link/call_journal.hpp"

namespace hal::link {

/// Opens a link with `open`, except when a journal is executed again: then nothing is opened, and
/// the result is empty.
template <class Opened>
Opened open_unless_repeated(const std::function<Opened()>& open) {
    if (journal_mode() == JournalMode::executes_again) return {};
    const OpeningLink opening;
    return open();
}

/// Records whether a link was opened and why not, or replaces that by what was recorded. Returns
/// whether it was; if not, `problem` is the reason. `kind` is the noun for a link in a message.
inline bool exchange_opening(JournaledCall& call, bool is_open, std::string& problem,
                             const char* kind) {
    call.number(is_open);
    if (is_open) return true;
    call.text(problem);
    if (problem.empty()) {
        problem = std::string("the journal does not have this ") + kind;
    }
    return false;
}

/// Opens a link whose results are journaled. `wrap(call, link)` exchanges the description of the
/// link with the journal and returns the link that journals its calls; its `link` is nullptr when
/// the journal is executed again. Without a journal, the link is the one that `open` returns.
template <class Opened, class Wrap>
Opened open_journaled(const std::function<Opened()>& open, const char* kind, Wrap wrap) {
    if (journal_mode() == JournalMode::none) return open();
    auto [link, problem] = open_unless_repeated(open);
    JournaledCall call;
    if (!exchange_opening(call, link != nullptr, problem, kind)) {
        return {nullptr, std::move(problem)};
    }
    return {wrap(call, std::move(link)), {}};
}

}  // namespace hal::link
