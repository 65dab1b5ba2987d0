// SPDX-License-Identifier: MIT
// What the start-up of a slave needs of its mailbox; the mailbox clients implement it.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "ethercat/master/bus_slave.hpp"
#include "ethercat/master/channel.hpp"
#include "ethercat/master/events.hpp"

namespace hal::ethercat::master {

/// Result of an SDO transfer.
struct SdoResult {
    enum class Outcome : std::uint8_t {
        done,
        aborted,    ///< `abort` has the code
        timed_out,  ///< no answer
        lost,       ///< the slave does not answer datagrams
        refused,    ///< no mailbox, a mailbox error, or an answer that does not fit
    } outcome = Outcome::timed_out;
    std::uint32_t abort = 0;  ///< SDO abort code, or the code of a mailbox error
    std::size_t length = 0;   ///< bytes of an upload
    explicit operator bool() const noexcept { return outcome == Outcome::done; }
};

/// Returns the code of a failed exchange as events carry it: the abort code, or
/// mailbox_error_flag and the code of a mailbox error. [any]
constexpr std::int64_t event_code(const SdoResult& result) noexcept {
    const bool rejected = result.outcome == SdoResult::Outcome::refused && result.abort != 0;
    return std::int64_t{result.abort} | (rejected ? mailbox_error_flag : 0);
}

/// SDO transfers with one slave (ETG.1000.6, clause 5.6.2). The buffers must outlive the task.
class CoeAccess {
public:
    virtual ~CoeAccess() = default;
    /// Reads an object into `to`; `complete`: all its sub-indexes. [realtime]
    virtual Task<SdoResult> upload(Channel&, BusSlave&, std::uint16_t index, std::uint8_t sub,
                                   bool complete, std::span<std::uint8_t> to) noexcept = 0;
    /// Writes an object. [realtime]
    virtual Task<SdoResult> download(Channel&, BusSlave&, std::uint16_t index, std::uint8_t sub,
                                     bool complete,
                                     std::span<const std::uint8_t> from) noexcept = 0;
    /// Writes a value over another protocol than CoE: SoE, AoE. [realtime]
    virtual Task<SdoResult> write_other(Channel&, BusSlave&, const StartupWrite&) noexcept {
        co_return SdoResult{SdoResult::Outcome::refused};
    }
    /// Writes the settings of the IP stack (EoE). [realtime]
    virtual Task<SdoResult> set_ip(Channel&, BusSlave&, const eoe::Ip&) noexcept {
        co_return SdoResult{SdoResult::Outcome::refused};
    }
    /// Forgets the counters of the mailbox and ends the exchange under way, after the sync managers
    /// of the slave were configured anew. [realtime]
    virtual void reset_mailbox(const BusSlave&) noexcept {}
};

}  // namespace hal::ethercat::master
