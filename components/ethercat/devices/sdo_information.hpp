// SPDX-License-Identifier: MIT
// SDO information of an emulated slave (ETG.1000.6, clause 5.6.3): lists of objects, descriptions
// of objects and entries.
#pragma once

#include <span>

#include "ethercat/devices/dictionary.hpp"
#include "ethercat/devices/mailbox_service.hpp"

namespace hal::ethercat::devices {

/// Answers requests for the description of a dictionary.
class SdoInformation {
public:
    explicit SdoInformation(const Dictionary& dictionary) : dictionary_(dictionary) {}  ///< [setup]
    /// Forgets a list whose fragments are not sent yet. [realtime]
    void reset() noexcept { list_ = List{}; }
    /// Answers the payload of a CoE message. [realtime]
    void take(std::span<const std::uint8_t> payload, Outbox&) noexcept;
    /// Queues the next fragment of a list, if there is one. [realtime]
    void pump(Outbox&) noexcept;

private:
    struct List {
        std::size_t at = 0;  ///< next object of the dictionary
        coe::List list{};
        std::uint16_t fragments_left = 0;
        bool begun = false;
        bool active = false;
    };
    void begin_list(std::uint16_t number, Outbox&) noexcept;
    void send_lengths(Outbox&) noexcept;
    void describe_object(std::uint16_t index, Outbox&) noexcept;
    void describe_entry(std::uint16_t index, std::uint8_t sub, std::uint8_t info, Outbox&) noexcept;
    std::size_t count(coe::List) const noexcept;

    const Dictionary& dictionary_;
    List list_;
};

}  // namespace hal::ethercat::devices
