// SPDX-License-Identifier: MIT
// The computed response times against the bus in memory, which arbitrates frame by frame with the
// true length of each frame: random message sets with random phases never exceed them, and
// constructed critical instants reach them.
#include <gtest/gtest.h>

#include <algorithm>
#include <memory>
#include <numeric>
#include <random>
#include <string>

#include "fieldbus/can_timing/response_time.hpp"
#include "link/simulation.hpp"
#include "link/timing.hpp"

namespace hal::can_timing {
namespace {

constexpr std::int64_t us = 1000;
constexpr std::int64_t ms = 1'000'000;

struct Release {
    std::int64_t queued = 0;
    std::int64_t event = 0;
    std::size_t message = 0;
};

struct Set {
    std::vector<Message> messages;
    std::vector<can::Frame> frames;
    std::uint32_t bit_rate = 0;
};

std::uint32_t below(std::mt19937& random, std::uint32_t limit) {
    return static_cast<std::uint32_t>(random() % limit);
}

/// Returns messages with different identifiers, mixed formats, and a load between 0.3 and 0.98.
Set random_set(std::mt19937& random) {
    Set set;
    constexpr std::uint32_t rates[] = {125'000, 250'000, 500'000, 1'000'000};
    set.bit_rate = rates[below(random, 4)];
    const std::size_t count = 2 + below(random, 13);
    const double load = 0.3 + 0.001 * below(random, 680);
    for (std::size_t i = 0; i < count; ++i) {
        Message m;
        m.extended = below(random, 4) == 0;
        do {
            m.id = below(random, m.extended ? 0x20000000 : 0x800);
        } while (std::any_of(set.messages.begin(), set.messages.end(), [&](const Message& o) {
            return o.id == m.id && o.extended == m.extended;
        }));
        m.bytes = static_cast<std::uint8_t>(below(random, 9));
        can::Frame f;
        f.id = m.id;
        f.extended = m.extended;
        f.length = m.bytes;
        for (auto& byte : f.data) {
            byte = static_cast<std::uint8_t>(below(random, 3) == 0 ? random() : 0);
        }
        m.bits = can::frame_bits(f).total();
        const std::int64_t frame = can::duration_ns({m.bits, 0}, set.bit_rate);
        // shares of the load differ by a factor of up to 4
        m.period =
            static_cast<std::int64_t>(static_cast<double>(frame) * static_cast<double>(count) /
                                      load * (0.5 + 0.0015 * below(random, 1000)));
        m.jitter = below(random, 3) == 0
                       ? static_cast<std::int64_t>(below(random, 1000)) * m.period / 2000
                       : 0;
        set.messages.push_back(m);
        set.frames.push_back(f);
    }
    return set;
}

std::string address_of(std::uint32_t bit_rate) {
    static int number = 0;
    return "sim:timing" + std::to_string(++number) + "?bitrate=" + std::to_string(bit_rate);
}

/// Plays the releases on a bus in memory, a node for each message or queue. Returns the longest
/// response of each message, from its event to the end of the intermission; 0 if it was never sent.
std::vector<std::int64_t> played(const Set& set, std::vector<Release> releases,
                                 const std::vector<can::Disturbance>& errors = {},
                                 std::uint64_t* destroyed = nullptr) {
    const std::string address = address_of(set.bit_rate);
    can::Options options;
    options.receive_capacity = 1 << 15;
    const auto listener = can::open(address, options);
    options.receive_capacity = 16;
    options.send_capacity = 1 << 10;
    std::vector<std::unique_ptr<can::Link>> nodes(set.messages.size());
    std::vector<can::Link*> sends(set.messages.size());
    for (std::size_t i = 0; i < nodes.size(); ++i) {
        for (std::size_t k = 0; k < i && sends[i] == nullptr; ++k) {
            if (set.messages[i].fifo != 0 && set.messages[i].fifo == set.messages[k].fifo) {
                sends[i] = sends[k];
            }
        }
        if (sends[i] != nullptr) continue;
        nodes[i] = can::open(address, options).link;
        sends[i] = nodes[i].get();
    }
    for (const auto& error : errors) {
        EXPECT_GE(listener.link->simulation()->disturb(error), 0);
    }
    std::stable_sort(releases.begin(), releases.end(),
                     [](const Release& a, const Release& b) { return a.queued < b.queued; });
    std::vector<std::vector<std::int64_t>> events(set.messages.size());
    for (const Release& r : releases) {
        EXPECT_EQ(sends[r.message]->send(set.frames[r.message], r.queued), can::Sent::queued);
        sends[r.message]->flush(r.queued);
        events[r.message].push_back(r.event);
    }
    std::vector<std::int64_t> worst(set.messages.size());
    std::vector<std::size_t> seen(set.messages.size());
    const std::int64_t end = releases.back().queued + 10'000 * ms;

    const std::int64_t intermission = can::duration_ns({can::intermission_bits, 0}, set.bit_rate);
    for (can::Frame f; listener.link->receive(f, end);) {
        for (std::size_t i = 0; i < set.messages.size(); ++i) {
            if (f.same(set.frames[i])) {
                worst[i] = std::max(worst[i], f.time_ns + intermission - events[i][seen[i]++]);
            }
        }
    }
    for (std::size_t i = 0; i < set.messages.size(); ++i) {
        EXPECT_EQ(seen[i], events[i].size());
    }
    if (destroyed != nullptr) {
        *destroyed += listener.link->statistics().errors;
    }
    return worst;
}

/// Events with random phases, distances and delays before queuing, in `time`.
std::vector<Release> at_random(const Set& set, std::mt19937& random, std::int64_t time) {
    std::vector<Release> releases;
    for (std::size_t i = 0; i < set.messages.size(); ++i) {
        const Message& m = set.messages[i];
        std::int64_t event = static_cast<std::int64_t>(random()) % m.period;
        std::int64_t last = 0;
        while (event < time) {
            const std::int64_t delay =
                m.jitter == 0 ? 0 : static_cast<std::int64_t>(random()) % (m.jitter + 1);
            last = std::max(last, event + delay);  // a node queues its messages in order
            releases.push_back({last, event, i});
            event += m.period +
                     (below(random, 8) == 0 ? static_cast<std::int64_t>(random()) % m.period : 0);
        }
    }
    return releases;
}

/// The longest frame of lower priority has just begun when `message` and all of higher priority are
/// queued, each as late as its jitter allows, and then as early as possible again.
std::vector<Release> critical_instant(const Set& set, const Analysis& a, std::size_t message) {
    constexpr std::int64_t start = 1000 * ms;
    std::vector<Release> releases;
    if (const auto blocker = a.responses[message].blocker) {
        releases.push_back({start - 1, start - 1, *blocker});
    }
    const std::int64_t until =
        start + a.responses[message].queued + 2 * set.messages[message].period;
    for (std::size_t i = 0; i < set.messages.size(); ++i) {
        const Message& m = set.messages[i];
        if (i != message && !before(m, set.messages[message])) continue;
        for (std::int64_t event = start - m.jitter; event < until; event += m.period) {
            releases.push_back({std::max(event, start), event, i});
        }
    }
    return releases;
}

TEST(CanResponseTime, Bus_in_memory_never_exceeds_it_and_critical_instants_reach_it) {
    std::mt19937 random(20);
    std::size_t sets = 0;
    std::size_t messages = 0;
    std::size_t reached = 0;
    std::size_t later_instances = 0;
    while (sets < 1000) {
        const Set set = random_set(random);
        const Bus bus{set.bit_rate, 0, {}};
        const Analysis a = analyse(set.messages, bus);
        if (a.load >= 0.985) continue;
        ++sets;
        const std::vector<std::int64_t> seen =
            played(set, at_random(set, random, 40 * set.messages.front().period));
        for (std::size_t i = 0; i < set.messages.size(); ++i) {
            const Response& r = a.responses[i];
            ASSERT_GE(r.worst, 0);
            EXPECT_LE(seen[i], r.worst) << "set " << sets << " message " << i;
            if (sets % 4 != 0) continue;
            const std::int64_t critical = played(set, critical_instant(set, a, i))[i];
            EXPECT_LE(critical, r.worst) << "set " << sets << " message " << i;
            ++messages;
            reached += critical * 20 >= r.worst * 19;
            later_instances += r.instance > 0;
        }
    }
    std::printf(
        "%zu sets; critical instants of %zu messages, %zu within 5 %%, %zu of a later instance\n",
        sets, messages, reached, later_instances);
    EXPECT_GE(reached * 100, messages * 99);
    EXPECT_GT(later_instances, 0U);
}

TEST(CanResponseTime, Bus_in_memory_never_exceeds_it_with_queues_in_order_of_arrival) {
    std::mt19937 random(21);
    std::size_t checked = 0;
    for (int round = 0; round < 400; ++round) {
        Set set = random_set(random);
        for (Message& m : set.messages) {
            m.period *= 2;
            m.jitter /= 4;
            m.fifo = below(random, 3);  // two nodes with a queue, and others
        }
        const Bus bus{set.bit_rate, 0, {}};
        const Analysis a = analyse(set.messages, bus);
        const bool valid =
            std::all_of(a.responses.begin(), a.responses.end(), [&](const Response& r) {
            return r.worst >= 0 &&
                   r.worst <=
                       set.messages[static_cast<std::size_t>(&r - a.responses.data())].period;
        });
        if (!valid) continue;
        const std::vector<std::int64_t> seen =
            played(set, at_random(set, random, 60 * set.messages.front().period));
        checked += seen.size();
        for (std::size_t i = 0; i < set.messages.size(); ++i) {
            EXPECT_LE(seen[i], a.responses[i].worst) << "round " << round << " message " << i;
        }
    }
    EXPECT_GT(checked, 1000U);
}

TEST(CanResponseTime, Bus_in_memory_never_exceeds_it_with_errors) {
    std::mt19937 random(22);
    std::size_t checked = 0;
    std::uint64_t destroyed = 0;
    for (int round = 0; round < 300; ++round) {
        const Set set = random_set(random);
        const std::int64_t time = 40 * set.messages.front().period;
        Bus bus{set.bit_rate, 0, {1, std::max<std::int64_t>(time / 12, 1)}};
        const Analysis a = analyse(set.messages, bus);
        std::vector<can::Disturbance> errors;
        for (std::int64_t at = static_cast<std::int64_t>(random()) % bus.errors.period;
             at < time && errors.size() < 12; at += bus.errors.period + 200 * us) {
            can::Disturbance d;  // the first frame that begins after `at`
            d.fault = can::Fault::error;
            d.every = 1;
            d.count = 1;
            d.from_ns = at;

            d.until_ns = at + 150 * us;
            errors.push_back(d);
        }
        const std::vector<std::int64_t> seen =
            played(set, at_random(set, random, time), errors, &destroyed);
        for (std::size_t i = 0; i < set.messages.size(); ++i) {
            if (a.responses[i].worst < 0) continue;
            ++checked;
            EXPECT_LE(seen[i], a.responses[i].worst) << "round " << round << " message " << i;
        }
    }
    EXPECT_GT(destroyed, 1000U);
    EXPECT_GT(checked, 1000U);
}

}  // namespace
}  // namespace hal::can_timing
