// SPDX-License-Identifier: MIT
// SDO information as the master reads it: lists of objects, descriptions of objects and entries
// (ETG.1000.6, clause 5.6.3).
#pragma once

#include <cstdint>
#include <span>

#include "ethercat/master/mailbox.hpp"
#include "ethercat/wire/coe.hpp"

namespace hal::ethercat::master {

/// An object as SDO information describes it.
struct ObjectDescription {
    std::uint16_t type = 0;
    std::uint8_t max_sub = 0;
    coe::ObjectCode code{};
    std::size_t name_length = 0;  ///< bytes of the name in the buffer of the call
};
/// An entry of an object.
struct EntryDescription {
    std::uint16_t type = 0;
    std::uint16_t bits = 0;
    std::uint16_t access = 0;  ///< coe::access
    std::size_t name_length = 0;
};

/// See the top of this file. All functions [realtime].
class ObjectInformation {
public:
    explicit ObjectInformation(Mailboxes& mailboxes) noexcept : mailboxes_(mailboxes) {}

    /// Reads a list of indexes; `length` of the result counts bytes, two for each index.
    Task<MailboxResult> list(Channel&, BusSlave&, coe::List which,
                             std::span<std::uint8_t> to) noexcept;
    /// Reads the description of an object and its name, not terminated, into `name`.
    Task<MailboxResult> object(Channel&, BusSlave&, std::uint16_t index,
                               ObjectDescription& description, std::span<char> name) noexcept;
    /// Reads the description of an entry and its name, not terminated, into `name`.
    Task<MailboxResult> entry(Channel&, BusSlave&, std::uint16_t index, std::uint8_t sub,
                              EntryDescription& description, std::span<char> name) noexcept;

private:
    /// Sends a request and joins the fragments of its response: the first `head.size()` bytes to
    /// `head`, all others to `rest`; `length` of the result counts these.
    Task<MailboxResult> fetch(Channel&, BusSlave&, coe::Information request, std::uint32_t key,
                              std::size_t key_bytes, std::span<std::uint8_t> head,
                              std::span<std::uint8_t> rest) noexcept;

    Mailboxes& mailboxes_;
};

}  // namespace hal::ethercat::master
