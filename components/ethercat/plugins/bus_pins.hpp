// SPDX-License-Identifier: MIT
// The state of the bus and of its slaves as pins.
#pragma once

#include <array>
#include <cstdint>
#include <string>

#include "ethercat/config/state_pins.hpp"
#include "ethercat/master/status.hpp"
#include "ethercat/plugins/emergencies.hpp"
#include "hal/component.hpp"

namespace hal::ethercat {

/// Pins of the bus.
struct BusPins {
    BusPins(Component& c, const Function& f)
        : state(c, f, "state",
                "lowest state of the configured slaves: 1 INIT, 2 PRE-OP, 3 BOOT, 4 SAFE-OP, 8 OP, "
                "0 none",
                {.safe = 0U}),
          link_up(c, f, "link-up", "the port has a link"),
          all_op(c, f, "all-op",
                 "every slave that is not optional is in OP, or in the lower `state` of its "
                 "configuration",
                 {.safe = false}),
          responding(c, f, "slaves-responding", "slaves that answered the newest broadcast"),
          expected(c, f, "slaves-expected", "slaves of the configuration that are not optional"),
          wkc(c, f, "wkc", "working counter of all process data, newest cycle"),
          wkc_expected(c, f, "wkc-expected",
                       "its value when all slaves that are started exchange process data"),
          wkc_state(c, f, "wkc-state", "0 none, 1 part, 2 complete", {.safe = 0U}),
          incomplete(c, f, "cycles-incomplete",
                     "cycles in which a slave that is started did not exchange its process data"),
          sent(c, f, "frames-sent", "frames sent"),
          lost(c, f, "frames-lost", "frames that did not return in time"),
          foreign(c, f, "frames-foreign", "EtherCAT frames of other programs, or damaged ones"),
          dc_synchronised(c, f, "dc-synchronised", "every slave with a clock is within the window",
                          {.safe = false}),
          dc_deviation(c, f, "dc-sync-diff",
                       "largest deviation of the slaves' clocks; 4294967295: no data",
                       {.unit = "ns"}),
          phase(c, f, "pll-err", "how late the cycle begins on the grid of the reference clock",
                {.unit = "ns"}),
          ring_broken(
              c, f, "ring-broken",
              "with a backup port: the ring is broken; the slaves are reached from both ends") {}

    /// [realtime]
    void show(const master::BusStatus& s, std::uint64_t cycles_incomplete) noexcept {
        incomplete = cycles_incomplete;
        state = static_cast<std::uint32_t>(s.state);
        link_up = s.link;
        all_op = s.operational;
        responding = s.responding;
        expected = s.expected;
        wkc = s.wkc;
        wkc_expected = s.wkc_expected;

        wkc_state = static_cast<std::uint32_t>(s.wkc_state);
        sent = s.frames_sent;
        lost = s.lost;
        foreign = s.foreign;
        dc_synchronised = s.dc_synchronised;
        dc_deviation = s.dc_deviation_ns;
        ring_broken = s.ring_broken;
    }

    Out<std::uint32_t> state;
    Out<bool> link_up, all_op;
    Out<std::uint32_t> responding, expected, wkc, wkc_expected, wkc_state;
    Out<std::uint64_t> incomplete, sent, lost, foreign;
    Out<bool> dc_synchronised;
    Out<std::uint32_t> dc_deviation;
    Out<std::int32_t> phase;
    Out<bool> ring_broken;
};

/// Pins of one slave.
struct SlavePins {
    /// `slave`: name of the slave.
    SlavePins(Component& c, const Function& f, const std::string& slave)
        : online(c, f, pin_name(slave, state_pin::online).c_str(), "the slave answers",
                 {.safe = false}),
          operational(c, f, pin_name(slave, state_pin::operational).c_str(),
                      "the slave is in OP and exchanges process data", {.safe = false}),
          state(c, f, pin_name(slave, state_pin::state).c_str(),
                "1 INIT, 2 PRE-OP, 3 BOOT, 4 SAFE-OP, 8 OP, 0 unknown", {.safe = 0U}),
          al_code(c, f, pin_name(slave, state_pin::al_status_code).c_str(),
                  "AL status code of the slave (0134h), 0 again when it is started anew; the log "
                  "keeps each"),
          dc_deviation(c, f, pin_name(slave, state_pin::dc_deviation).c_str(),
                       "deviation of its clock; 4294967295: no data", {.unit = "ns"}),
          losses(c, f, pin_name(slave, state_pin::losses).c_str(), "how often the slave was lost"),
          crc_errors(c, f, pin_name(slave, state_pin::crc_errors).c_str(),
                     "damaged frames that it received, all ports"),
          crc_errors_at{
              {{c, f, pin_name(slave, state_pin::crc_errors, ".0").c_str(),
                "at port 0, from the master's side"},
               {c, f, pin_name(slave, state_pin::crc_errors, ".1").c_str(), "at port 1"},
               {c, f, pin_name(slave, state_pin::crc_errors, ".2").c_str(), "at port 2"},
               {c, f, pin_name(slave, state_pin::crc_errors, ".3").c_str(), "at port 3"}}},
          lost_links(c, f, pin_name(slave, state_pin::lost_links).c_str(), "lost links, all ports"),
          emcy(c, f, pin_name(slave, state_pin::emergency).c_str(),
               "code of its newest emergency; 0: none, or the error is gone"),
          emcy_count(c, f, pin_name(slave, state_pin::emergency_count).c_str(),
                     "emergencies received") {}

    /// Returns the name of a pin of a slave. [setup]
    static std::string pin_name(const std::string& slave, const char* pin,
                                const char* suffix = "") {
        return slave + "." + pin + suffix;
    }

    /// [realtime]
    void show(const master::SlaveStatus& s, const Emergencies::Heard& heard) noexcept {
        emcy = heard.code;
        emcy_count = heard.count;
        online = s.online;
        operational = s.operational;
        state = static_cast<std::uint32_t>(s.state);
        al_code = s.al_code;
        dc_deviation = s.dc_deviation_ns;
        losses = s.losses;
        std::uint64_t errors = 0;
        std::uint64_t links = 0;
        for (std::size_t n = 0; n < s.ports.size(); ++n) {
            const std::uint64_t damaged = s.ports[n].invalid_frames + s.ports[n].rx_errors;
            crc_errors_at[n] = damaged;
            errors += damaged;
            links += s.ports[n].lost_links;
        }
        crc_errors = errors;
        lost_links = links;
    }

    Out<bool> online, operational;
    Out<std::uint32_t> state, al_code, dc_deviation, losses;
    Out<std::uint64_t> crc_errors;
    std::array<Out<std::uint64_t>, 4> crc_errors_at;
    Out<std::uint64_t> lost_links;
    Out<std::uint32_t> emcy, emcy_count;
};

}  // namespace hal::ethercat
