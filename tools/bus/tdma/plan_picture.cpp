// SPDX-License-Identifier: MIT
#include "bus/tdma/plan_picture.hpp"

#include <algorithm>
#include <fmt/core.h>

namespace hal::tools {

namespace {

namespace plan = tdma::plan;
using tdma::Role;
using tdma::Time;
using tdma::config::Schedule;
using What = plan::Entry::What;

double us(Time t) { return static_cast<double>(t) / 1e3; }

Colour colour_of(const Schedule& s, const plan::Entry& e) {
    if (e.what != What::slot) return Colour::clock;
    return s.stations[e.station].role == Role::slave ? Colour::follower : Colour::leader;
}

std::string label_of(const plan::Entry& e) {
    if (e.what == What::sync) return "sync";
    const bool every_cycle = e.what == What::backup_sync || e.period == 1;
    return every_cycle ? fmt::format("{:g}", us(e.at))
                       : fmt::format("{:g}, {} of {} cycles", us(e.at), e.phasing + 1, e.period);
}

/// Adds a frame to the lane of its sender, and pale until it has left the receiver's line.
void add_frame(Timeline& timeline, const Schedule& s, const plan::Entry& e, Time later) {
    const Time there = e.at + s.path(e.bytes) + later;
    if (there > timeline.shown_ns) return;
    Lane& lane = timeline.lanes[e.station];
    const Colour colour = colour_of(s, e);
    const bool backup = e.what == What::backup_sync;
    if (backup) {
        lane.bars.push_back({e.at + later, e.until + later, colour, Bar::Shape::dashed});
    } else {
        lane.bars.push_back({e.until + later, there, colour, Bar::Shape::pale});
        lane.bars.push_back({e.at + later, e.until + later, colour, Bar::Shape::solid});
    }
    const bool first = later == 0;
    if (first) {
        lane.labels.push_back({backup ? e.until : there, label_of(e)});
    }
}

std::string summary_of(const Schedule& s, const plan::Plan& p) {
    std::string line = fmt::format("Line load {:.1f} %", 100 * p.load);
    const auto sooner = [](const plan::RoundTrip& a, const plan::RoundTrip& b) {
        return a.worst < b.worst;
    };
    const auto worst = std::max_element(p.trips.begin(), p.trips.end(), sooner);
    if (worst == p.trips.end()) return line;
    return line + fmt::format("; worst-case latency from input to output of {}: {:g} us",
                              s.stations[worst->station].name, us(worst->worst));
}

}  // namespace

Timeline timeline_of(const Schedule& s, const plan::Plan& p) {
    using Sample = KeyEntry::Sample;
    Timeline timeline;
    timeline.command = "hal tdma plan";
    timeline.title = fmt::format(
        "A cycle of {:g} us; times from the sync, in us; wire times at {} Mbit/s{}", us(s.cycle),
        s.speed, s.forward == 0 ? "" : fmt::format(", {:g} us in the switch", us(s.forward)));
    timeline.cycle_ns = s.cycle;
    timeline.shown_ns = s.cycle * 136 / 100;
    for (const auto& station : s.stations) {
        Lane lane;
        lane.name = station.name;
        for (Time begin = station.phase; begin < timeline.shown_ns; begin += s.cycle) {
            lane.moments.push_back({begin, Moment::Kind::thread});
        }
        timeline.lanes.push_back(std::move(lane));
    }
    for (const plan::Entry& e : p.entries) {
        add_frame(timeline, s, e, 0);
        add_frame(timeline, s, e, s.cycle);
    }
    timeline.key = {{Sample::bar, Colour::clock, "sync"},
                    {Sample::bar, Colour::leader, "slot of a master"},
                    {Sample::bar, Colour::follower, "slot of a slave"},
                    {Sample::dashed, Colour::clock, "sync of a backup, if none came"},
                    {Sample::thread, Colour::clock, "thread begins"},
                    {Sample::pale, Colour::leader, "in transit to the receiver"}};
    timeline.summary.push_back(summary_of(s, p));
    return timeline;
}

}  // namespace hal::tools
