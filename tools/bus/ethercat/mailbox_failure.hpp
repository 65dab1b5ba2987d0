// SPDX-License-Identifier: MIT
// Why a mailbox request failed, where that does not depend on its protocol.
#pragma once

#include <fmt/core.h>
#include <string>

#include "ethercat/master/mailbox.hpp"

namespace hal::tools {

/// Returns the reason as a part of a sentence; not for Outcome::done and aborted. [any]
inline std::string mailbox_failure_text(const ethercat::master::BusSlave& slave,
                                        const ethercat::master::MailboxResult& result) {
    using Outcome = ethercat::master::MailboxResult::Outcome;
    if (result.outcome == Outcome::timed_out) {
        return "no answer from its mailbox; see: hal ethercat states";
    }
    if (result.outcome == Outcome::lost) {
        return "it no longer responds; check its supply and cable";
    }
    if (!slave.mailbox.usable()) return "the slave has no mailbox";
    if (result.abort == 0) return "the request or its answer does not fit the mailbox";
    const auto error = static_cast<ethercat::MailboxError>(result.abort);
    const std::string text =
        fmt::format("mailbox error 0x{:04X} ({})", result.abort, ethercat::to_string(error));
    const bool unsupported = error == ethercat::MailboxError::protocol_not_supported;
    return unsupported ? text + "; the protocols of the slave are in: hal ethercat xml" : text;
}

}  // namespace hal::tools
