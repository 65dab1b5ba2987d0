// SPDX-License-Identifier: MIT
// What a component with a topic has while it runs.
#pragma once

#include <algorithm>
#include <array>
#include <atomic>
#include <memory>
#include <string>

#include "dds/arguments.hpp"
#include "dds/status.hpp"

namespace hal::dds {

/// Its participant, its writer or reader, the beacon that tells hal top of the instance, and its place in the DDS thread.
template <class Endpoint>
class Attendance {
public:
    /// `make(participant)` makes the endpoint. What it throws has left nothing behind. [setup]
    template <class Make>
    void begin(const Arguments& arguments, const Settings& settings, Served& served, Make make) {
        auto participant = open(settings);
        endpoint_ = make(*participant);
        participant_ = std::move(participant);
        try {
            beacon_ = beacon(participant_, hal::extension<hal_status>(HAL_STATUS));
        } catch (const std::exception& e) {  // permissions need not know of it
            arguments.say(std::string("hal top does not show this instance: ") + e.what());
        }
        serve(served);
    }
    /// Also when begin() was not called, or threw. [setup]
    void end(Served& served) noexcept {
        if (participant_) withdraw(served);
        endpoint_.reset();
        beacon_.reset();
        participant_.reset();
    }
    /// A participant by the prefix of its GUIDs: its name, or the prefix. After begin(). Not in a cycle.
    std::string called(const std::array<std::uint8_t, 16>& guid) const {
        std::string digits;
        for (std::size_t n = 0; n < 12; ++n) {
            constexpr const char* hex = "0123456789abcdef";
            digits += hex[guid[n] >> 4], digits += hex[guid[n] & 15];
        }
        for (const Known& k : participant_->known())
            if (std::equal(k.prefix.begin(), k.prefix.end(), guid.begin()) && !k.name.empty()) return "'" + k.name + "' (" + digits + ")";
        return digits;
    }
    /// After begin(). [any]
    Endpoint& endpoint() const noexcept { return *endpoint_; }

    /// What the engine tells of others on the topic; `lacks` is the sentence about a quality that does not fit. Threads of the engine.
    void met(const Arguments& arguments, Event e, int count, const std::string& words, const std::string& lacks) noexcept {
        switch (e) {
        case Event::matched: wrong_type_.store(false, std::memory_order_relaxed); [[fallthrough]];
        case Event::unmatched: matched_.store(static_cast<std::uint32_t>(count), std::memory_order_relaxed); break;
        case Event::wrong_type:
            wrong_type_.store(true, std::memory_order_relaxed);
            arguments.say(words);
            break;
        case Event::wrong_quality: arguments.say(lacks + words); break;
        default: break;
        }
    }
    std::uint32_t matched() const noexcept { return matched_.load(std::memory_order_relaxed); }  ///< [any]
    bool          wrong_type() const noexcept { return wrong_type_.load(std::memory_order_relaxed); }  ///< [any]

private:
    std::atomic<std::uint32_t>   matched_{0};
    std::atomic<bool>            wrong_type_{false};
    std::shared_ptr<Participant> participant_;
    std::shared_ptr<Beacon>      beacon_;
    std::unique_ptr<Endpoint>    endpoint_;
};

}  // namespace hal::dds
