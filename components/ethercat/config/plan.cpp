// SPDX-License-Identifier: MIT
#include "ethercat/config/plan.hpp"

#include <algorithm>
#include <cstdio>
#include <numeric>

#include "ethercat/master/process_image.hpp"
#include "ethercat/wire/frames.hpp"
#include "text/quoting.hpp"

namespace hal::ethercat::config {

namespace {

using master::ProcessImage;

constexpr std::int64_t ns_per_byte = 80;         // 100 Mbit/s
constexpr std::size_t wire_overhead_bytes = 24;  // preamble 8, check sequence 4, gap 12
constexpr std::size_t clock_bytes = 8;
constexpr unsigned max_period = 1000;

std::string micro(std::int64_t ns) {
    char out[32];
    std::snprintf(out, sizeof out, "%.2f us", static_cast<double>(ns) / 1000);
    return out;
}

constexpr std::int64_t wire_time(std::size_t bytes, std::size_t frames) {
    return static_cast<std::int64_t>(bytes + frames * wire_overhead_bytes) * ns_per_byte;
}

bool synchronised(const master::Slave& s) { return s.dc && (s.dc->assign_activate & 0x100) != 0; }

/// Returns the frames that the master makes of the setup, once all slaves exchange data.
std::vector<PlannedFrame> frames_of(const master::Setup& setup) {
    ProcessImage image(setup, {});
    for (std::size_t n = 0; n < setup.slaves.size(); ++n) {
        bool writes = false;
        bool reads = false;
        for (const auto& area : image.slave(n).areas) {
            (area.output ? writes : reads) |= area.bytes != 0;
        }
        image.set_counting(n, writes, reads, false);
    }
    const bool clocks = std::any_of(setup.slaves.begin(), setup.slaves.end(),
                                    [](const auto& s) { return s.dc.has_value(); });
    std::vector<PlannedFrame> out;
    for (const ProcessImage::Frame& frame : image.frames()) {
        PlannedFrame f;
        f.every = frame.every;
        f.bytes = frame.size;
        f.wire_ns = wire_time(frame.size, 1);
        if (frame.clock_write != 0) {
            f.datagrams.push_back({clocks ? "FPWR" : "NOP", "", clock_bytes, 0, 0, 0, 0});
        }
        f.datagrams.push_back({clocks ? "FRMW" : "NOP", "", clock_bytes, 0, 0, 0, 0});
        for (unsigned n = frame.first; n < frame.last; ++n) {
            const ProcessImage::Datagram& d = image.datagrams()[n];
            PlannedDatagram p;
            if (d.out_to == 0) {
                p.command = "LRD";
            } else if (d.in_to > d.in_from) {
                p.command = "LRW";
            } else {
                p.command = "LWR";
            }
            p.domain = setup.domains.empty() ? "default" : setup.domains[d.domain].name;
            p.data_bytes = d.length;
            p.output_bytes = d.out_to;
            p.expected_wkc = d.expected;
            for (std::uint16_t i = d.first_slave; i < d.last_slave; ++i) {
                const std::int64_t at = image.slave(image.order()[i]).mailbox_status_at;
                p.mailbox_states += at >= d.address + d.in_from && at < d.address + d.in_to ? 1 : 0;
            }
            p.input_bytes =
                static_cast<std::size_t>(std::max(d.in_to - d.in_from, 0)) - p.mailbox_states;
            f.datagrams.push_back(std::move(p));
        }
        out.push_back(std::move(f));
    }
    return out;
}

void add_slots(Plan& plan, std::int64_t acyclic_ns) {
    for (const PlannedFrame& f : plan.cyclic) {
        plan.period = std::min(std::lcm(plan.period, f.every), max_period);
    }
    for (unsigned cycle = 0; cycle < plan.period; ++cycle) {
        PlannedSlot slot{{cycle}, {}, acyclic_ns};
        for (std::size_t n = 0; n < plan.cyclic.size(); ++n) {
            if (cycle % plan.cyclic[n].every == 0) {
                slot.frames.push_back(n);
                slot.wire_ns += plan.cyclic[n].wire_ns;
            }
        }
        const auto same = std::find_if(plan.slots.begin(), plan.slots.end(),
                                       [&](const auto& s) { return s.frames == slot.frames; });
        if (same != plan.slots.end()) {
            same->cycles.push_back(cycle);
        } else {
            plan.slots.push_back(std::move(slot));
        }
    }
}

/// Returns how many cycles an answer waits at most for a cycle in which its domain is sent. It is
/// computed in the cycle after the inputs were sent, which is one of every `from`.
unsigned max_wait(unsigned from, unsigned to) {
    unsigned max = 0;
    for (unsigned sent = 0; sent < std::lcm(from, to); sent += from) {
        max = std::max(max, (to - (sent + 1) % to) % to);
    }
    return max;
}

/// An input that changes just after it was taken is sent `from` cycles later, arrives in the next
/// cycle, and the answer leaves with the next frame of its domain. A slave with SYNC0 takes its
/// inputs up to a cycle before the frame, and its outputs act up to a cycle after it, both on one
/// grid: one more cycle, and nothing else.
void add_trips(Plan& plan, const master::Setup& setup, const PlanOptions& options) {
    struct Side {
        bool inputs = false;
        bool outputs = false;
        bool synchronised = false;
    };
    std::vector<Side> sides(setup.domains.size());
    for (const master::Slave& s : setup.slaves) {
        for (const auto& sm : s.sync_managers) {
            Side& side = sides[s.domain];
            (sm.output ? side.outputs : side.inputs) = true;
            side.synchronised = side.synchronised || synchronised(s);
        }
    }
    for (std::size_t from = 0; from < sides.size(); ++from) {
        for (std::size_t to = 0; to < sides.size(); ++to) {
            if (!sides[from].inputs || !sides[to].outputs) continue;
            PlannedTrip trip{setup.domains[from].name, setup.domains[to].name, 0,
                             sides[from].synchronised || sides[to].synchronised, 0};
            const unsigned every = std::max(setup.domains[from].every, 1U);
            trip.cycles = every + 1 + max_wait(every, std::max(setup.domains[to].every, 1U)) +
                          (trip.synchronised ? 1 : 0);
            trip.worst_ns = trip.cycles * setup.cycle_ns + options.drive_ns +
                            (trip.synchronised ? 0 : plan.shortest_cycle_ns);
            plan.input_to_output_ns = std::max(plan.input_to_output_ns, trip.worst_ns);
            plan.trips.push_back(std::move(trip));
        }
    }
}

std::string often(unsigned every) {
    return every == 1 ? "every cycle" : "every " + std::to_string(every) + " cycles";
}

std::string datagram_line(const PlannedDatagram& d) {
    const std::size_t all = datagram_header_bytes + d.data_bytes + wkc_bytes;
    char size[64];
    std::snprintf(size, sizeof size, "  %-4s  %zu + %zu + %zu = %zu bytes: ", d.command.c_str(),
                  datagram_header_bytes, d.data_bytes, wkc_bytes, all);
    if (d.domain.empty()) {
        return size + std::string(d.command == "NOP" ? "no slave has a clock\n"
                                                     : "time of the reference clock\n");
    }
    std::string text = size + ("domain " + d.domain);
    if (d.output_bytes != 0) {
        text += ", " + std::to_string(d.output_bytes) + " out";
    }
    if (d.input_bytes != 0) {
        text += ", " + std::to_string(d.input_bytes) + " in";
    }
    if (d.mailbox_states != 0) {
        text += ", " + counted(d.mailbox_states, "mailbox state");
    }
    return text + ", working counter " + std::to_string(d.expected_wkc) + "\n";
}

/// Returns "0, 4, 8", or "1 to 3" for a row.
std::string cycle_words(const std::vector<unsigned>& cycles) {
    std::string text;
    for (std::size_t i = 0; i < cycles.size(); ++i) {
        std::size_t last = i;
        while (last + 1 < cycles.size() && cycles[last + 1] == cycles[last] + 1) {
            ++last;
        }
        text += (text.empty() ? "" : ", ") + std::to_string(cycles[i]);
        if (last > i) {
            text += (last == i + 1 ? ", " : " to ") + std::to_string(cycles[last]);
        }
        i = last;
    }
    return text;
}

void describe(Plan& p, const Bus& bus, const PlanOptions& options) {
    for (std::size_t n = 0; n < p.cyclic.size(); ++n) {
        const PlannedFrame& f = p.cyclic[n];
        p.text += "frame " + std::to_string(n + 1) + ", " + often(f.every) + ": " +
                  std::to_string(f.bytes) + " bytes\n";
        for (const PlannedDatagram& d : f.datagrams) {
            p.text += datagram_line(d);
        }
    }
    p.text += "states and mailboxes, counted in every cycle: " +
              std::to_string(options.acyclic_frame_bytes) +
              " bytes, more where the cycle has time\n";
    for (const PlannedSlot& s : p.slots) {
        if (p.period == 1) break;
        std::string list;
        for (const std::size_t f : s.frames) {
            list += (list.empty() ? "frame " : ", frame ") + std::to_string(f + 1);
        }
        p.text += std::string(s.cycles.size() == 1 ? "cycle " : "cycles ") + cycle_words(s.cycles) +
                  " of " + std::to_string(p.period) + ": " + (list.empty() ? "" : list + ", ") +
                  "states and mailboxes, " + micro(s.wire_ns) + "\n";
    }
    p.text += std::string(p.period == 1 ? "" : "longest cycle: ") + counted(p.frames, "frame") +
              ", " + std::to_string(p.frame_bytes) + " bytes: (" + std::to_string(p.frame_bytes) +
              " + " + std::to_string(p.frames) + " x 24) x 80 ns = " + micro(p.wire_ns) +
              " at 100 Mbit/s\n";
    p.text += "through " + counted(bus.setup.slaves.size(), "slave") + " x " +
              micro(options.slave_delay_ns) + " = " + micro(p.propagation_ns) + "\n";
    char load[32];
    std::snprintf(load, sizeof load, "%.1f %%", p.load * 100);
    p.text += "cycle " + micro(p.cycle_ns) + ": wire load " + load + ", needed " +
              micro(options.master_ns) + " + " + micro(p.wire_ns) + " + " +
              micro(p.propagation_ns) + " = " + micro(p.shortest_cycle_ns) +
              (p.fits ? "\n" : ": too long for the cycle\n");
    for (const PlannedTrip& t : p.trips) {
        p.text += "input to output" +
                  (p.trips.size() == 1 ? " " : ", " + t.from + " to " + t.to + ", ") + "at most " +
                  std::to_string(t.cycles) + " x " + micro(p.cycle_ns) +
                  (t.synchronised ? "" : " + " + micro(p.shortest_cycle_ns)) +
                  (options.drive_ns != 0 ? " + " + micro(options.drive_ns) : "") + " = " +
                  micro(t.worst_ns) + (t.synchronised ? ", at SYNC0" : "") + "\n";
    }
}

}  // namespace

Plan plan(const Bus& bus, const PlanOptions& options) {
    Plan out;
    const master::Setup& setup = bus.setup;
    out.cyclic = frames_of(setup);
    out.cycle_ns = setup.cycle_ns;
    add_slots(out, wire_time(options.acyclic_frame_bytes, 1));
    const auto max =
        std::max_element(out.slots.begin(), out.slots.end(),
                         [](const auto& a, const auto& b) { return a.wire_ns < b.wire_ns; });
    out.frames = max->frames.size() + 1;
    out.frame_bytes = options.acyclic_frame_bytes;

    out.wire_ns = max->wire_ns;
    for (const std::size_t f : max->frames) {
        out.frame_bytes += out.cyclic[f].bytes;
    }
    out.propagation_ns = static_cast<std::int64_t>(setup.slaves.size()) * options.slave_delay_ns;
    out.load = static_cast<double>(out.wire_ns) /
               static_cast<double>(std::max<std::int64_t>(setup.cycle_ns, 1));
    out.shortest_cycle_ns = options.master_ns + out.wire_ns + out.propagation_ns;
    out.fits = out.shortest_cycle_ns <= setup.cycle_ns;
    add_trips(out, setup, options);
    describe(out, bus, options);
    return out;
}

}  // namespace hal::ethercat::config
