// SPDX-License-Identifier: MIT
// `hal tdma plan`: the schedule of an Ethernet segment as a timeline, with line load and worst-case
// latency from an input to an output; or as a picture.
#include "bus/tdma/plan.hpp"

#include <algorithm>
#include <fmt/core.h>

#include "bus/tdma/plan_picture.hpp"
#include "bus/timeline/letter_strip.hpp"
#include "bus/timeline/plan_output.hpp"
#include "bus/timeline/text_table.hpp"
#include "fieldbus/tdma/config/schedule_plan.hpp"
#include "text/quoting.hpp"

namespace hal::tools {

namespace {

namespace config = tdma::config;
namespace plan = tdma::plan;
using tdma::Time;

double us(Time t) { return static_cast<double>(t) / 1e3; }

const char* word(plan::Entry::What what) {
    constexpr const char* words[] = {"sync", "backup sync", "slot"};
    return words[static_cast<std::size_t>(what)];
}

std::string called(const plan::Entry& e) {
    return e.what == plan::Entry::What::slot ? fmt::format("slot {}", e.id) : word(e.what);
}

std::string table_text(const config::Schedule& s, const plan::Plan& p) {
    TextTable table({{"from us", 9},
                     {"until", 9},
                     {"free", 9},
                     {"station", 16, true},
                     {"use", 12, true, " "},
                     {"bytes", 6, false, " "},
                     {"cycles", 0, true}});
    for (std::size_t i = 0; i < p.entries.size(); ++i) {
        const plan::Entry& e = p.entries[i];
        const auto next =
            std::find_if(p.entries.begin() + static_cast<std::ptrdiff_t>(i) + 1, p.entries.end(),
                         [&](const plan::Entry& other) { return meet(e, other); });
        const Time free_until = next == p.entries.end() ? s.cycle : next->at;
        const std::string every =
            e.period == 1 ? "all" : fmt::format("{} of {}", e.phasing + 1, e.period);
        table.add({fmt::format("{:.2f}", us(e.at)), fmt::format("{:.2f}", us(e.until)),
                   fmt::format("{:.2f}", us(free_until - e.until)), s.stations[e.station].name,
                   called(e), fmt::format("{}", e.bytes), every});
    }
    return table.text();
}

char mark_of(const plan::Entry& e) {
    switch (e.what) {
    case plan::Entry::What::sync: return '|';
    case plan::Entry::What::backup_sync: return '\'';
    case plan::Entry::What::slot: break;
    }
    return strip_letter(e.station);
}

/// Draws a column per hundredth of the cycle.
std::string timeline_text(const config::Schedule& s, const plan::Plan& p) {
    constexpr std::size_t columns = 100;
    std::string line(columns, '.');
    const auto column = [&](Time t) {
        return std::min(static_cast<std::size_t>(t * static_cast<Time>(columns) / s.cycle),
                        columns - 1);
    };
    for (const plan::Entry& e : p.entries) {
        const std::size_t first = column(e.at);
        for (std::size_t i = first; i <= column(e.until - 1); ++i) {
            if (i == first || line[i] == '.') {
                line[i] = mark_of(e);
            }
        }
    }
    std::vector<std::string> names;
    for (const auto& station : s.stations) {
        names.push_back(station.name);
    }
    return fmt::format("{}\n{}\n", line, strip_key(names, std::vector<bool>(names.size(), true)));
}

std::string trip_text(const config::Schedule& s, const plan::RoundTrip& t,
                      const std::string& by_way_of) {
    const auto& e = s.stations[t.station];
    return fmt::format(
        "{}: worst-case latency from input to output {:.2f} us, {} after the input is "
        "read\n"
        "  read {:.2f}, sent {:.2f} (slot {}), received {:.2f}; {}'s thread {:.2f}, sent {:.2f}, "
        "received {:.2f}; written {:.2f}\n"
        "  {:.2f} - {:.2f} + {:.2f} for an input that changed just after it was read = {:.2f} us\n",
        e.name, us(t.worst), counted(t.cycles, "cycle"), us(t.read), us(t.up),
        e.slots.front().setup.id, us(t.up_arrives), by_way_of, us(t.master), us(t.down),
        us(t.down_arrives), us(t.output), us(t.output), us(t.read), us(s.cycle), us(t.worst));
}

std::string text_of(const config::Schedule& s, const plan::Plan& p) {
    const auto slots = static_cast<std::size_t>(
        std::count_if(p.entries.begin(), p.entries.end(),
                      [](const auto& e) { return e.what == plan::Entry::What::slot; }));
    std::string text =
        fmt::format("cycle {:g} us at {} Mbit/s, guard {:g} us: {}, {}\n\n", us(s.cycle), s.speed,
                    us(s.guard), counted(s.stations.size(), "station"), counted(slots, "slot"));
    text += table_text(s, p) + "\n" + timeline_text(s, p) + "\n";
    text += fmt::format(
        "load {:.1f} % with frames of full length; a frame of 60 bytes takes {:.2f} us on a line, "
        "{:.2f} us from station to "
        "station\n",
        100 * p.load, us(s.wire(60)), us(s.path(60)));
    for (const auto& e : s.stations) {
        if (e.role == tdma::Role::backup) {
            text += fmt::format(
                "{} checks {:g} us after the start of the cycle and takes over {:g} us after a "
                "missing sync\n",
                e.name, us(e.phase), us(e.backup_offset));
        }
    }
    text += fmt::format("outputs are set to safe values {} after the last sync: {:g} us\n",
                        counted(s.lost, "cycle"), us(s.cycle * s.lost));
    for (const plan::RoundTrip& t : p.trips) {
        text += trip_text(s, t, s.stations[*p.by_way_of].name);
    }
    return text;
}

std::string json_text(const config::Schedule& s, const plan::Plan& p) {
    std::string text =
        fmt::format(R"({{"cycle_ns":{},"speed":{},"guard_ns":{},"load":{:.6f},"entries":[)",
                    s.cycle, s.speed, s.guard, p.load);
    for (std::size_t i = 0; i < p.entries.size(); ++i) {
        const plan::Entry& e = p.entries[i];
        text += fmt::format(
            R"({}{{"station":"{}","use":"{}","slot":{},"from_ns":{},"until_ns":{},"bytes":{},"period":{},"phasing":{}}})",
            i == 0 ? "\n " : ",\n ", s.stations[e.station].name, word(e.what),
            e.what == plan::Entry::What::slot ? fmt::format("{}", e.id) : "null", e.at, e.until,
            e.bytes, e.period, e.phasing + 1);
    }
    text += "],\"latency\":[";
    for (std::size_t i = 0; i < p.trips.size(); ++i) {
        text += fmt::format(R"({}{{"station":"{}","worst_ns":{},"cycles":{}}})",
                            i == 0 ? "\n " : ",\n ", s.stations[p.trips[i].station].name,
                            p.trips[i].worst, p.trips[i].cycles);
    }
    return text + "]}\n";
}

}  // namespace

int run_tdma_plan(const TdmaPlanOptions& options) {
    const std::string& file = options.words[0];
    std::string text;
    if (!config::read_from_disk(file, text)) {
        return fail(options, fmt::format("cannot read '{}': {}", file, text));
    }
    const config::ReadResult reading = config::read(text);
    const auto code = [](const config::Message& m) {
        return Code::named(config::code_of(m.topic)).value_or(Code("tdma-line"));
    };
    if (!print_findings(file, text, reading.messages, code)) return 1;
    const plan::Plan p = plan::plan_of(reading.schedule);
    if (!options.svg.empty()) {
        return write_picture(options, options.svg, options.json, timeline_of(reading.schedule, p));
    }
    const bool is_printed =
        print(options.json ? json_text(reading.schedule, p) : text_of(reading.schedule, p));
    return is_printed ? 0 : 1;
}

}  // namespace hal::tools
