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

namespace {

/// Collects the messages of a bus.
class ScheduleBuilder {
public:
    ScheduleBuilder(const MasterConfig& config, Time cycle) : config_(config), cycle_(cycle) {
        out_.bus = {config.bit_rate, config.data_rate, {}};
        if (config.sync != SyncMode::none) {
            out_.sync = config.sync_period != 0 ? config.sync_period : cycle;
        }
    }

    Schedule build() {
        services();
        for (const Node& n : config_.nodes) {
            for (const Pdo& p : n.pdos) {
                pdo(n, p);
            }
        }
        for (const Node& n : config_.nodes) {
            error_control(n);
        }
        if (config_.heartbeat_ms != 0) {
            add(0x700U + config_.node_id, 1, config_.heartbeat_ms * millisecond, "master heartbeat",
                config_.at);
        }
        foreign();
        share_of_sync();
        return std::move(out_);
    }

private:
    can_timing::Message& add(std::uint32_t cob, unsigned bytes, Time period, std::string name,
                             Span at) {
        can_timing::Message m;
        m.id = cob_id(cob);
        m.extended = (cob & cob_extended) != 0;
        m.bytes = static_cast<std::uint8_t>(bytes);
        m.period = period;
        return add(m, std::move(name), at);
    }
    can_timing::Message& add(const can_timing::Message& m, std::string name, Span at) {
        out_.messages.push_back(m);
        out_.names.push_back(std::move(name));
        out_.spans.push_back(at);
        out_.assumed.push_back(false);
        return out_.messages.back();
    }
    void belongs_to_sync(can_timing::Message& m) {
        m.deadline = out_.sync;
        ++out_.per_sync;
    }

    void services() {
        if (out_.sync != 0) {
            belongs_to_sync(add(config_.sync_cob, config_.sync_counter != 0 ? 1 : 0, out_.sync,
                                "SYNC", config_.at));
        }
        if (config_.time_period != 0) {
            add(0x100, 6, config_.time_period, "TIME", config_.at);
        }
        // while there is an active master; a negotiation is over by then
        if (const FlyingSetup& f = config_.flying; f.enabled) {
            add(0x71, 2, f.search_interval(), "who is the NMT master", config_.at);
            add(0x73, 0, f.search_interval(), "NMT master wanted", config_.at);
        }
    }

    void pdo(const Node& n, const Pdo& p) {
        const std::string number = std::to_string(p.number);
        if (p.safety) {
            const std::string name = n.name + (p.to_node ? " rsrdo" : " tsrdo") + number;
            add(p.cob, p.bytes(), p.safety->refresh, name, p.at);
            add(p.cob + 1, p.bytes(), p.safety->refresh, name + " inverted", p.at);
            return;
        }
        const std::string name = n.name + (p.to_node ? " rpdo" : " tpdo") + number;
        if (std::string* shared = p.to_node ? shared_name(p) : nullptr) {
            *shared += ", " + name;  // several nodes take their parts of it
            return;
        }
        if (p.request != 0) {
            add(p.cob, 0, p.request, name + " request", p.at).remote = true;
        }
        const bool of_sync = p.synchronous() && out_.sync != 0;
        can_timing::Message& m = add(p.cob, p.bytes(), period_of(p, of_sync), name, p.at);
        if (of_sync) {
            belongs_to_sync(m);
        }
        out_.assumed.back() = !of_sync && p.inhibit_100us == 0 && p.request == 0;
    }

    /// Returns the name of the message with the identifier of an RPDO; nullptr if no message has it.
    std::string* shared_name(const Pdo& p) {
        const bool extended = (p.cob & cob_extended) != 0;
        const auto same = std::find_if(out_.messages.begin(), out_.messages.end(),
                                       [&](const can_timing::Message& m) {
            return !m.remote && m.id == cob_id(p.cob) && m.extended == extended;
        });
        if (same == out_.messages.end()) return nullptr;
        return &out_.names[static_cast<std::size_t>(same - out_.messages.begin())];
    }

    Time period_of(const Pdo& p, bool of_sync) const {
        if (p.request != 0 && !event_driven(p)) return p.request;
        if (of_sync) return out_.sync * std::max<Time>(p.transmission, 1);
        return event_period(p, cycle_);
    }

    void error_control(const Node& n) {
        const std::uint32_t cob = 0x700U + n.setup.id;
        if (n.setup.heartbeat_ms != 0) {
            add(cob, 1, n.setup.heartbeat_ms * millisecond, n.name + " heartbeat", n.at);
        }
        if (n.setup.guard_ms == 0) return;
        const Time period = n.setup.guard_ms * millisecond;
        add(cob, 1, period, n.name + " guarding", n.at);
        add(cob, 0, period, n.name + " guarding request", n.at).remote = true;
    }

    void foreign() {
        std::map<std::string, std::uint32_t> queues;
        for (const Foreign& f : config_.foreign) {
            can_timing::Message m{f.id,    f.extended, f.remote,   f.fd,    f.bit_rate_switch,
                                  f.bytes, f.period,   f.deadline, f.jitter};
            if (!f.queue.empty()) {
                const auto next = static_cast<std::uint32_t>(queues.size() + 1);
                m.fifo = queues.try_emplace(f.queue, next).first->second;
            }
            add(m, f.name, f.at);
        }
    }

    /// Computes how much of the SYNC's period its frames take.
    void share_of_sync() {
        if (out_.sync == 0) return;
        const auto analysis = can_timing::analyse(out_.messages, out_.bus);
        Time together = 0;
        for (std::size_t i = 0; i < out_.messages.size(); ++i) {
            if (out_.messages[i].deadline == out_.sync) {
                together += analysis.responses[i].frame;
            }
        }
        out_.sync_share = static_cast<double>(together) / static_cast<double>(out_.sync);
    }

    const MasterConfig& config_;
    Time cycle_;
    Schedule out_;
};

}  // namespace

Schedule schedule_of(const MasterConfig& config, Time cycle) {
    return ScheduleBuilder(config, cycle).build();
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
