// SPDX-License-Identifier: MIT
// The state of the bus and of its slaves as pins with the names of LinuxCNC's lcec.
#pragma once

#include <algorithm>
#include <array>
#include <atomic>
#include <cstdint>
#include <memory>
#include <string>

#include "ethercat/master/status.hpp"
#include "ethercat/plugins/emergencies.hpp"
#include "hal/component.hpp"
#include "hal/naming.hpp"
#include "hal/pin_names.h"

namespace hal::ethercat {

/// Pins of lcec's phase-locked loop. They exist for netlists that use them: the threads follow the
/// reference clock by Halcyon's own discipline, which has no settings.
struct LcecPllPins {
    LcecPllPins(Component& c, const Function& f)
        : out(c, f, "pll-out", unused),
          resets(c, f, "pll-reset-count", unused),
          app_phase(c, f, "app-phase", unused),
          jitter(c, f, "phase-jitter", unused),
          drift_mode(c, f, "drift-mode", unused),
          drift(c, f, "pll-drift", unused),
          final_out(c, f, "pll-final", unused),
          step(c, f, "pll-step", unused),
          max_error(c, f, "pll-max-err", unused),
          sync_max(c, f, "dc-sync-max", unused),
          monitor(c, f, "dc-sync-monitor", unused, {.initial = true}) {}

    static constexpr const char* unused = "of lcec; without effect";
    Out<std::int32_t> out;
    Out<std::uint32_t> resets;
    Out<std::int32_t> app_phase, jitter;
    In<std::int32_t> drift_mode, drift;
    Out<std::int32_t> final_out;
    Param<std::uint32_t> step, max_error, sync_max;
    Param<bool> monitor;
};

/// Pins of all masters, which the first one has: lcec.NAME.
class LcecGlobalPins {
public:
    LcecGlobalPins(Component& c, const Function& f) {
        static std::shared_ptr<Totals> totals;
        const bool first = own_name("lcec.0") == "lcec.0" || !totals;
        const auto* const names = extension<hal_pin_names>(HAL_PIN_NAMES);
        if (names == nullptr) return;
        if (first) {
            totals = std::make_shared<Totals>();
            names->whole(detail::creating, true);
            pins_ = std::make_unique<Pins>(c, f);
            names->whole(detail::creating, false);
        }
        totals_ = totals;
        slot_ = totals_->count.fetch_add(1);
    }

    /// Shows this master, and all of them if it is the first. [realtime]
    void show(const master::BusStatus& s) noexcept {
        if (!totals_ || slot_ >= max_masters) return;
        totals_->states[slot_].store(packed(s), std::memory_order_relaxed);
        if (!pins_) return;
        std::uint32_t responding = 0;
        unsigned seen = 0;
        bool linked = true;
        bool operational = true;
        const std::size_t count = std::min(totals_->count.load(), max_masters);
        for (std::size_t i = 0; i < count; ++i) {
            const std::uint32_t state = totals_->states[i].load(std::memory_order_relaxed);
            responding += state & 0xffff;
            seen |= state >> 16 & 0xf;
            linked = linked && (state & link_bit) != 0;
            operational = operational && (state & operational_bit) != 0;
        }
        pins_->responding = responding;
        pins_->init = (seen & 1U) != 0;
        pins_->preop = (seen & 2U) != 0;
        pins_->safeop = (seen & 4U) != 0;
        pins_->op = (seen & 8U) != 0;
        pins_->link_up = linked;
        pins_->all_op = operational;
    }

private:
    static constexpr std::size_t max_masters = 64;
    static constexpr std::uint32_t link_bit = 1U << 20;
    static constexpr std::uint32_t operational_bit = 1U << 21;
    /// What the masters share: each writes its own state, the first reads all.
    struct Totals {
        std::atomic<std::size_t> count{0};
        std::array<std::atomic<std::uint32_t>, max_masters> states{};
    };
    struct Pins {
        Pins(Component& c, const Function& f)
            : responding(c, f, "lcec.slaves-responding", "slaves that answered, of all masters"),
              init(c, f, "lcec.state-init", "the state of a master is INIT"),
              preop(c, f, "lcec.state-preop", "the state of a master is PRE-OP"),
              safeop(c, f, "lcec.state-safeop", "the state of a master is SAFE-OP"),
              op(c, f, "lcec.state-op", "the state of a master is OP", {.safe = false}),
              link_up(c, f, "lcec.link-up", "the ports of all masters have a link"),
              all_op(c, f, "lcec.all-op", "all-op of all masters", {.safe = false}) {}
        Out<std::uint32_t> responding;
        Out<bool> init, preop, safeop, op, link_up, all_op;
    };

    static std::uint32_t packed(const master::BusStatus& s) noexcept {
        std::uint32_t word = s.responding & 0xffffU;
        word |= s.state == State::init ? 1U << 16 : 0U;
        word |= s.state == State::preop ? 1U << 17 : 0U;
        word |= s.state == State::safeop ? 1U << 18 : 0U;
        word |= s.state == State::op ? 1U << 19 : 0U;
        word |= s.link ? link_bit : 0U;
        word |= s.operational ? operational_bit : 0U;
        return word;
    }

    std::unique_ptr<Pins> pins_;
    std::shared_ptr<Totals> totals_;
    std::size_t slot_ = 0;
};

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
                {.unit = "ns"}),
          wkc_min(c, f, "wkc-min", "smallest working counter since it was complete first"),
          wkc_changes(c, f, "wkc-change-count",
                      "changes of the working counter since it was complete first"),
          wkc_reset(c, f, "wkc-reset", "begins both anew; FALSE again afterwards"),
          dc_phased(c, f, "dc-phased", "every slave with a clock is within the window",
                    {.safe = false}),
          pll(c, f),
          all_masters(c, f) {}

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
        dc_phased = s.dc_synchronised;
        count_changes(s);
        all_masters.show(s);
    }

    Out<std::uint32_t> responding;
    Out<bool> init, preop, safeop, op, link_up, all_op;
    Out<std::uint32_t> wkc;
    Out<std::int32_t> wkc_state;
    Out<std::uint32_t> dc_deviation;
    Out<bool> dc_synchronised;
    Out<std::int32_t> phase;
    Out<std::uint32_t> wkc_min, wkc_changes;
    Io<bool> wkc_reset;
    Out<bool> dc_phased;
    LcecPllPins pll;
    LcecGlobalPins all_masters;

private:
    /// [realtime]
    void count_changes(const master::BusStatus& s) noexcept {
        if (wkc_reset) {
            wkc_reset = false;
            was_complete_ = false;
        }
        const bool complete = s.wkc_state == master::WkcState::complete;
        if (!was_complete_) {
            was_complete_ = complete;
            wkc_min = s.wkc;
            wkc_changes = 0U;
            last_wkc_ = s.wkc;
            return;
        }
        if (s.wkc != last_wkc_) {
            wkc_changes = wkc_changes + 1;
            last_wkc_ = s.wkc;
        }
        if (s.wkc < wkc_min) {
            wkc_min = s.wkc;
        }
    }
    std::uint32_t last_wkc_ = 0;
    bool was_complete_ = false;
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
