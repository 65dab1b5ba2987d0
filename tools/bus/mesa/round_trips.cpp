// SPDX-License-Identifier: MIT
#include "bus/mesa/round_trips.hpp"

#include <algorithm>
#include <ctime>

#include "cli/signals.hpp"
#include "link/system.hpp"
#include "mesa/hostmot2/idrom.hpp"
#include "mesa/lbp16/spaces.hpp"

namespace hal::tools {

using namespace mesa;

namespace {

/// The registers that a cycle reads and the counter of packets, about as large as those of a driver.
/// `length` makes replies differ.
Request cycle_request(std::size_t length) {
    Request request;
    request.read(Space::hostmot2, cookie_address, Unit::u32, 15 + length, false);
    request.read(Space::status, status::received_packets, Unit::u16);
    return request;
}

}  // namespace

Trips RoundTrips::measure(int count) {
    StopRequest stop;
    probe();
    std::int64_t due_ns = link::monotonic_ns();
    for (int n = 0; n < count && !stop.requested(); ++n) {
        ask(true);
        due_ns = std::max(due_ns + period_ns_, link::monotonic_ns());
        const timespec until = link::to_timespec(due_ns);
        clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &until, nullptr);
    }
    probe();
    wait_for_late();
    return result();
}

/// Sends a request and waits for its answer. Returns whether it came in time.
bool RoundTrips::ask(bool is_measured) {
    const std::size_t n = sent_.size();
    Sent& own = sent_.emplace_back();
    own.is_measured = is_measured;
    own.at_ns = link::monotonic_ns();
    card_.send(cycle_request(n % lengths));
    const std::int64_t limit_ns = own.at_ns + timeout_ns_;
    while (own.trip_ns < 0) {
        const auto reply = card_.receive(limit_ns);
        if (!reply) return false;
        accept(*reply);
    }
    return true;
}

/// Asks for the counter of packets before the first request and behind the last one.
void RoundTrips::probe() {
    for (int n = 0; n < probes; ++n) {
        if (ask(false)) return;
    }
}

void RoundTrips::wait_for_late() {
    const std::int64_t limit_ns = link::monotonic_ns() + timeout_ns_;
    while (std::ranges::any_of(sent_, [](const Sent& one) { return one.trip_ns < 0; })) {
        const auto reply = card_.receive(limit_ns);
        if (!reply) return;
        accept(*reply);
    }
}

void RoundTrips::accept(const std::vector<std::uint8_t>& reply) {
    const std::int64_t now_ns = link::monotonic_ns();
    const std::size_t oldest = sent_.size() > lengths ? sent_.size() - lengths : 0;
    for (std::size_t n = oldest; n < sent_.size(); ++n) {
        Sent& one = sent_[n];
        if (one.trip_ns >= 0 || cycle_request(n % lengths).reply_size() != reply.size()) continue;
        one.trip_ns = now_ns - one.at_ns;
        one.counter = load<std::uint16_t>(reply.data() + reply.size() - 2);
    }
}

Trips RoundTrips::result() const {
    Trips trips;
    std::size_t next = 0;  // behind the newest one with an answer
    for (std::size_t n = 0; n < sent_.size(); ++n) {
        const Sent& one = sent_[n];
        trips.sent += one.is_measured ? 1 : 0;
        if (one.trip_ns < 0) continue;
        count_lost(trips, next, n);
        next = n + 1;
        if (!one.is_measured) continue;
        trips.ns.push_back(one.trip_ns);
        trips.late += one.trip_ns > timeout_ns_ ? 1 : 0;
    }
    count_lost(trips, next, sent_.size());
    std::ranges::sort(trips.ns);
    return trips;
}

/// Counts the requests `from` to before `to`, which have no answer, unlike their neighbours.
void RoundTrips::count_lost(Trips& trips, std::size_t from, std::size_t to) const {
    const auto begin = sent_.begin() + static_cast<std::ptrdiff_t>(from);
    const auto end = sent_.begin() + static_cast<std::ptrdiff_t>(to);
    const auto missing = static_cast<int>(
        std::count_if(begin, end, [](const Sent& one) { return one.is_measured; }));
    if (from == 0 || to == sent_.size()) {
        trips.lost += missing;
        return;
    }
    const auto between = static_cast<std::uint16_t>(sent_[to].counter - sent_[from - 1].counter);
    const int arrived = std::clamp(int{between} - 1, 0, missing);
    trips.lost_replies += arrived;
    trips.lost_requests += missing - arrived;
}

}  // namespace hal::tools
