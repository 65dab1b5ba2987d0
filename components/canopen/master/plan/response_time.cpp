// SPDX-License-Identifier: MIT
// With C the longest time of a frame, T period, J jitter, B the longest frame of lower importance and t_bit the time of one bit:
//   busy time        t  = B + sum over m and all more important k of ceil((t + J_k) / T_k) C_k
//   instances        Q  = ceil((t + J_m) / T_m)
//   queue of q < Q   w  = B + q C_m + sum over all more important k of ceil((w + J_k + t_bit) / T_k) C_k
//   response         R  = max over q of J_m + w - q T_m + C_m
// each solved by repeating it from the smallest value until it stays. Looking at the first instance only (Tindell 1994) is not enough:
// a frame on the wire cannot be interrupted, so an instance may push the wait of its successor.
#include "response_time.hpp"

#include <algorithm>
#include <numeric>

#include "link/timing.hpp"

namespace hal::canopen::plan {

namespace {

/// Longer than any answer of use, and far from the ends of the numbers.
constexpr std::int64_t horizon = 3'600'000'000'000;

struct Item {
    std::int64_t c = 0, t = 0, j = 0, limit = 0;
};

std::int64_t ceil_div(std::int64_t a, std::int64_t b) { return a / b + (a % b > 0 ? 1 : 0); }

std::int64_t bit_time(const Bus& bus) { return can::duration_ns({1, 0}, bus.bit_rate); }

/// Repeats `t = start + sum` until it stays; -1 when it leaves the horizon.
std::int64_t settle(std::int64_t from, std::int64_t constant, std::int64_t extra, std::span<const Item> more_important) {
    for (std::int64_t t = from;;) {
        std::int64_t next = constant;
        for (const Item& k : more_important) {
            next += ceil_div(t + k.j + extra, k.t) * k.c;
            if (next > horizon) return -1;
        }
        if (next <= t) return t;
        t = next;
    }
}

struct Worst {
    std::int64_t response = -1, queued = 0, instance = 0;
};

/// `busy`: the more important ones, and behind them m itself.
Worst worst_of(const Item& m, std::int64_t blocking, std::span<const Item> busy, std::int64_t bit) {
    double use = 0;
    for (const Item& k : busy) use += static_cast<double>(k.c) / static_cast<double>(k.t);
    if (use >= 1.0) return {};
    const std::int64_t t = settle(m.c, blocking, 0, busy);
    if (t < 0) return {};
    const auto         above = busy.first(busy.size() - 1);
    Worst              worst;
    const std::int64_t instances = ceil_div(t + m.j, m.t);
    for (std::int64_t q = 0, w = 0; q < instances; ++q) {
        const std::int64_t constant = blocking + q * m.c;
        w = settle(std::max(w, constant), constant, bit, above);
        if (w < 0) return {};
        if (const std::int64_t r = m.j + w - q * m.t + m.c; r > worst.response) worst = {r, w, q};
    }
    return worst;
}

std::vector<Item> items_of(std::span<const Message> messages, const Bus& bus) {
    std::vector<Item> items(messages.size());
    for (std::size_t i = 0; i < messages.size(); ++i) {
        const Message& m = messages[i];
        const auto     bits = can::worst_case_bits(m.bytes, m.extended, m.fd, m.bit_rate_switch, m.remote);
        items[i] = {can::duration_ns(bits, bus.bit_rate, bus.data_rate), std::clamp<std::int64_t>(m.period, 1, horizon),
                    std::clamp<std::int64_t>(m.jitter, 0, horizon), m.limit()};
    }
    return items;
}

can::Frame frame_of(const Message& m) {
    can::Frame f;
    f.id = m.id, f.extended = m.extended, f.remote = m.remote;
    return f;
}

}  // namespace

bool before(const Message& a, const Message& b) noexcept { return can::arbitration_rank(frame_of(a)) < can::arbitration_rank(frame_of(b)); }

std::int64_t times_before(const Message& other, std::int64_t queued, const Bus& bus) {
    return ceil_div(queued + other.jitter + bit_time(bus), std::max<std::int64_t>(other.period, 1));
}

Analysis analyse(std::span<const Message> messages, const Bus& bus) {
    Analysis a;
    a.responses.resize(messages.size());
    a.fits = bus.bit_rate > 0;
    if (bus.bit_rate == 0) return a;
    const std::vector<Item>  items = items_of(messages, bus);
    std::vector<std::size_t> order(messages.size());
    std::iota(order.begin(), order.end(), std::size_t{0});
    std::stable_sort(order.begin(), order.end(), [&](std::size_t x, std::size_t y) { return before(messages[x], messages[y]); });
    std::vector<Item> sorted;
    for (const std::size_t i : order) sorted.push_back(items[i]);
    // From the least important upwards, so that the longest frame below is known.
    std::optional<std::size_t> blocker;
    for (std::size_t rank = order.size(); rank-- > 0;) {
        const std::size_t i = order[rank];
        const Message&    m = messages[i];
        Response&         r = a.responses[i];
        r.bits = can::worst_case_bits(m.bytes, m.extended, m.fd, m.bit_rate_switch, m.remote).total();
        r.frame = items[i].c;
        r.blocker = blocker;
        r.blocking = blocker ? items[*blocker].c : 0;
        const Worst worst = worst_of(items[i], r.blocking, std::span(sorted).first(rank + 1), bit_time(bus));
        r.worst = worst.response, r.queued = worst.queued, r.instance = worst.instance;
        r.in_time = r.worst >= 0 && r.worst <= items[i].limit;
        a.fits = a.fits && r.in_time;
        a.load += static_cast<double>(items[i].c) / static_cast<double>(items[i].t);
        if (!blocker || items[i].c > items[*blocker].c) blocker = i;
    }
    return a;
}

std::optional<std::uint32_t> sufficient_bit_rate(std::span<const Message> messages, const Bus& bus) {
    for (const std::uint32_t rate : {10'000U, 20'000U, 50'000U, 100'000U, 125'000U, 250'000U, 500'000U, 800'000U, 1'000'000U})
        if (rate > bus.bit_rate && analyse(messages, {rate, bus.data_rate}).fits) return rate;
    return std::nullopt;
}

std::vector<std::size_t> sufficient_order(std::span<const Message> messages, const Bus& bus) {
    if (messages.size() > 256 || bus.bit_rate == 0) return {};
    const std::vector<Item>  items = items_of(messages, bus);
    std::vector<std::size_t> open(messages.size()), order;
    std::iota(open.begin(), open.end(), std::size_t{0});
    std::stable_sort(open.begin(), open.end(),
                     [&](std::size_t x, std::size_t y) { return items[x].limit - items[x].j < items[y].limit - items[y].j; });
    std::int64_t blocking = 0;
    while (!open.empty()) {  // a message that meets its deadline below all others gets the lowest free priority; those with late deadlines are tried first
        bool found = false;
        for (std::size_t place = open.size(); place-- > 0 && !found;) {
            const std::size_t i = open[place];
            std::vector<Item> busy;
            for (const std::size_t other : open)
                if (other != i) busy.push_back(items[other]);
            busy.push_back(items[i]);
            const Worst worst = worst_of(items[i], blocking, busy, bit_time(bus));
            if (worst.response < 0 || worst.response > items[i].limit) continue;
            found = true;
            order.push_back(i);
            blocking = std::max(blocking, items[i].c);
            open.erase(open.begin() + static_cast<std::ptrdiff_t>(place));
        }
        if (!found) return {};
    }
    std::reverse(order.begin(), order.end());
    return order;
}

}  // namespace hal::canopen::plan
