// SPDX-License-Identifier: MIT
// Sentences about what happened on the bus: what failed, why, what to do. For reporters and tools;
// nothing here is real time.
#pragma once

#include <cstdint>
#include <string>

#include "bus/events/event_rows.hpp"
#include "ethercat/master/events.hpp"
#include "ethercat/master/setup.hpp"
#include "hal/message_log.hpp"

namespace hal::ethercat::config {

/// An event as master::Events received it.
struct EventRecord {
    master::Event event{};
    std::uint32_t slave = master::Events::bus;
    std::int64_t first = 0;
    std::int64_t second = 0;
};

/// Which configuration the messages advise to change.
enum class Format : std::uint8_t { ethercat, lcec };

/// Returns the sentence for an event, without a final stop; empty for one that needs none. `link`
/// and `backup` are the addresses of the ports. [setup]
std::string event_text(const EventRecord& what, const master::Setup& setup, const std::string& link,
                       const std::string& backup = {}, Format = Format::ethercat);

/// Returns the texts of the faults of a bus, of the same table as the sentences; the subjects are
/// the slaves of the setup. [setup]
bus::FaultTexts fault_texts(const master::Setup& setup, const std::string& link);

/// Returns the subject of an event for rate limiting: an event of one slave is a kind, the code
/// that a device chooses is the detail. [setup]
MessageSubject subject(const EventRecord& what);

/// Returns "slave 3 (x-axis)", or "slave at position 3" where the setup does not name it. [setup]
std::string slave_words(std::uint32_t slave, const master::Setup& setup);

/// Returns the sentence for a link without carrier, or one to which nothing listens. [setup]
std::string no_link_words(const std::string& link);

/// Returns the sentence for a link that is a capture, for a program that needs answers. [setup]
std::string recorded_words(const std::string& link);

/// Returns the sentence for a capture without answers of slaves. [setup]
std::string unanswered_words(const std::string& file);

}  // namespace hal::ethercat::config
