// SPDX-License-Identifier: MIT
// `hal tdma plan`: the schedule of an Ethernet segment as a timeline, with line load and worst-case latency from an input to an output;
// or as a picture.
#include "bus/tdma/plan.hpp"

#include <algorithm>
#include <fmt/core.h>
#include <unistd.h>

#include "bus/tdma/plan_picture.hpp"
#include "cli/output.hpp"
#include "fieldbus/tdma/config/schedule_plan.hpp"
#include "text/diagnostic.hpp"
#include "text/glyphs.hpp"
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
    std::string text = fmt::format("{:>9}  {:>9}  {:>9}  {:<16} {:<12} {:>6}  {}\n", "from us",
                                   "until", "free", "station", "use", "bytes", "cycles");
    for (std::size_t i = 0; i < p.entries.size(); ++i) {
        const plan::Entry& e = p.entries[i];
        Time next = s.cycle;
        for (std::size_t k = i + 1; k < p.entries.size(); ++k) {
            if (plan::meet(e, p.entries[k])) {
                next = p.entries[k].at;
                break;
            }
        }
        const std::string every =
            e.period == 1 ? "all" : fmt::format("{} of {}", e.phasing + 1, e.period);
        text += fmt::format("{:>9.2f}  {:>9.2f}  {:>9.2f}  {:<16} {:<12} {:>6}  {}\n", us(e.at),
                            us(e.until), us(next - e.until), s.stations[e.station].name, called(e),
                            e.bytes, every);
    }
    return text;
}

/// Draws a letter per station, a column per hundredth of the cycle; the sync is |, a backup's '.
std::string timeline_text(const config::Schedule& s, const plan::Plan& p) {
    constexpr std::size_t places = 100;
    constexpr std::string_view letters = "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ";
    std::string line(places, '.');
    for (const plan::Entry& e : p.entries) {
        const auto column = [&](Time t) {
            return std::min(static_cast<std::size_t>(t * static_cast<Time>(places) / s.cycle),
                            places - 1);
        };
        const char mark = e.what == plan::Entry::What::sync ? '|'
                          : e.what == plan::Entry::What::backup_sync
                              ? '\''
                              : letters[e.station % letters.size()];
        for (std::size_t i = column(e.at); i <= column(e.until - 1); ++i) {
            if (i == column(e.at) || line[i] == '.') {
                line[i] = mark;
            }
        }
    }
    std::string key;
    for (std::size_t i = 0; i < s.stations.size(); ++i) {
        key += fmt::format("{}{} {}", i == 0 ? "" : ", ", letters[i % letters.size()],
                           s.stations[i].name);
    }
    return fmt::format("{}\n{}\n", line, key);
}

std::string trip_text(const config::Schedule& s, const plan::RoundTrip& t,
                      const std::string& by_way_of) {
    const auto& e = s.stations[t.station];
    return fmt::format(
        "{}: worst-case latency from input to output {:.2f} us, {} cycle{} after the input is "
        "read\n"
        "  read {:.2f}, sent {:.2f} (slot {}), received {:.2f}; {}'s thread {:.2f}, sent {:.2f}, "
        "received {:.2f}; written {:.2f}\n"
        "  {:.2f} - {:.2f} + {:.2f} for an input that changed just after it was read = {:.2f} us\n",
        e.name, us(t.worst), t.cycles, t.cycles == 1 ? "" : "s", us(t.read), us(t.up),
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
    text += fmt::format("outputs are set to safe values {} cycle{} after the last sync: {:g} us\n",
                        s.lost, s.lost == 1 ? "" : "s", us(s.cycle * s.lost));
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
    if (options.words.size() != 1) {
        return fail(options, fmt::format("nothing is expected at '{}'; see: hal help tdma plan",
                                         options.words[1]));
    }
    const std::string& file = options.words[0];
    std::string text;
    if (!config::read_from_disk(file, text)) {
        return fail(options, fmt::format("cannot read '{}': {}", file, text));
    }
    const config::Reading reading = config::read(text);
    Sources sources;
    const std::uint32_t source = sources.add(file, text);
    Diagnostics found;
    for (const config::Message& m : reading.messages) {
        const Severity severities[] = {Severity::note, Severity::warning, Severity::error};
        Diagnostic d{severities[static_cast<std::size_t>(m.severity)],
                     Code::named(config::code_of(m.topic)).value_or(Code("tdma-line")), m.sentence};
        d.labels.push_back({Span{source, m.at.offset, m.at.offset + m.at.length}, m.label});
        if (!m.help.empty()) {
            d.help.push_back(m.help);
        }
        found.add(std::move(d));
    }
    write_all(STDERR_FILENO, render(found, sources, colours(STDERR_FILENO)));
    if (found.failed()) return 1;
    const plan::Plan p = plan::plan_of(reading.schedule);
    if (!options.svg.empty()) {
        if (options.json) return fail(options, "--json and --svg exclude each other");
        const std::string picture = picture_of(reading.schedule, p);
        if (options.svg == "-") return print(picture) ? 0 : 1;
        const std::string why = write_file(options.svg, picture);
        return why.empty() ? 0 : fail(options, why);
    }
    const std::string output =
        options.json ? json_text(reading.schedule, p) : text_of(reading.schedule, p);
    return print(output) ? 0 : 1;
}

}  // namespace hal::tools
