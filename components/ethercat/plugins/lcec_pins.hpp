// SPDX-License-Identifier: MIT
// The state of the bus and of its slaves as pins with the names of LinuxCNC's lcec.
#pragma once

#include <cstdint>
#include <string>

#include "ethercat/master/status.hpp"
#include "ethercat/plugins/emergencies.hpp"
#include "hal/component.hpp"

namespace hal::ethercat {

/// Pins of the bus: lcec.MASTER.NAME.
struct LcecBusPins {
    LcecBusPins(Component& c, const Function& f)
        : responding(c, f, "slaves-responding", "slaves that answered the newest broadcast"),
          init(c, f, "state-init", "the lowest state of the configured slaves is INIT"),
          preop(c, f, "state-preop", "it is PRE-OP"),
          safeop(c, f, "state-safeop", "it is SAFE-OP"),
          op(c, f, "state-op", "it is OP", {.safe = false}),
          link_up(c, f, "link-up", "the port has a link"),
          all_op(c, f, "all-op",
                 "every slave that is not optional is in OP and exchanges process data",
                 {.safe = false}),
          wkc(c, f, "wkc", "working counter of all process data, newest cycle"),
          wkc_state(c, f, "wkc-state", "0 none, 1 part, 2 complete", {.safe = 0}),
          dc_deviation(c, f, "dc-sync-diff",
                       "largest deviation of the slaves' clocks; 4294967295: no data",
                       {.unit = "ns"}),
          dc_synchronised(c, f, "dc-sync-converged",
                          "every slave with a clock is within the window", {.safe = false}),
          phase(c, f, "pll-err", "how late the cycle begins on the grid of the reference clock",
                {.unit = "ns"}) {}

    /// [realtime]
    void show(const master::BusStatus& s, std::uint64_t) noexcept {
        responding = s.responding;
        init = s.state == State::init;
        preop = s.state == State::preop;

        safeop = s.state == State::safeop;
        op = s.state == State::op;
        link_up = s.link;
        all_op = s.operational;
        wkc = s.wkc;
        wkc_state = static_cast<std::int32_t>(s.wkc_state);
        dc_deviation = s.dc_deviation_ns;
        dc_synchronised = s.dc_synchronised;
    }

    Out<std::uint32_t> responding;
    Out<bool> init, preop, safeop, op, link_up, all_op;
    Out<std::uint32_t> wkc;
    Out<std::int32_t> wkc_state;
    Out<std::uint32_t> dc_deviation;
    Out<bool> dc_synchronised;
    Out<std::int32_t> phase;
};

/// Pins of one slave: lcec.MASTER.SLAVE.NAME.
struct LcecSlavePins {
    LcecSlavePins(Component& c, const Function& f, const std::string& name)
        : online(c, f, (name + ".slave-online").c_str(), "the slave answers", {.safe = false}),
          operational(c, f, (name + ".slave-oper").c_str(),
                      "the slave is in OP and exchanges process data", {.safe = false}),
          init(c, f, (name + ".slave-state-init").c_str(), "the slave is in INIT"),
          preop(c, f, (name + ".slave-state-preop").c_str(), "the slave is in PRE-OP"),
          safeop(c, f, (name + ".slave-state-safeop").c_str(), "the slave is in SAFE-OP"),
          op(c, f, (name + ".slave-state-op").c_str(), "the slave is in OP", {.safe = false}) {}

    /// [realtime]
    void show(const master::SlaveStatus& s, const Emergencies::Heard&) noexcept {
        online = s.online;
        operational = s.operational;
        init = s.state == State::init;
        preop = s.state == State::preop;

        safeop = s.state == State::safeop;
        op = s.state == State::op;
    }

    Out<bool> online, operational, init, preop, safeop, op;
};

}  // namespace hal::ethercat
