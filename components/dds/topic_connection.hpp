// SPDX-License-Identifier: MIT
// The connection of a running component to its topic.
#pragma once

#include <algorithm>
#include <array>
#include <atomic>
#include <memory>
#include <string>

#include "dds/arguments.hpp"
#include "dds/status.hpp"
#include "hal/journal.hpp"

namespace hal::dds {

/// The participant, the writer or reader, the status beacon for `hal top`, and the component's
/// registration with the DDS thread.
template <class Endpoint>
class TopicConnection {
public:
    /// Opens the participant and creates the endpoint by `make(participant)`. An exception from it
    /// leaves nothing open. Opens nothing when a journal is executed again: what the cycle takes
    /// from the engine is in it. [setup]
    template <class Make>
    void open(const Arguments& arguments, const Settings& settings, Served& served, Make make) {
        if (hal::is_executed_again()) return;
        const hal::JournaledSource journaled;
        auto participant = dds::open(settings);
        endpoint_ = make(*participant);
        participant_ = std::move(participant);
        try {
            beacon_ = beacon(participant_, hal::extension<hal_status>(HAL_STATUS));
        } catch (const std::exception& e) {  // the permissions may deny the status topic
            arguments.log(std::string("not visible in hal top: ") + e.what());
        }
        serve(served);
    }
    /// Closes everything; does nothing when it is not open. [setup]
    void close(Served& served) noexcept {
        if (participant_) {
            withdraw(served);
        }
        endpoint_.reset();
        beacon_.reset();
        participant_.reset();
    }
    /// Returns the name and GUID prefix of a participant, or the prefix alone. While open; never in
    /// a cycle.
    std::string describe(const std::array<std::uint8_t, 16>& guid) const {
        std::string digits;
        for (std::size_t n = 0; n < 12; ++n) {
            constexpr const char* hex = "0123456789abcdef";
            digits += hex[guid[n] >> 4];
            digits += hex[guid[n] & 15];
        }
        for (const Known& k : participant_->known()) {
            if (std::equal(k.prefix.begin(), k.prefix.end(), guid.begin()) && !k.name.empty()) {
                return "'" + k.name + "' (" + digits + ")";
            }
        }
        return digits;
    }
    /// Returns the endpoint. While open. [any]
    Endpoint& endpoint() const noexcept { return *endpoint_; }

    /// Handles an event of the engine; `mismatch` begins the message about an incompatible QoS.
    /// Threads of the engine.
    void handle(const Arguments& arguments, Event e, int count, const std::string& text,
                const std::string& mismatch) noexcept {
        switch (e) {
        case Event::matched: wrong_type_.store(false, std::memory_order_relaxed); [[fallthrough]];
        case Event::unmatched:
            matched_.store(static_cast<std::uint32_t>(count), std::memory_order_relaxed);
            break;
        case Event::wrong_type:
            wrong_type_.store(true, std::memory_order_relaxed);
            arguments.log(text);
            break;
        case Event::wrong_quality: arguments.log(mismatch + text); break;
        default: break;
        }
    }
    /// For the cycle, once in each. [realtime]
    std::uint32_t matched_of_cycle() noexcept { return seen_matched_(matched()); }
    /// The same of wrong_type(). [realtime]
    bool wrong_type_of_cycle() noexcept { return seen_wrong_type_(wrong_type()); }
    /// [any]
    std::uint32_t matched() const noexcept { return matched_.load(std::memory_order_relaxed); }
    /// [any]
    bool wrong_type() const noexcept { return wrong_type_.load(std::memory_order_relaxed); }

private:
    std::atomic<std::uint32_t> matched_{0};
    std::atomic<bool> wrong_type_{false};
    hal::JournaledValue<std::uint32_t> seen_matched_;  // by the cycle, as the next one
    hal::JournaledValue<bool> seen_wrong_type_;
    std::shared_ptr<Participant> participant_;
    std::shared_ptr<Beacon> beacon_;
    std::unique_ptr<Endpoint> endpoint_;
};

}  // namespace hal::dds
