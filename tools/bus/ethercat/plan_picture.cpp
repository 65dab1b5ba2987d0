// SPDX-License-Identifier: MIT
#include "bus/ethercat/plan_picture.hpp"

#include <algorithm>
#include <fmt/core.h>

#include "text/quoting.hpp"

namespace hal::tools {

namespace {

using namespace ethercat;

constexpr std::size_t max_slave_lanes = 16;
constexpr unsigned max_ticks = 64;  // in a cycle

std::string micro(std::int64_t ns) {
    return fmt::format("{:g} us", static_cast<double>(ns) / 1000);
}

class TimelineOfBus {
public:
    TimelineOfBus(const config::Bus& bus, const config::Plan& plan,
                  const config::PlanOptions& assumed)
        : bus_(bus),
          plan_(plan),
          assumed_(assumed),
          cycles_(plan.input_to_output_ns * 10 > plan.cycle_ns * 23 ? 3 : 2),
          shown_slaves_(std::min(bus.setup.slaves.size(), max_slave_lanes)) {}

    Timeline make() {
        Timeline timeline;
        timeline.command = "hal ethercat plan";
        timeline.title = fmt::format("{} cycles of {}; times from the start of a cycle", cycles_,
                                     micro(plan_.cycle_ns));
        timeline.cycle_ns = plan_.cycle_ns;
        timeline.shown_ns = plan_.cycle_ns * (10 * cycles_ + 3) / 10;
        timeline.lanes = {thread_lane(), wire_lane()};
        bool synchronised = false;
        for (std::size_t n = 0; n < shown_slaves_; ++n) {
            timeline.lanes.push_back(slave_lane(n));
            synchronised = synchronised || !timeline.lanes.back().moments.empty();
        }
        timeline.journeys = {{0, plan_.input_to_output_ns,
                              "an input changes just after it was sampled",
                              "the output that answers it"}};
        timeline.key = key(synchronised);
        const std::size_t hidden = bus_.setup.slaves.size() - shown_slaves_;
        if (hidden > 0) {
            timeline.summary.push_back("Not shown: " + counted(hidden, "further slave") + ".");
        }
        timeline.summary.push_back(
            fmt::format("Wire load {:.1f} %; shortest cycle {}; worst case from an input to the "
                        "output that answers it {}.",
                        100 * plan_.load, micro(plan_.shortest_cycle_ns),
                        micro(plan_.input_to_output_ns)));
        return timeline;
    }

private:
    std::int64_t begin_of(std::int64_t cycle) const { return cycle * plan_.cycle_ns; }
    std::int64_t sent_in(std::int64_t cycle) const { return begin_of(cycle) + assumed_.master_ns; }

    Lane thread_lane() const {
        Lane lane;
        lane.name = "thread";
        for (std::int64_t k = 0; k < cycles_; ++k) {
            lane.bars.push_back({begin_of(k), sent_in(k), Colour::clock, Bar::Shape::solid});
        }
        lane.labels = {
            {sent_in(0), "receive, components, transmit: at most " + micro(assumed_.master_ns)}};
        return lane;
    }
    Lane wire_lane() const {
        Lane lane;
        lane.name = "wire";
        for (std::int64_t k = 0; k < cycles_; ++k) {
            lane.bars.push_back(
                {sent_in(k), sent_in(k) + plan_.wire_ns, Colour::leader, Bar::Shape::solid});
        }
        lane.labels = {{sent_in(0) + plan_.wire_ns,
                        fmt::format("{} frame{}, {}", plan_.frames, plan_.frames == 1 ? "" : "s",
                                    micro(plan_.wire_ns))}};
        return lane;
    }
    Lane slave_lane(std::size_t n) const {
        const master::Slave& slave = bus_.setup.slaves[n];
        Lane lane;
        lane.name = slave.name;
        for (std::int64_t k = 0; k < cycles_; ++k) {
            const std::int64_t arrives =
                sent_in(k) + static_cast<std::int64_t>(n + 1) * assumed_.slave_delay_ns / 2;
            lane.bars.push_back(
                {arrives, arrives + plan_.wire_ns, Colour::follower, Bar::Shape::solid});
            if (slave.dc && slave.dc->assign_activate != 0) {
                add_ticks(lane, *slave.dc, begin_of(k));
            }
        }
        return lane;
    }
    /// Adds the pulses of SYNC0 in the cycle that begins at `begin`.
    template <class Clock>
    void add_ticks(Lane& lane, const Clock& clock, std::int64_t begin) const {
        const std::int64_t every =
            clock.sync0_cycle_ns > 0 ? clock.sync0_cycle_ns : plan_.cycle_ns;
        const bool longer_than_a_cycle = every > plan_.cycle_ns;
        if (longer_than_a_cycle && begin != 0) return;
        std::int64_t pulse = begin + clock.sync0_shift_ns % plan_.cycle_ns;
        if (pulse < begin) {
            pulse += plan_.cycle_ns;
        }
        for (unsigned n = 0; pulse < begin + plan_.cycle_ns && n < max_ticks; ++n) {
            lane.moments.push_back({pulse, Moment::Kind::tick});
            pulse += every;
        }
    }
    static std::vector<KeyEntry> key(bool synchronised) {
        using Sample = KeyEntry::Sample;
        std::vector<KeyEntry> entries = {{Sample::bar, Colour::clock, "thread"},
                                         {Sample::bar, Colour::leader, "frames on the wire"},
                                         {Sample::bar, Colour::follower, "frames in a slave"}};
        if (synchronised) {
            entries.push_back({Sample::tick, Colour::clock, "SYNC0"});
        }
        return entries;
    }

    const config::Bus& bus_;
    const config::Plan& plan_;
    const config::PlanOptions& assumed_;
    const std::int64_t cycles_;  // shown in full
    const std::size_t shown_slaves_;
};

}  // namespace

Timeline timeline_of(const config::Bus& bus, const config::Plan& plan,
                     const config::PlanOptions& assumed) {
    return TimelineOfBus(bus, plan, assumed).make();
}

}  // namespace hal::tools
