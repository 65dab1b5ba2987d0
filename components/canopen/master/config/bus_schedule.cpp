// SPDX-License-Identifier: MIT
#include "bus_schedule.hpp"

#include <algorithm>
#include <cstdio>
#include <map>

#include "link/can.hpp"

namespace hal::canopen::config {

namespace {

/// How often an event-driven PDO may come: its inhibit time, else its event timer, else once a SYNC
/// or cycle.
Time event_period(const Pdo& pdo, Time otherwise) {
    if (pdo.inhibit_100us != 0) {
        return std::max<Time>(pdo.inhibit_100us * 100 * microsecond, microsecond);
    }
    if (pdo.event_ms != 0 && !pdo.to_node) {
        return std::min<Time>(pdo.event_ms * millisecond, otherwise);
    }
    return otherwise;
}

bool event_driven(const Pdo& pdo) { return pdo.transmission >= 254; }

std::string ms(Time t) {
    char text[40];
    std::snprintf(text, sizeof text, "%.3f", static_cast<double>(t) / 1e6);
    return text;
}

}  // namespace

Schedule schedule_of(const MasterConfig& config, Time cycle) {
    Schedule out;
    out.bus = {config.bit_rate, config.data_rate, {}};
    const Time sync = config.sync == SyncMode::none ? 0
                      : config.sync_period != 0     ? config.sync_period
                                                    : cycle;
    out.sync = sync;
    const auto add = [&](std::uint32_t cob, unsigned bytes, Time period, std::string name, Span at,
                         bool of_sync) {
        can_timing::Message m;
        m.id = cob_id(cob);
        m.extended = (cob & cob_extended) != 0;

        m.bytes = static_cast<std::uint8_t>(bytes);
        m.period = period;
        if (of_sync) {
            m.deadline = sync;
            ++out.per_sync;
        }
        out.messages.push_back(m);
        out.names.push_back(std::move(name));
        out.spans.push_back(at);
        out.assumed.push_back(false);
    };
    if (sync != 0) {
        add(config.sync_cob, config.sync_counter != 0 ? 1 : 0, sync, "SYNC", config.at, true);
    }
    if (config.time_period != 0) {
        add(0x100, 6, config.time_period, "TIME", config.at, false);
    }
    // while there is an active master; a negotiation is over by then
    if (const FlyingSetup& f = config.flying; f.enabled) {
        add(0x71, 2, f.search_interval(), "who is the NMT master", config.at, false);
        add(0x73, 0, f.search_interval(), "NMT master wanted", config.at, false);
    }
    for (const Node& n : config.nodes) {
        for (const Pdo& p : n.pdos) {
            if (p.safety) {
                const std::string name =
                    n.name + (p.to_node ? " rsrdo" : " tsrdo") + std::to_string(p.number);
                add(p.cob, p.bytes(), p.safety->refresh, name, p.at, false);
                add(p.cob + 1, p.bytes(), p.safety->refresh, name + " inverted", p.at, false);
                continue;
            }
            const auto same = std::find_if(out.messages.begin(), out.messages.end(),
                                           [&](const can_timing::Message& m) {
                return p.to_node && !m.remote && m.id == cob_id(p.cob) &&
                       m.extended == ((p.cob & cob_extended) != 0);
            });
            if (same != out.messages.end()) {  // several nodes take their parts of it
                out.names[static_cast<std::size_t>(same - out.messages.begin())] +=
                    ", " + n.name + " rpdo" + std::to_string(p.number);
                continue;
            }
            std::string name = n.name + (p.to_node ? " rpdo" : " tpdo") + std::to_string(p.number);
            const bool of_sync = p.synchronous() && sync != 0;
            if (p.request != 0) {
                add(p.cob, 0, p.request, name + " request", p.at, false);
                out.messages.back().remote = true;
            }
            const Time every = p.request != 0 && !event_driven(p) ? p.request
                               : of_sync ? sync * std::max<Time>(p.transmission, 1)
                                         : event_period(p, cycle);
            add(p.cob, p.bytes(), every, std::move(name), p.at, of_sync);
            out.assumed.back() = !of_sync && p.inhibit_100us == 0 && p.request == 0;
        }
    }
    for (const Node& n : config.nodes) {
        if (n.setup.heartbeat_ms != 0) {
            add(0x700U + n.setup.id, 1, n.setup.heartbeat_ms * millisecond, n.name + " heartbeat",
                n.at, false);
        }
        if (n.setup.guard_ms != 0) {
            add(0x700U + n.setup.id, 1, n.setup.guard_ms * millisecond, n.name + " guarding", n.at,
                false);
            add(0x700U + n.setup.id, 1, n.setup.guard_ms * millisecond,
                n.name + " guarding request", n.at, false);
            out.messages.back().remote = true;
            out.messages.back().bytes = 0;
        }
    }
    if (config.heartbeat_ms != 0) {
        add(0x700U + config.node_id, 1, config.heartbeat_ms * millisecond, "master heartbeat",
            config.at, false);
    }
    std::map<std::string, std::uint32_t> queues;
    for (const Foreign& f : config.foreign) {
        can_timing::Message m{f.id,    f.extended, f.remote,   f.fd,    f.bit_rate_switch,
                              f.bytes, f.period,   f.deadline, f.jitter};
        if (!f.queue.empty()) {
            m.fifo = queues.try_emplace(f.queue, static_cast<std::uint32_t>(queues.size() + 1))
                         .first->second;
        }
        out.messages.push_back(m);
        out.names.push_back(f.name);
        out.spans.push_back(f.at);
        out.assumed.push_back(false);
    }
    const auto analysis = can_timing::analyse(out.messages, out.bus);
    Time together = 0;
    for (std::size_t i = 0; i < out.messages.size(); ++i) {
        if (sync != 0 && out.messages[i].deadline == sync && i < out.names.size()) {
            together += analysis.responses[i].frame;
        }
    }
    if (sync != 0) {
        out.sync_share = static_cast<double>(together) / static_cast<double>(sync);
    }
    return out;
}

std::vector<Message> load_messages(const MasterConfig& config, Time cycle,
                                   const std::string& path) {
    // messages on Ethernet share frames, not a bit rate
    if (!can::describe(config.link).has_bit_rate) {
        return {};
    }
    Schedule schedule = schedule_of(config, cycle);
    // Only known periods count: a PDO that is sent on a change may be rare.
    for (std::size_t i = schedule.messages.size(); i-- > 0;) {
        if (!schedule.assumed[i]) continue;
        const auto at = static_cast<std::ptrdiff_t>(i);
        schedule.messages.erase(schedule.messages.begin() + at);
        schedule.names.erase(schedule.names.begin() + at);
    }
    const auto analysis = can_timing::analyse(schedule.messages, schedule.bus);
    std::size_t late = schedule.messages.size();
    for (std::size_t i = 0; i < schedule.messages.size() && late == schedule.messages.size(); ++i) {
        if (!analysis.responses[i].in_time) {
            late = i;
        }
    }
    if (analysis.fits || late == schedule.messages.size()) {
        return {};
    }
    char share[40];
    std::snprintf(share, sizeof share, "%.1f", 100 * analysis.load);
    std::string sentence =
        "bus overload: deadlines are missed at a worst-case load of " + std::string(share) + " %";
    if (schedule.sync != 0) {
        std::snprintf(share, sizeof share, "%.3f",
                      schedule.sync_share * static_cast<double>(schedule.sync) / 1e6);
        sentence += ", and " + std::to_string(schedule.per_sync) + " frames with a SYNC take " +
                    share + " ms of its " + ms(schedule.sync) + " ms";
    }
    std::string help = "hal canopen plan " + path + " shows the calculation and what to change";
    if (const auto rate = can_timing::sufficient_bit_rate(schedule.messages, schedule.bus)) {
        help = "bitrate = " + (*rate == 1'000'000 ? "1M" : std::to_string(*rate / 1000) + "k") +
               " is sufficient; " + help;
    }
    return {{Severity::warning, Topic::load, config.at, std::move(sentence), std::move(help),
             "first late message: " + schedule.names[late]}};
}

}  // namespace hal::canopen::config
