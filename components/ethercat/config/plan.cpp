// SPDX-License-Identifier: MIT
#include "ethercat/config/plan.hpp"

#include <algorithm>
#include <cstdio>

#include "ethercat/wire/frames.hpp"

namespace hal::ethercat::config {

namespace {

constexpr std::int64_t ns_per_byte = 80;         // 100 Mbit/s
constexpr std::size_t  wire_overhead_bytes = 24;  // preamble 8, check sequence 4, gap 12
constexpr std::size_t  shortest_frame_bytes = 60, most_datagram_bytes = 1500 - ecat_header_bytes;

/// Packs datagrams into frames as they come; a long one is split.
struct Packing {
    std::size_t  frames = 0, bytes = 0, used = 0;
    std::int64_t wire_ns = 0;
    void         add(std::size_t data) {
        do {
            const std::size_t part = std::min(data, largest_datagram_data);
            const std::size_t length = part + datagram_header_bytes + wkc_bytes;
            if (used + length > most_datagram_bytes) close();
            used += length, data -= part;
        } while (data != 0);
    }
    void close() {
        if (used == 0) return;
        const std::size_t frame = std::max(used + ecat_header_bytes + ethernet_header_bytes, shortest_frame_bytes);
        ++frames, bytes += frame, wire_ns += static_cast<std::int64_t>(frame + wire_overhead_bytes) * ns_per_byte;
        used = 0;
    }
};

std::string micro(std::int64_t ns) {
    char out[32];
    std::snprintf(out, sizeof out, "%.2f us", static_cast<double>(ns) / 1000);
    return out;
}

}  // namespace

Plan plan(const Bus& bus, const PlanOptions& options) {
    Plan                 out;
    Packing              packing;
    const master::Setup& setup = bus.setup;
    bool                 clocks = false;
    unsigned             slowest = 1;
    for (std::size_t d = 0; d < setup.domains.size(); ++d) {
        PlannedDatagram datagram{setup.domains[d].name, setup.domains[d].every, 0, 0, true, 0};
        unsigned        writers = 0, readers = 0;
        for (const master::Slave& s : setup.slaves) {
            clocks = clocks || s.dc;
            if (s.domain != d) continue;
            std::size_t outputs = 0, inputs = 0;
            for (const auto& sm : s.sync_managers) {
                std::size_t bits = 0;
                for (const auto& p : sm.pdos)
                    for (const auto& e : p.entries) bits += e.bits;
                (sm.output ? outputs : inputs) += (bits + 7) / 8;
            }
            datagram.output_bytes += outputs, datagram.input_bytes += inputs;
            writers += outputs != 0 ? 1 : 0, readers += inputs != 0 ? 1 : 0;
            datagram.lrw = datagram.lrw && s.use_lrw;
        }
        if (datagram.output_bytes + datagram.input_bytes == 0) continue;
        datagram.expected_wkc = datagram.lrw ? 2 * writers + readers : writers + readers;
        if (datagram.lrw) {
            packing.add(datagram.output_bytes + datagram.input_bytes);
        } else {
            if (datagram.output_bytes != 0) packing.add(datagram.output_bytes);
            if (datagram.input_bytes != 0) packing.add(datagram.input_bytes);
        }
        slowest = std::max(slowest, datagram.every);
        out.domains.push_back(std::move(datagram));
    }
    if (clocks) packing.add(8);  // FRMW of the system time
    packing.add(6);              // BRD of the states
    packing.close();
    out.frames = packing.frames, out.frame_bytes = packing.bytes, out.wire_ns = packing.wire_ns;
    out.propagation_ns = static_cast<std::int64_t>(setup.slaves.size()) * options.slave_delay_ns;
    out.cycle_ns = setup.cycle_ns;
    out.load = static_cast<double>(out.wire_ns) / static_cast<double>(std::max<std::int64_t>(setup.cycle_ns, 1));
    out.shortest_cycle_ns = options.master_ns + out.wire_ns + out.propagation_ns;
    out.fits = out.shortest_cycle_ns <= setup.cycle_ns;
    // An input that changes just after it was read waits a cycle of its domain; the answer leaves a cycle later and arrives with that frame.
    out.input_to_output_ns = static_cast<std::int64_t>(slowest) * setup.cycle_ns + setup.cycle_ns + out.wire_ns + out.propagation_ns +
                             options.master_ns + options.drive_ns;

    for (const auto& d : out.domains)
        out.text += "domain " + d.domain + ": " + std::to_string(d.output_bytes) + " bytes out, " + std::to_string(d.input_bytes) +
                    " bytes in, every " + (d.every == 1 ? std::string("cycle") : std::to_string(d.every) + " cycles") +
                    ", working counter " + std::to_string(d.expected_wkc) + "\n";
    out.text += std::to_string(out.frames) + (out.frames == 1 ? " frame, " : " frames, ") + std::to_string(out.frame_bytes) + " bytes: (" +
                std::to_string(out.frame_bytes) + " + " + std::to_string(out.frames) + " x 24) x 80 ns = " + micro(out.wire_ns) +
                " at 100 Mbit/s\n";
    out.text += "through " + std::to_string(setup.slaves.size()) + " slaves x " + micro(options.slave_delay_ns) + " = " +
                micro(out.propagation_ns) + "\n";
    char load[32];
    std::snprintf(load, sizeof load, "%.1f %%", out.load * 100);
    out.text += "cycle " + micro(out.cycle_ns) + ": wire load " + load + ", needed " + micro(options.master_ns) + " + " +
                micro(out.wire_ns) + " + " + micro(out.propagation_ns) + " = " + micro(out.shortest_cycle_ns) +
                (out.fits ? "\n" : ": too long for the cycle\n");
    out.text += "input to output at most " + std::to_string(slowest + 1) + " x " + micro(out.cycle_ns) + " + " +
                micro(out.shortest_cycle_ns) + (options.drive_ns != 0 ? " + " + micro(options.drive_ns) : "") + " = " +
                micro(out.input_to_output_ns) + "\n";
    return out;
}

}  // namespace hal::ethercat::config
