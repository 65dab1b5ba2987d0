// SPDX-License-Identifier: MIT
// File access over EtherCAT as the master uses it (ETG.1000.6, clause 5.8): files to and from a
// slave, its firmware in BOOT.
#pragma once

#include <array>
#include <atomic>
#include <cstdint>
#include <span>
#include <string_view>

#include "ethercat/master/mailbox.hpp"
#include "ethercat/wire/foe.hpp"

namespace hal::ethercat::master {

struct FoeOptions {
    std::uint32_t password = 0;
    std::uint32_t timeout_ms = 20000;  ///< for each packet: a slave may erase its flash
    std::uint32_t busy_ms = 60000;     ///< for which a slave may report busy without progress
};

/// Progress of a transfer, written by the cycle, read by any thread; and the text of an error,
/// valid after the end.
struct FoeProgress {
    std::atomic<std::uint32_t> bytes{0};
    std::atomic<std::uint16_t> done{0};
    std::atomic<std::uint16_t> entire{0};  ///< what a busy slave reports, often in percent
    /// of the slave's error, terminated; often empty
    std::array<char, 64> text{};
};

/// See the top of this file. All functions [realtime]. The name, the buffers and the progress must
/// outlive the task. An error of the slave ends as `aborted` with its code (foe::Error).
class FoeClient {
public:
    explicit FoeClient(Mailboxes& mailboxes) noexcept : mailboxes_(mailboxes) {}
    Task<MailboxResult> read(Channel&, BusSlave&, std::string_view name, FoeOptions,
                             std::span<std::uint8_t> to, FoeProgress&) noexcept;
    Task<MailboxResult> write(Channel&, BusSlave&, std::string_view name, FoeOptions,
                              std::span<const std::uint8_t> from, FoeProgress&) noexcept;

private:
    /// Sends the message in the mailbox's body, again while the slave is busy, and waits for the
    /// answer to `packet`.
    Task<MailboxResult> exchange(Channel&, BusSlave&, SlaveMailbox&, std::size_t length,
                                 foe::Opcode answer, std::uint32_t packet, FoeOptions,
                                 FoeProgress&) noexcept;
    Mailboxes& mailboxes_;
};

}  // namespace hal::ethercat::master
