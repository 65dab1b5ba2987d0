// SPDX-License-Identifier: MIT
// With C the longest time of a frame, T period, J jitter, B the longest frame of lower priority,
// t_bit the time of one bit, and E(t) the time that errors take within t:
//   busy period      t  = E(t) + B + sum over m and all of higher priority k of ceil((t + J_k) / T_k) C_k
//   instances        Q  = ceil((t + J_m) / T_m)
//   queue of q < Q   w  = E(w + C_m) + B + q C_m + sum over all of higher priority k of ceil((w + J_k + t_bit) / T_k) C_k
//   response         R  = max over q of J_m + w - q T_m + C_m
//   errors           E(t) = (burst + ceil(t / T_error) - 1) (31 t_bit + longest frame of m and all of higher priority)
// each solved by iteration from the smallest value. Looking at the first instance only (Tindell
// 1994) is not enough: a frame on the wire cannot be interrupted, so that an instance may delay its
// successor.
//
// A queue in order of arrival with the messages M, whose lowest priority has L, and f_k the time
// for which k waits in such a queue itself:
//   w = E(w + Cmax_M) + max(B_L, Cmax_M) + Csum_M - Cmin_M + sum over k outside M above L of ceil((w + J_k + f_k + t_bit) / T_k) C_k
//   R_m = J_m + w + Cmin_M, and f_m = w; repeated for all queues until nothing changes. Other messages use max(B, C) and one instance.
#include "fieldbus/can_timing/response_time.hpp"

#include <algorithm>
#include <map>
#include <numeric>

#include "link/timing.hpp"

namespace hal::can_timing {

namespace {

/// Longer than any useful answer, and far from the ends of the numbers.
constexpr std::int64_t horizon = 3'600'000'000'000;
/// After an error: flags of both sides, delimiter and intermission, and the pause of an
/// error-passive sender (ISO 11898-1).
constexpr unsigned error_bits = 31;

struct Item {
    std::int64_t c = 0;
    std::int64_t t = 0;
    std::int64_t j = 0;
    std::int64_t limit = 0;
    std::int64_t f = 0;  ///< time in a queue in order of arrival
    std::uint32_t fifo = 0;
};

std::int64_t ceil_div(std::int64_t a, std::int64_t b) { return a / b + (a % b > 0 ? 1 : 0); }

std::int64_t bit_time(const Bus& bus) { return can::duration_ns({1, 0}, bus.bit_rate); }

/// The time that errors take, for a message and those of higher priority.
struct ErrorTime {
    ErrorTime(const Bus& bus, std::int64_t max)
        : errors(bus.errors),
          each(bus.errors.burst == 0 ? 0 : can::duration_ns({error_bits, 0}, bus.bit_rate) + max) {}
    std::int64_t operator()(std::int64_t t) const {
        if (each == 0) return 0;
        const std::int64_t more =
            errors.period > 0 ? ceil_div(std::max<std::int64_t>(t, 1), errors.period) - 1 : 0;
        return std::min(horizon, (errors.burst + more) * each);
    }
    double load() const {
        return each == 0 || errors.period <= 0
                   ? 0.0
                   : static_cast<double>(each) / static_cast<double>(errors.period);
    }
    Errors errors;
    std::int64_t each;
};

/// Iterates `t = constant + E(t + behind) + sum` from `from` until it no longer grows; -1 beyond
/// the horizon. The sum counts the items that
/// `counts` accepts.
template <class Counts>
std::int64_t settle(std::int64_t from, std::int64_t constant, std::int64_t extra,
                    std::int64_t behind, const ErrorTime& errors, std::span<const Item> higher,
                    Counts counts) {
    for (std::int64_t t = from;;) {
        std::int64_t next = constant + errors(t + behind);
        for (const Item& k : higher) {
            if (!counts(k)) continue;
            next += ceil_div(t + k.j + k.f + extra, k.t) * k.c;
            if (next > horizon) break;
        }
        if (next > horizon) return -1;
        if (next <= t) return t;
        t = next;
    }
}
constexpr auto all = [](const Item&) { return true; };

struct Worst {
    std::int64_t response = -1;
    std::int64_t queued = 0;
    std::int64_t instance = 0;
    std::int64_t errors = 0;
};

double use_of(std::span<const Item> items) {
    double use = 0;
    for (const Item& k : items) {
        use += static_cast<double>(k.c) / static_cast<double>(k.t);
    }
    return use;
}

std::int64_t max_of(std::span<const Item> items) {
    std::int64_t max = 0;
    for (const Item& k : items) {
        max = std::max(max, k.c);
    }
    return max;
}

/// The exact analysis. `busy`: those of higher priority, and behind them m itself.
Worst worst_of(const Item& m, std::int64_t blocking, std::span<const Item> busy, const Bus& bus) {
    const ErrorTime errors(bus, max_of(busy));
    if (use_of(busy) + errors.load() >= 1.0) {
        return {};
    }
    const std::int64_t t = settle(m.c, blocking, 0, 0, errors, busy, all);
    if (t < 0) {
        return {};
    }
    const auto above = busy.first(busy.size() - 1);
    Worst worst;
    const std::int64_t instances = ceil_div(t + m.j, m.t);
    for (std::int64_t q = 0, w = 0; q < instances; ++q) {
        const std::int64_t constant = blocking + q * m.c;
        w = settle(std::max(w, constant), constant, bit_time(bus), m.c, errors, above, all);
        if (w < 0) {
            return {};
        }
        if (const std::int64_t r = m.j + w - q * m.t + m.c; r > worst.response) {
            worst = {r, w, q, errors(w + m.c)};
        }
    }
    return worst;
}

std::vector<Item> items_of(std::span<const Message> messages, const Bus& bus) {
    std::vector<Item> items(messages.size());
    for (std::size_t i = 0; i < messages.size(); ++i) {
        const Message& m = messages[i];
        const auto bits = m.bits != 0 ? can::Bits{m.bits, 0}
                                      : can::worst_case_bits(m.bytes, m.extended, m.fd,
                                                             m.bit_rate_switch, m.remote);
        items[i] = {can::duration_ns(bits, bus.bit_rate, bus.data_rate),
                    std::clamp<std::int64_t>(m.period, 1, horizon),
                    std::clamp<std::int64_t>(m.jitter, 0, horizon),
                    m.limit(),
                    0,
                    m.fifo};
    }
    return items;
}

can::Frame frame_of(const Message& m) {
    can::Frame f;
    f.id = m.id;
    f.extended = m.extended;
    f.remote = m.remote;
    return f;
}

/// Messages in order of priority, and what is computed for a bus with queues in order of arrival.
class WithQueues {
public:
    WithQueues(std::vector<Item>& sorted, std::span<const std::int64_t> blocking, const Bus& bus)
        : items_(sorted), blocking_(blocking), bus_(bus), worst_(sorted.size()) {
        for (std::size_t rank = 0; rank < items_.size(); ++rank) {
            if (const std::uint32_t number = items_[rank].fifo; number != 0) {
                Queue& q = queues_[number];
                q.last = rank;
                q.max = std::max(q.max, items_[rank].c);
                q.sum += items_[rank].c;
                q.min = q.min == 0 ? items_[rank].c : std::min(q.min, items_[rank].c);
            }
        }
    }
    /// Returns the answer for each rank.
    const std::vector<Worst>& compute() {
        for (bool changed = true; changed;) {
            changed = false;
            for (auto& [number, q] : queues_) {
                const std::int64_t w = time_in(number, q);
                if (w == q.time) continue;
                q.time = w;
                changed = true;
                for (Item& item : items_) {
                    if (item.fifo == number) {
                        item.f = w < 0 ? horizon : w;
                    }
                }
            }
        }
        for (std::size_t rank = 0; rank < items_.size(); ++rank) {
            worst_[rank] = answer(rank);
        }
        return worst_;
    }
    std::int64_t others(std::size_t rank) const {
        const auto q = queues_.find(items_[rank].fifo);
        return q == queues_.end() ? 0 : q->second.sum - q->second.min;
    }

private:
    struct Queue {
        std::size_t last = 0;
        std::int64_t max = 0;
        std::int64_t min = 0;
        std::int64_t sum = 0;
        std::int64_t time = 0;
    };

    std::int64_t time_in(std::uint32_t number, const Queue& q) const {
        const auto above = std::span<const Item>(items_).first(q.last + 1);
        const ErrorTime errors(bus_, max_of(above));
        if (use_of(above) + errors.load() >= 1.0) return -1;
        const std::int64_t constant = std::max(blocking_[q.last], q.max) + q.sum - q.min;
        return settle(constant, constant, bit_time(bus_), q.max, errors, above,
                      [&](const Item& k) { return k.fifo != number; });
    }
    Worst answer(std::size_t rank) const {
        const Item& m = items_[rank];
        const auto busy = std::span<const Item>(items_).first(rank + 1);
        const ErrorTime errors(bus_, max_of(busy));
        Worst worst;
        if (m.fifo != 0) {
            const Queue& q = queues_.at(m.fifo);
            if (q.time >= 0) {
                worst = {m.j + q.time + q.min, q.time, 0, errors(q.time + q.max)};
            }
        } else if (use_of(busy) + errors.load() < 1.0) {
            const std::int64_t constant = std::max(blocking_[rank], m.c);
            const std::int64_t w =
                settle(constant, constant, bit_time(bus_), m.c, errors, busy.first(rank), all);
            if (w >= 0) {
                worst = {m.j + w + m.c, w, 0, errors(w + m.c)};
            }
        }
        return worst;
    }

    std::vector<Item>& items_;
    std::span<const std::int64_t> blocking_;
    const Bus& bus_;
    std::map<std::uint32_t, Queue> queues_;
    std::vector<Worst> worst_;
};

}  // namespace

bool before(const Message& a, const Message& b) noexcept {
    return can::arbitration_rank(frame_of(a)) < can::arbitration_rank(frame_of(b));
}

std::int64_t times_before(const Message& other, std::int64_t queued, const Bus& bus) {
    return ceil_div(queued + other.jitter + bit_time(bus), std::max<std::int64_t>(other.period, 1));
}

Analysis analyse(std::span<const Message> messages, const Bus& bus) {
    Analysis a;
    a.responses.resize(messages.size());
    a.fits = bus.bit_rate > 0;
    if (bus.bit_rate == 0) return a;
    const std::vector<Item> items = items_of(messages, bus);
    std::vector<std::size_t> order(messages.size());
    std::iota(order.begin(), order.end(), std::size_t{0});
    std::stable_sort(order.begin(), order.end(), [&](std::size_t x, std::size_t y) {
        return before(messages[x], messages[y]);
    });
    std::vector<Item> sorted;
    for (const std::size_t i : order) {
        sorted.push_back(items[i]);
    }
    // From the lowest priority upwards, so that the longest frame below is known.
    std::vector<std::int64_t> blocking(messages.size());
    std::optional<std::size_t> blocker;
    for (std::size_t rank = order.size(); rank-- > 0;) {
        const std::size_t i = order[rank];
        const Message& m = messages[i];
        Response& r = a.responses[i];
        r.bits = m.bits != 0
                     ? m.bits
                     : can::worst_case_bits(m.bytes, m.extended, m.fd, m.bit_rate_switch, m.remote)
                           .total();
        r.frame = items[i].c;
        r.blocker = blocker;
        r.blocking = blocking[rank] = blocker ? items[*blocker].c : 0;
        a.load += static_cast<double>(items[i].c) / static_cast<double>(items[i].t);
        if (!blocker || items[i].c > items[*blocker].c) {
            blocker = i;
        }
    }
    const bool queues =
        std::any_of(messages.begin(), messages.end(), [](const Message& m) { return m.fifo != 0; });
    WithQueues with_queues(sorted, blocking, bus);
    const std::vector<Worst> bounds = queues ? with_queues.compute() : std::vector<Worst>{};
    for (std::size_t rank = 0; rank < order.size(); ++rank) {
        const std::size_t i = order[rank];
        Response& r = a.responses[i];
        const Worst worst =
            queues ? bounds[rank]
                   : worst_of(items[i], r.blocking, std::span(sorted).first(rank + 1), bus);
        if (queues) {
            r.queue = with_queues.others(rank);
            r.blocking = std::max(r.blocking, items[i].c);
        }
        r.worst = worst.response;
        r.queued = worst.queued;
        r.instance = worst.instance;

        r.errors = worst.errors;
        // with queues, the bound holds only when a message is sent before the next of its kind
        const std::int64_t limit = queues ? std::min(items[i].limit, items[i].t) : items[i].limit;
        r.in_time = r.worst >= 0 && r.worst <= limit;
        a.fits = a.fits && r.in_time;
    }
    return a;
}

std::optional<std::uint32_t> sufficient_bit_rate(std::span<const Message> messages,
                                                 const Bus& bus) {
    for (const std::uint32_t rate : {10'000U, 20'000U, 50'000U, 100'000U, 125'000U, 250'000U,
                                     500'000U, 800'000U, 1'000'000U}) {
        if (rate > bus.bit_rate && analyse(messages, {rate, bus.data_rate, bus.errors}).fits) {
            return rate;
        }
    }
    return std::nullopt;
}

std::vector<std::size_t> sufficient_order(std::span<const Message> messages, const Bus& bus) {
    if (messages.size() > 256 || bus.bit_rate == 0) {
        return {};
    }
    if (std::any_of(messages.begin(), messages.end(),
                    [](const Message& m) { return m.fifo != 0; })) {
        return {};
    }
    const std::vector<Item> items = items_of(messages, bus);
    std::vector<std::size_t> open(messages.size()), order;
    std::iota(open.begin(), open.end(), std::size_t{0});
    std::stable_sort(open.begin(), open.end(), [&](std::size_t x, std::size_t y) {
        return items[x].limit - items[x].j < items[y].limit - items[y].j;
    });
    std::int64_t blocking = 0;
    // a message that meets its deadline below all others gets the lowest free priority; late
    // deadlines first
    while (!open.empty()) {
        bool found = false;
        for (std::size_t index = open.size(); index-- > 0 && !found;) {
            const std::size_t i = open[index];
            std::vector<Item> busy;
            for (const std::size_t other : open) {
                if (other != i) {
                    busy.push_back(items[other]);
                }
            }
            busy.push_back(items[i]);
            const Worst worst = worst_of(items[i], blocking, busy, bus);
            if (worst.response < 0 || worst.response > items[i].limit) continue;
            found = true;
            order.push_back(i);
            blocking = std::max(blocking, items[i].c);
            open.erase(open.begin() + static_cast<std::ptrdiff_t>(index));
        }
        if (!found) {
            return {};
        }
    }
    std::reverse(order.begin(), order.end());
    return order;
}

}  // namespace hal::can_timing
