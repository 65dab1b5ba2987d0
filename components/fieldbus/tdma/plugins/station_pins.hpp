// SPDX-License-Identifier: MIT
// The pins of the component tdma that show its own station.
#pragma once

#include "fieldbus/tdma/station/station.hpp"
#include "fieldbus/tdma/tunnel/tunnel.hpp"
#include "hal/component.hpp"

namespace hal::tdma {

struct StationPins {
    StationPins(hal::Component& component, const hal::Function& function)
        : c(component), f(function) {}

    hal::Component& c;
    const hal::Function& f;
    hal::In<bool> reset{c, f, "reset",
                        "rising edge: a master that stepped down starts again; acknowledges fault"};
    hal::Out<std::int32_t> state{
        c,
        f,
        "state",
        "0 listening, 1 synchronising, 2 calibrating, 3 running, 4 withdrawn, 5 unconfigured",
        {.safe = 0}};
    hal::Out<bool> synchronous{
        c,
        f,
        "synchronous",
        "a sync was received within the last few cycles (lost in the schedule)",
        {.safe = false}};
    hal::Out<bool> calibrated{
        c, f, "calibrated", "path delay to the master calibrated", {.safe = false}};
    hal::Out<bool> running{c, f, "running", "the station may send in its slots", {.safe = false}};
    hal::Out<bool> leading{c, f, "leading", "this station sends the syncs", {.safe = false}};
    hal::Out<bool> master_active{c, f, "master-active", "a master sends syncs", {.safe = false}};
    hal::Out<bool> configured{
        c, f, "configured", "the station has a schedule: its own, or one from the master (RTcfg)"};
    hal::Out<std::uint32_t> stations{
        c, f, "stations", "on the master: stations online that got their schedule from it"};
    hal::Out<std::uint32_t> stations_dead{
        c, f, "stations-dead", "on the master: stations offline that got their schedule from it"};
    hal::Out<std::uint32_t> stage_2_bytes{
        c, f, "stage2-bytes", "size of the file received from the master, once it is written"};
    hal::Out<bool> link_up{c, f, "link-up", "the port has a carrier"};
    hal::Out<bool> fault{c, f, "fault", "fault, see show fault; cleared by recovery or by reset"};
    hal::Out<std::uint32_t> cycle_number{c, f, "cycle",
                                         "number of this cycle, equal in all stations"};
    hal::Out<std::int64_t> global_time{
        c,
        f,
        "global-time",
        "global time at the beginning of this cycle, equal in all stations",
        {.unit = "ns"}};
    hal::Out<std::int64_t> offset{
        c, f, "offset", "global time minus this machine's clock", {.unit = "ns"}};
    hal::Out<double> drift{
        c, f, "drift", "rate of the master's clock relative to this machine's", {.unit = "ppm"}};
    hal::Out<double> delay{c, f, "delay", "path delay to the master, one way", {.unit = "us"}};
    hal::Out<double> jitter{c, f, "jitter", "jitter of received syncs, rms", {.unit = "us"}};
    hal::Out<double> error{
        c, f, "error", "phase error: how much later this cycle should have begun", {.unit = "us"}};
    hal::Out<std::uint64_t> syncs{c, f, "syncs", "syncs sent or received"};
    hal::Out<std::uint64_t> syncs_lost{c, f, "syncs-lost", "cycles without a sync"};
    hal::Out<std::uint64_t> sent{c, f, "frames-sent", "frames sent in slots"};
    hal::Out<std::uint64_t> dropped{c, f, "frames-dropped",
                                    "frames dropped: longer than their slot, no link, or queued or "
                                    "passed to the station while it may not send"};
    hal::Out<std::uint64_t> late{c, f, "frames-late",
                                 "frames not sent because their slot had passed"};
    hal::Out<std::uint64_t> foreign{
        c, f, "frames-foreign",
        "frames ignored: truncated, of another version, or syncs of another schedule"};
    hal::Out<std::uint64_t> intruders{c, f, "frames-intruding",
                                      "frames of other stations in slots of this one"};
    hal::Out<std::uint64_t> losses{c, f, "losses", "number of sync losses"};
    hal::Out<bool> tunnel_open{c, f, "tunnel-open", "the tunnel carries packets", {.safe = false}};
    hal::Out<std::uint64_t> tunnel_sent{c, f, "tunnel-sent", "ordinary packets handed to slot 1"};
    hal::Out<std::uint64_t> tunnel_received{c, f, "tunnel-received",
                                            "ordinary packets received for this station"};
    hal::Out<std::uint64_t> tunnel_dropped{
        c, f, "tunnel-dropped",
        "ordinary packets dropped in either direction: queue full, or no sync"};
    hal::Out<std::uint64_t> tunnel_rejected{c, f, "tunnel-rejected",
                                            "tunnelled frames rejected: for other stations, "
                                            "truncated, or of the segment's own Ethertypes"};

    /// Shows the state of the station. [realtime]
    void show(const Station& station, const ethernet::Statistics& port,
              const Tunnel* tunnel) noexcept {
        const Status& s = station.status();
        state = static_cast<std::int32_t>(s.state);
        synchronous = s.synchronous;
        calibrated = s.calibrated;
        running = station.ready();
        leading = s.leading;
        master_active = s.master_active;
        configured = station.setup().configured;
        link_up = port.up;
        cycle_number = s.cycle;
        global_time = s.global;
        offset = s.offset;
        drift = s.drift * 1e6;
        delay = static_cast<double>(s.delay) * 1e-3;
        jitter = s.jitter * 1e-3;
        error = static_cast<double>(s.error) * 1e-3;
        syncs = s.count.syncs + s.count.syncs_sent;
        syncs_lost = s.count.syncs_lost;
        sent = s.count.sent;
        dropped = station.dropped(port);
        late = port.late;
        intruders = s.count.intruders;
        losses = s.count.losses;
        if (tunnel == nullptr) return;
        tunnel_open = tunnel->open();
        tunnel_sent = tunnel->sent();
        tunnel_received = tunnel->received();
        tunnel_dropped = tunnel->dropped();
        tunnel_rejected = tunnel->rejected();
    }
};

}  // namespace hal::tdma
