// SPDX-License-Identifier: MIT
#include "plan.hpp"

#include <algorithm>

#include "link/timing.hpp"

namespace hal::scocan::plan {

namespace {

class Analysis {
public:
    Analysis(const Table& table, std::uint32_t mode) : t_(table), mode_(*table.mode(mode)) {
        for (const auto& uses : mode_.slots) {
            for (const Use& u : uses) {
                cycles_ = std::max(cycles_, u.every);
            }
        }
    }

    Plan run() {
        Plan p;
        p.mode = mode_.number;
        for (std::uint32_t slot = 1; slot < t_.slots; ++slot) {
            is_shared(slot) ? ++p.shared_slots : ++p.private_slots;
        }
        std::size_t shared = 0;
        for (std::uint32_t slot = 1; slot < t_.slots * cycles_; ++slot) {
            shared += is_shared(slot);
        }
        p.capacity = static_cast<double>(shared) *
                     static_cast<double>(std::max<Time>(t_.last_start(8), 0)) /
                     static_cast<double>(t_.cycle * cycles_);
        for (std::size_t i = 0; i < t_.messages.size(); ++i) {
            p.latencies.push_back(latency(i, p));
        }
        plain(p);
        std::stable_sort(p.latencies.begin(), p.latencies.end(),
                         [&](const Latency& a, const Latency& b) {
            return t_.messages[a.message].id < t_.messages[b.message].id;
        });
        p.fits = std::all_of(p.latencies.begin(), p.latencies.end(),
                             [](const Latency& l) { return l.in_time; });
        return p;
    }

private:
    const Use* use(std::uint32_t slot) const {
        return t_.use(mode_.number, slot % t_.slots, slot / t_.slots % counter_cycles);
    }
    bool is_shared(std::uint32_t slot) const {
        const Use* u = use(slot);
        return slot % t_.slots != 0 && (u == nullptr || u->kind == Kind::shared);
    }

    Latency latency(std::size_t index, Plan& p) const {
        const Message& m = t_.messages[index];
        Latency l;
        l.message = index;
        l.frame = t_.frame(m.bytes);
        if (t_.owner(mode_.number, m.id) != nullptr) {
            private_latency(m, l, p);
        } else {
            shared_latency(m, l, p);
        }
        // A value that just missed its slot is sent in the next turn: that is expected.
        const Time turn = l.gap * l.turns;
        if (m.deadline > 0) {
            l.deadline = m.deadline;
        } else if (l.priv) {
            l.deadline = std::max(m.period, turn) + m.jitter + t_.slot();
        } else {
            l.deadline = m.period;
        }
        l.in_time =
            l.worst >= 0 && l.worst <= l.deadline && (!l.priv || m.period == 0 || turn <= m.period);
        return l;
    }

    void private_latency(const Message& m, Latency& l, Plan& p) const {
        l.priv = true;
        std::vector<Time> turns;
        for (std::uint32_t slot = 0; slot < t_.slots * cycles_; ++slot) {
            if (const Use* u = use(slot); u != nullptr && u->carries(m.id)) {
                turns.push_back(t_.slot() * slot);
                l.turns =
                    std::max<std::uint32_t>(l.turns, static_cast<std::uint32_t>(u->ids.size()));
            }
        }
        if (turns.empty()) return;
        for (std::size_t i = 0; i < turns.size(); ++i) {
            l.gap = std::max(l.gap, i + 1 < turns.size()
                                        ? turns[i + 1] - turns[i]
                                        : turns.front() + t_.cycle * cycles_ - turns[i]);
        }
        l.worst = m.jitter + l.gap * l.turns + t_.guard + l.frame;
        l.jitter = t_.guard;
        const double every = m.period > 0 ? static_cast<double>(m.period)
                                          : static_cast<double>(t_.cycle * cycles_) /
                                                static_cast<double>(turns.size()) * l.turns;
        p.private_load += static_cast<double>(l.frame) / every;
    }

    void shared_latency(const Message& m, Latency& l, Plan& p) const {
        if (m.period > 0) {
            p.shared_load += static_cast<double>(l.frame) / static_cast<double>(m.period);
        }
        std::vector<const Message*> higher;
        std::uint32_t max = m.bytes;
        double load =
            static_cast<double>(l.frame) / static_cast<double>(std::max<Time>(m.period, 1));
        for (const Message& other : t_.messages) {
            if (&other == &m || t_.owner(mode_.number, other.id) != nullptr || other.period <= 0) {
                continue;
            }
            if (other.id > m.id) continue;
            higher.push_back(&other);
            max = std::max(max, other.bytes);
            load += static_cast<double>(t_.frame(other.bytes)) / static_cast<double>(other.period);
        }
        const Time usable = t_.last_start(max);
        std::size_t shared = 0;
        for (std::uint32_t slot = 1; slot < t_.slots * cycles_; ++slot) {
            shared += is_shared(slot);
        }
        if (m.period <= 0 || usable <= 0 ||
            load * static_cast<double>(t_.cycle * cycles_) >=
                static_cast<double>(shared) * static_cast<double>(usable)) {
            return;
        }
        for (std::uint32_t slot = 0; slot < t_.slots * cycles_; ++slot) {
            if (!evaluate(m, higher, slot, usable, l)) return void(l.worst = -1);
        }
        if (l.worst > m.period) {
            l.worst = -1;  // more than one instance would wait
        }
        l.jitter = l.worst < 0 ? -1 : l.worst - m.jitter - shortest(m);
    }
    Time shortest(const Message& m) const { return t_.bits(47 + 8 * m.bytes); }

    /// The message is queued just behind the begin of `slot`: it is offered from the next slot on.
    /// Returns false when it never starts.
    bool evaluate(const Message& m, const std::vector<const Message*>& higher, std::uint32_t slot,
                  Time usable, Latency& l) const {
        const can_timing::Bus bus{.bit_rate = t_.bit_rate};
        Time waited = 0;
        Time interference = 0;
        for (;;) {
            interference = 0;
            for (const Message* other : higher) {
                interference += can_timing::times_before(plain_of(*other), waited, bus) *
                                t_.frame(other->bytes);
            }
            const Time start = served(slot + 1, interference, usable) - t_.slot() * slot;
            if (start > 1000 * t_.cycle * cycles_) return false;
            if (start <= waited) break;
            waited = start;
        }
        const Time worst = m.jitter + waited + l.frame + t_.guard;
        if (worst <= l.worst) return true;
        l.worst = worst;
        l.interference = interference;
        l.released = t_.slot() * (slot % t_.slots);
        l.waiting = waited - interference;
        return true;
    }

    /// Returns the instant at which the shared slots have carried that much work, from a slot on.
    Time served(std::uint32_t slot, Time work, Time usable) const {
        const std::uint32_t all = t_.slots * cycles_;
        for (std::uint32_t s = slot; s < slot + 2000U * all; ++s) {
            if (!is_shared(s % all)) continue;
            if (work <= usable) return t_.slot() * s + work;
            work -= usable;
        }
        return INT64_MAX / 4;
    }

    static can_timing::Message plain_of(const Message& m) {
        return {.id = m.id,
                .bytes = static_cast<std::uint8_t>(m.bytes),
                .period = m.period,
                .deadline = m.deadline,
                .jitter = m.jitter};
    }

    void plain(Plan& p) const {
        const auto messages = plain_messages(t_, mode_.number);
        const can_timing::Analysis a = can_timing::analyse(messages, {.bit_rate = t_.bit_rate});
        p.plain_load = a.load;
        for (Latency& l : p.latencies) {
            const can_timing::Response& r = a.responses[l.message];
            l.plain = r.worst;
            l.plain_in_time = r.in_time;
            l.plain_jitter = r.worst < 0 ? -1
                                         : r.worst - t_.messages[l.message].jitter -
                                               shortest(t_.messages[l.message]);
        }
    }

    const Table& t_;
    const Mode& mode_;
    std::uint32_t cycles_ = 1;
};

}  // namespace

std::optional<std::size_t> unlimited(const Table& t, std::uint32_t mode) {
    for (std::size_t i = 0; i < t.messages.size(); ++i) {
        if (t.messages[i].period <= 0 && t.owner(mode, t.messages[i].id) == nullptr) return i;
    }
    return {};
}

std::vector<can_timing::Message> plain_messages(const Table& t, std::uint32_t mode) {
    std::vector<can_timing::Message> messages;
    for (const Message& m : t.messages) {
        Time period = m.period;
        if (period <= 0) {
            std::size_t turns = 0;
            for (std::uint32_t slot = 0; slot < t.slots * counter_cycles; ++slot) {
                if (const Use* u = t.use(mode, slot % t.slots, slot / t.slots);
                    u != nullptr && u->carries(m.id)) {
                    ++turns;
                }
            }
            period = t.cycle * counter_cycles / static_cast<Time>(std::max<std::size_t>(turns, 1));
        }
        messages.push_back({.id = m.id,
                            .bytes = static_cast<std::uint8_t>(m.bytes),
                            .period = period,
                            .deadline = m.deadline,
                            .jitter = m.jitter});
    }
    return messages;
}

Plan plan_of(const Table& table, std::uint32_t mode) { return Analysis(table, mode).run(); }

}  // namespace hal::scocan::plan
