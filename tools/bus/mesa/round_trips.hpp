// SPDX-License-Identifier: MIT
// Requests to a card at a steady rate, and which of them were answered.
#pragma once

#include <cstdint>
#include <vector>

#include "bus/mesa/card_client.hpp"

namespace hal::tools {

/// What became of the requests of a measurement.
struct Trips {
    std::vector<std::int64_t> ns;  ///< of those that were answered, sorted
    int sent = 0;
    int late = 0;  ///< answered behind the timeout
    int lost_requests = 0;  ///< the card did not count them
    int lost_replies = 0;
    int lost = 0;  ///< in an unknown direction

    std::int64_t at(double share) const {
        const auto n = static_cast<std::size_t>(share * static_cast<double>(ns.size() - 1) + 0.5);
        return ns[n];
    }
};

/// Measures once. An answer belongs to the newest request whose reply has its length: consecutive
/// requests differ in it, so that a late answer is not taken for that of a later request. The card's
/// counter of packets in the answers shows in which direction others were lost.
class RoundTrips {
public:
    RoundTrips(CardClient& card, std::int64_t period_ns, std::int64_t timeout_ns)
        : card_(card), period_ns_(period_ns), timeout_ns_(timeout_ns) {}

    /// Sends `count` requests, or until a signal ends the program.
    Trips measure(int count);

private:
    static constexpr std::size_t lengths = 64;
    static constexpr int probes = 10;

    struct Sent {
        std::int64_t at_ns = 0;
        std::int64_t trip_ns = -1;  ///< -1: no answer
        std::uint16_t counter = 0;  ///< of the answer
        bool is_measured = true;
    };

    bool ask(bool is_measured);
    void probe();
    void wait_for_late();
    void accept(const std::vector<std::uint8_t>& reply);
    Trips result() const;
    void count_lost(Trips& trips, std::size_t from, std::size_t to) const;

    CardClient& card_;
    const std::int64_t period_ns_;
    const std::int64_t timeout_ns_;
    std::vector<Sent> sent_;
};

}  // namespace hal::tools
