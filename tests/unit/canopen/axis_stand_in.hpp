// SPDX-License-Identifier: MIT
// Simulates a drive with the CiA 402 state machine, one transition per cycle, and rejects the
// transitions that a test selects.
#pragma once

#include <deque>
#include <functional>
#include <string>
#include <vector>

#include "canopen/protocol/numbers.hpp"
#include "cia402/axis.hpp"

namespace hal::canopen::axis_test {

using namespace cia402;

struct StandIn {
    State state = State::switch_on_disabled;
    State stuck_in = State::unknown;      ///< it takes no transition out of this one
    bool stays_in_quick_stop = false;     ///< 605Ah = 5–8
    bool answers_mode = true;
    bool acknowledges = true;
    bool follows = true;                  ///< csp: the position is that of the target
    std::uint16_t extra = 0;              ///< bits of the statusword besides the state
    std::uint16_t error_code = 0;
    std::int64_t travelled = 0;
    AxisFeedback out;
    std::vector<State> way;               ///< states since, without repetition

    void go(State next) {
        if (state == stuck_in && next != State::fault && next != State::fault_reaction_active) {
            return;
        }
        if (next != state) {
            way.push_back(next);
        }
        state = next;
    }
    void fail(std::uint16_t code) {
        error_code = code;
        way.push_back(state = State::fault);
    }

    void step(const AxisOrders& in) {
        const std::uint16_t c = in.controlword;
        const bool reset = (c & 0x80) != 0 && (last_ & 0x80) == 0;
        last_ = c;
        const unsigned low = c & 0x0f;
        const bool disable = (low & 2) == 0;
        const bool quick = (low & 6) == 2;
        const bool shut = (low & 7) == 6;

        const bool on = low == 7;
        const bool enable = low == 15;
        using enum State;
        switch (state) {
        case not_ready_to_switch_on: go(switch_on_disabled); break;
        case switch_on_disabled:
            if (shut) {
                go(ready_to_switch_on);
            }
            break;
        case ready_to_switch_on:
            if (disable || quick) {
                go(switch_on_disabled);
            } else if (on) {
                go(switched_on);
            }
            break;
        case switched_on:
            if (disable || quick) {
                go(switch_on_disabled);
            } else if (shut) {
                go(ready_to_switch_on);
            } else if (enable) {
                go(operation_enabled);
            }
            break;
        case operation_enabled:
            if (disable) {
                go(switch_on_disabled);
            } else if (quick) {
                go(quick_stop_active);
            } else if (shut) {
                go(ready_to_switch_on);
            } else if (on) {
                go(switched_on);
            }
            break;
        case quick_stop_active:
            if (disable || !stays_in_quick_stop) {
                go(switch_on_disabled);
            }
            break;
        case fault_reaction_active: go(fault); break;
        case fault:
            if (reset && error_code != 0xffff) {
                error_code = 0;
                go(switch_on_disabled);
            }
            break;
        case unknown: break;
        }
        if (answers_mode) {
            out.mode = in.mode;
        }
        if (state == operation_enabled && follows && out.mode == Mode::cyclic_position) {
            out.position = in.target_position;
        }
        if (acknowledges) {
            acknowledge_ = (c & 0x10) != 0 && out.mode == Mode::profile_position;
        }
        tell();
    }
    void tell() {
        std::uint16_t word = extra;
        for (const auto& row : states) {
            if (row.state == state) {
                word = static_cast<std::uint16_t>(word | row.value);
            }
        }
        if (state != State::quick_stop_active && state != State::not_ready_to_switch_on) {
            word |= status::not_quick_stop;
        }
        if (state != State::switch_on_disabled) {
            word |= status::voltage_enabled;
        }
        word |= status::remote;
        if (acknowledge_) {
            word |= status::set_point_acknowledge;
        }
        out.statusword = static_cast<std::uint16_t>(word & ~cleared);
        out.error_code = error_code;
    }
    std::uint16_t cleared = 0;

private:
    std::uint16_t last_ = 0;
    bool acknowledge_ = false;
};

/// The two of them, a cycle of 1 ms at a time.
struct Pair {
    Axis axis;
    StandIn drive;
    AxisCommand command;
    AxisRules rules;
    Time now = 0;
    std::vector<std::uint16_t> words;  ///< controlwords, without repetition
    std::size_t delay = 0;  ///< cycles that orders and answers are on their way together

    Pair() {
        rules.limits = {500 * millisecond, second};
        command.mode = Mode::cyclic_position;
        drive.tell();
    }
    void cycle(unsigned count = 1) {
        for (unsigned i = 0; i < count; ++i) {
            now += millisecond;
            const AxisOrders& orders = axis.step(drive.out, command, rules, now);
            if (words.empty() || words.back() != orders.controlword) {
                words.push_back(orders.controlword);
            }
            last = orders;
            under_way_.push_back(orders);
            if (under_way_.size() > delay) {
                drive.step(under_way_.front());
                under_way_.pop_front();
            }
        }
    }
    /// Cycles until `ready`, at most 20 000. False: never.
    bool until(const std::function<bool()>& ready) {
        for (int i = 0; i < 20000; ++i) {
            cycle();
            if (ready()) return true;
        }
        return false;
    }
    bool enable() {
        command.enable = true;
        return until([&] { return axis.enabled() || axis.failure(); }) && axis.enabled();
    }
    std::string why() const { return text(axis.failure()); }
    AxisOrders last;

private:
    std::deque<AxisOrders> under_way_;
};

}  // namespace hal::canopen::axis_test
