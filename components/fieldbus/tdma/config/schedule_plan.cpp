// SPDX-License-Identifier: MIT
#include "schedule_plan.hpp"

#include <algorithm>
#include <numeric>

namespace hal::tdma::plan {

using config::Schedule;
using config::StationEntry;

bool meet(const Entry& a, const Entry& b) {
    const std::uint32_t common = std::gcd(a.period, b.period);
    return a.phasing % common == b.phasing % common;  // Chinese remainder theorem
}

std::vector<Entry> entries_of(const Schedule& s) {
    std::vector<Entry> out;
    const Time sync = s.wire(ethernet::smallest_frame);
    for (std::size_t i = 0; i < s.stations.size(); ++i) {
        const StationEntry& e = s.stations[i];
        if (e.role == Role::master) {
            out.push_back({Entry::What::sync, i, 0, 0, sync, 60, 1, 0, e.at});
        }
        if (e.role == Role::backup) {
            out.push_back({Entry::What::backup_sync, i, 0, e.backup_offset, e.backup_offset + sync,
                           60, 1, 0, e.backup_at});
        }
        for (const config::SlotEntry& slot : e.slots) {
            const std::size_t bytes =
                ethernet::header_bytes + std::max<std::size_t>(slot.setup.size, 46);
            // RTnet's masters have a slot at 0: it is the next thing on their line.
            const Time at =
                e.role == Role::master ? std::max(slot.setup.offset, sync) : slot.setup.offset;
            out.push_back({Entry::What::slot, i, slot.setup.id, at, at + s.wire(bytes), bytes,
                           slot.setup.period, slot.setup.phasing, slot.at});
        }
    }
    std::stable_sort(out.begin(), out.end(),
                     [](const Entry& a, const Entry& b) { return a.at < b.at; });
    return out;
}

namespace {

/// The first moment `phase` + k cycles at or after `t`.
Time next(Time phase, Time cycle, Time t) {
    if (t <= phase) return phase;
    return phase + (t - phase + cycle - 1) / cycle * cycle;
}

/// When a frame leaves that was handed over by the transmit of a thread that began at `begun`.
Time leaves(const Schedule& s, const StationEntry& e, Time begun, std::size_t index = 0) {
    const SlotSetup& slot = e.slots[index].setup;
    const Time at = e.role == Role::master ? std::max(slot.offset, s.wire(60)) : slot.offset;
    Time t = next(at, s.cycle, begun + e.lead + 1);
    return t + static_cast<Time>(slot.period - 1) * s.cycle;
}

/// Who closes the loops: the master; when it has no slot and keeps the time alone, the first backup
/// that has one.
std::optional<std::size_t> loops_of(const Schedule& s) {
    for (const Role role : {Role::master, Role::backup}) {
        for (std::size_t i = 0; i < s.stations.size(); ++i) {
            if (s.stations[i].role == role && !s.stations[i].slots.empty()) return i;
        }
    }
    return {};
}

std::size_t max(const StationEntry& e, std::size_t index = 0) {
    return ethernet::header_bytes + std::max<std::size_t>(e.slots[index].setup.size, 46);
}

}  // namespace

Plan plan_of(const Schedule& s) {
    Plan plan;
    plan.entries = entries_of(s);
    for (const Entry& e : plan.entries) {
        if (e.what != Entry::What::backup_sync) {
            plan.load += static_cast<double>(e.until - e.at) / static_cast<double>(s.cycle) /
                         static_cast<double>(e.period);
        }
    }
    plan.by_way_of = loops_of(s);
    if (!plan.by_way_of) return plan;
    const StationEntry& m = s.stations[*plan.by_way_of];
    for (std::size_t i = 0; i < s.stations.size(); ++i) {
        const StationEntry& e = s.stations[i];
        if (i == *plan.by_way_of || e.slots.empty()) continue;
        RoundTrip t;
        t.station = i;
        t.read = e.phase;
        t.up = leaves(s, e, t.read);
        t.up_arrives = t.up + s.path(max(e));
        t.master = next(m.phase, s.cycle, t.up_arrives);
        t.down = leaves(s, m, t.master);
        t.down_arrives = t.down + s.path(max(m));
        t.output = next(e.phase, s.cycle, t.down_arrives);
        t.worst = t.output - t.read + s.cycle;
        t.cycles = static_cast<std::uint32_t>((t.output - t.read) / s.cycle);
        plan.trips.push_back(t);
    }
    return plan;
}

std::vector<Way> ways_of(const Schedule& s, std::size_t here, std::size_t slot) {
    std::vector<Way> ways;
    const StationEntry& own = s.stations[here];
    // Back at this station's thread, in a cycle's first moment, with what the other's thread read.
    const auto back_from = [&](const StationEntry& e, Time read) {
        return next(own.phase, s.cycle, leaves(s, e, read) + s.path(max(e)));
    };
    for (std::size_t i = 0; i < s.stations.size(); ++i) {
        const StationEntry& e = s.stations[i];
        if (i == here || e.slots.empty()) continue;
        const Time begun = own.phase;
        const Time taken =
            next(e.phase, s.cycle, leaves(s, own, begun, slot) + s.path(max(own, slot)));
        // what was taken is at a terminal; the next cycle there reads it back
        const Time home = back_from(e, taken + s.cycle);
        const Time read = e.phase;
        const Time came = back_from(e, read);
        ways.push_back({i, taken - begun, came - read + s.cycle,
                        static_cast<std::uint32_t>((taken - begun) / s.cycle),
                        static_cast<std::uint32_t>((came - read + s.cycle - 1) / s.cycle),
                        static_cast<std::uint32_t>((home - begun) / s.cycle)});
    }
    return ways;
}

}  // namespace hal::tdma::plan
