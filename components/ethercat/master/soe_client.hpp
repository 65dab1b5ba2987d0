// SPDX-License-Identifier: MIT
// Servo profile over EtherCAT as the master uses it (ETG.1000.6, clause 5.9): IDNs and their
// elements.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <string_view>

#include "ethercat/master/mailbox.hpp"
#include "ethercat/wire/soe.hpp"

namespace hal::ethercat::master {

/// Reads an IDN: P-0-150, S-0-0016 or a number such as 0x8096. nullopt: none of these. [any]
std::optional<std::uint16_t> parse_idn(std::string_view text) noexcept;
/// Writes an IDN as S-0-0016; returns the text, terminated. [any]
std::array<char, 12> idn_text(std::uint16_t idn) noexcept;
/// Returns the elements of a list or the characters of a string, without the two lengths before
/// them. [any]
std::span<const std::uint8_t> list_of(std::span<const std::uint8_t> value) noexcept;

/// See the top of this file. All functions [realtime]. An error of the slave ends as `aborted` with
/// its code (soe::error).
class SoeClient {
public:
    explicit SoeClient(Mailboxes& mailboxes) noexcept : mailboxes_(mailboxes) {}
    /// Reads elements of an IDN, bits of soe::element; they follow each other in `to`.
    Task<MailboxResult> read(Channel&, BusSlave&, std::uint8_t drive, std::uint16_t idn,
                             std::uint8_t elements, std::span<std::uint8_t> to) noexcept;
    /// Writes one element of an IDN.
    Task<MailboxResult> write(Channel&, BusSlave&, std::uint8_t drive, std::uint16_t idn,
                              std::uint8_t element, std::span<const std::uint8_t> from) noexcept;

private:
    Mailboxes& mailboxes_;
};

}  // namespace hal::ethercat::master
