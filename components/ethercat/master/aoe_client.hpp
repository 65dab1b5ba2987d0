// SPDX-License-Identifier: MIT
// ADS over EtherCAT as the master uses it (ETG.1020): reading and writing, and SDO transfers by it.
#pragma once

#include <cstdint>
#include <span>

#include "ethercat/master/mailbox.hpp"
#include "ethercat/wire/aoe.hpp"

namespace hal::ethercat::master {

/// Whom an ADS request is addressed to, and by whom.
struct AoeAddress {
    aoe::NetId target{};
    aoe::NetId source{};
    std::uint16_t target_port = 0;
    std::uint16_t source_port = 0;
};

/// See the top of this file. All functions [realtime]. An ADS error, or the abort code of an SDO,
/// ends as `aborted`. Data that does not fit the mailbox is `refused`.
class AoeClient {
public:
    explicit AoeClient(Mailboxes& mailboxes) noexcept : mailboxes_(mailboxes) {}
    Task<MailboxResult> read(Channel&, BusSlave&, const AoeAddress&, std::uint32_t group,
                             std::uint32_t offset, std::span<std::uint8_t> to) noexcept;
    Task<MailboxResult> write(Channel&, BusSlave&, const AoeAddress&, std::uint32_t group,
                              std::uint32_t offset, std::span<const std::uint8_t> from) noexcept;

private:
    Mailboxes& mailboxes_;
    std::uint32_t invoke_ = 0;
};

}  // namespace hal::ethercat::master
