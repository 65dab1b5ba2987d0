// SPDX-License-Identifier: MIT
// The pins that show a station.
#pragma once

#include "fieldbus/scocan/station/station.hpp"
#include "hal/component.hpp"

namespace hal::scocan {

struct StationPins {
    StationPins(hal::Component& component, const hal::Function& function)
        : c(component), f(function) {}

    hal::Component& c;
    const hal::Function& f;
    hal::In<bool> reset{c, f, "reset",
                        "rising edge: a silenced node sends again; acknowledges fault"};
    hal::Out<std::int32_t> state{
        c,
        f,
        "state",
        "0 listening, 1 running, 2 silent, 3 listen-only, 4 silenced, 5 down",
        {.safe = 0}};
    hal::Out<bool> running{c, f, "running", "the node sends in its slots", {.safe = false}};
    hal::Out<bool> fault{c, f, "fault", "fault, see show fault; cleared by recovery or by reset"};
    hal::Out<std::uint32_t> mode{c, f, "mode", "mode of the table in use"};
    hal::Out<std::uint32_t> cycle{c, f, "cycle",
                                  "counter of the cycle, modulo 64, equal in all nodes"};
    hal::Out<double> error{
        c, f, "error", "arrival of the last SYNC against its prediction", {.unit = "us"}};
    hal::Out<double> drift{
        c, f, "drift", "rate of this node's clock against that of the SYNC node", {.unit = "ppm"}};
    hal::Out<std::uint64_t> syncs{c, f, "syncs", "SYNCs received or sent"};
    hal::Out<std::uint64_t> syncs_lost{c, f, "syncs-lost", "cycles without a SYNC"};
    hal::Out<std::uint64_t> syncs_ignored{
        c, f, "syncs-ignored",
        "SYNCs ignored: late, doubled, invalid, or at a rate more than 1000 ppm off"};
    hal::Out<std::uint64_t> sent_private{c, f, "sent-private", "frames sent in private slots"};
    hal::Out<std::uint64_t> sent_shared{c, f, "sent-shared", "frames sent in shared slots"};
    hal::Out<std::uint64_t> sent_recycled{c, f, "sent-recycled",
                                          "frames sent in idle private slots"};
    hal::Out<std::uint64_t> missed{c, f, "missed",
                                   "private slots in which a frame could not be sent"};
    hal::Out<std::uint64_t> foreign{c, f, "foreign",
                                    "frames of other nodes outside of their slots"};
    hal::Out<std::uint64_t> late{c, f, "late", "own frames outside of their slots"};
    hal::Out<std::uint64_t> dropped{
        c, f, "dropped",
        "frames not sent: the node does not run, queue full, or identifier reserved or of another "
        "node"};
    hal::Out<std::uint32_t> waiting{c, f, "waiting", "frames waiting for a slot"};

    /// Shows the state of the station. [realtime]
    void show(const Station& s) noexcept {
        const Count& n = s.count();
        state = static_cast<std::int32_t>(s.state());
        running = s.state() == State::running;
        mode = s.mode();
        cycle = s.counter();
        error = s.clock().error() * 1e-3;
        drift = s.clock().known() ? s.clock().ppm() : 0.0;
        syncs = n.syncs;
        syncs_lost = n.syncs_lost;
        syncs_ignored = n.syncs_ignored;
        sent_private = n.sent_private;
        sent_shared = n.sent_shared;
        sent_recycled = n.sent_recycled;
        missed = n.missed;
        foreign = n.foreign;
        late = n.late;
        dropped = n.dropped;
        waiting = static_cast<std::uint32_t>(s.waiting());
    }
};

}  // namespace hal::scocan
