// SPDX-License-Identifier: MIT
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>

#include "hal/component.hpp"
#include "hal/retained.hpp"

namespace {

/// The values of the public pin `reason`; from `first_fault` on they are faults. Never renumber
/// them.
enum Reason : std::uint32_t {
    is_safe = 0,
    contacts_open = 1,
    waits_for_closing = 2,
    waits_for_opening = 3,
    waits_for_reset = 4,
    button_down = 5,
    first_fault = 10,
    did_not_close = 10,
    did_not_open = 11,
    test_a_failed = 12,
    test_b_failed = 13,
    cross_short = 14,
    button_stuck = 15,
    bad_parameters = 16,
};

/// The parameters of a cycle in nanoseconds.
struct Times {
    std::int64_t discrepancy, debounce, filter, reset_min, reset_max, test_period, test_width,
        test_response;

    static std::int64_t ns(double seconds) noexcept {
        return seconds >= 0.0 && seconds <= 1e6 ? std::llround(seconds * 1e9) : -1;
    }
    /// True if no value is negative or NaN and both test pulses fit into their period.
    bool sound(std::int64_t period_ns) const noexcept {
        if (std::min({discrepancy, debounce, filter, reset_min, test_period, test_width,
                      test_response}) < 0 ||
            reset_max < reset_min) {
            return false;
        }
        return test_period == 0 || (test_width >= period_ns &&
                                    2 * (test_width + test_response + period_ns) <= test_period);
    }
};

/// One debounced contact.
struct Contact {
    bool closed = false;
    std::int64_t differs_ns = 0;

    void follow(bool now, const Times& times, std::int64_t period_ns) noexcept {
        if (now == closed) {
            differs_ns = 0;
        } else if (differs_ns >= (now ? times.debounce : times.filter)) {
            closed = now;
            differs_ns = 0;
        } else {
            differs_ns += period_ns;
        }
    }
};

/// The test pulses on the two outputs that feed the contacts: on A at the start of a test period,
/// on B half a period later.
class PulseTest {
public:
    struct Channel {
        bool feed = true;       ///< level of the output
        bool hides = false;     ///< a test pulse makes this contact appear open
        bool was_high = false;  ///< level of the input at the start of the pulse
    };
    /// By channel: the levels at the inputs.
    using Levels = std::array<bool, 2>;

    const Channel& a() const noexcept { return channels_[0]; }
    const Channel& b() const noexcept { return channels_[1]; }

    /// Runs one cycle; returns the fault found or 0. [realtime]
    std::uint32_t step(const Levels& high, const Times& times, std::int64_t period_ns) noexcept {
        if (times.test_period == 0) {
            *this = PulseTest();
            return 0;
        }
        idle_ns_ += period_ns;
        if (pulse_ns_ < 0) {
            if (2 * idle_ns_ >= times.test_period) {
                begin(high);
            }
            return 0;
        }
        pulse_ns_ += period_ns;
        Channel& tested = channels_[tested_];
        const std::size_t other = 1 - tested_;
        std::uint32_t found = 0;
        if (!tested.feed) {
            other_dropped_ |= channels_[other].was_high && !high[other];
            if (pulse_ns_ < times.test_width) return 0;
            if (tested.was_high && high[tested_]) {
                found = failures[tested_];
            }
            tested.feed = true;
        }
        if (pulse_ns_ < times.test_width + times.test_response) return found;
        // it returned with the end of the pulse: it is fed by the same wire
        if (other_dropped_ && high[other]) {
            found = cross_short;
        }
        tested.hides = false;
        pulse_ns_ = -1;
        return found;
    }

private:
    static constexpr std::array<std::uint32_t, 2> failures{test_a_failed, test_b_failed};

    void begin(const Levels& high) noexcept {
        tested_ = 1 - tested_;
        channels_[0].was_high = high[0];
        channels_[1].was_high = high[1];
        channels_[tested_].feed = false;
        channels_[tested_].hides = high[tested_];
        other_dropped_ = false;
        idle_ns_ = pulse_ns_ = 0;
    }

    std::array<Channel, 2> channels_;
    std::size_t tested_ = 1;
    std::int64_t idle_ns_ = 0;    // since the start of the last pulse
    std::int64_t pulse_ns_ = -1;  // since the start of this one, or -1
    bool other_dropped_ = false;
};

struct SafetySwitch : hal::Component {
    using Component::Component;

    hal::In<bool> in_a{*this, "in-a", "contact A: TRUE while closed"};
    hal::In<bool> in_b{*this, "in-b", "contact B: TRUE while closed"};
    hal::In<bool> reset{*this, "reset", "reset button"};
    hal::Out<bool> safe{*this, "safe", "TRUE: the machine may move", {.safe = false}};
    hal::Out<bool> fault{*this, "fault",
                         "TRUE: fault of the switch, its wiring, the button or a parameter"};
    hal::Out<bool> ready{*this, "ready-to-reset", "TRUE: a reset would be accepted"};
    hal::Out<std::uint32_t> reason{
        *this, "reason", "reason why safe is FALSE: see the table", {.initial = contacts_open}};
    hal::Out<bool> test_a{*this,
                          "test-a",
                          "supply of contact A: TRUE, with short test pulses to FALSE",
                          {.initial = true, .safe = false}};
    hal::Out<bool> test_b{*this,
                          "test-b",
                          "supply of contact B: TRUE, with short test pulses to FALSE",
                          {.initial = true, .safe = false}};

    hal::Param<bool> antivalent{*this, "antivalent",
                                "TRUE: A closed and B open is safe; FALSE: both closed are safe"};
    hal::Param<double> discrepancy_time{*this,
                                        "discrepancy-time",
                                        "maximum time for which the contacts may disagree",
                                        {.initial = 0.5, .unit = "s"}};
    hal::Param<double> debounce_time{
        *this,
        "debounce-time",
        "time for which a contact must be stable before it counts as safe",
        {.initial = 0.01, .unit = "s"}};
    hal::Param<double> filter_time{
        *this,
        "filter-time",
        "time for which a contact must be unsafe before it trips; adds to the reaction time",
        {.unit = "s"}};
    hal::Param<std::uint32_t> reset_mode{
        *this,
        "reset-mode",
        "0: no reset; 1: reset on press; 2: reset on release after a press of valid duration",
        {.initial = 2}};
    hal::Param<double> reset_min{*this,
                                 "reset-min-time",
                                 "mode 2: minimum duration of a press",
                                 {.initial = 0.05, .unit = "s"}};
    hal::Param<double> reset_max{
        *this,
        "reset-max-time",
        "mode 2: maximum duration of a press; after it the button counts as stuck",
        {.initial = 3.0, .unit = "s"}};
    hal::Param<double> test_period{*this,
                                   "test-period",
                                   "period of the test pulses on a contact; 0: no test pulses",
                                   {.unit = "s"}};
    hal::Param<double> test_width{
        *this,
        "test-width",
        "duration of a test pulse; must exceed the round trip through the I/O",
        {.initial = 0.003, .unit = "s"}};
    hal::Param<double> test_response{*this,
                                     "test-response",
                                     "maximum time for an input to return after a test pulse",
                                     {.initial = 0.003, .unit = "s"}};

    hal::Function run{*this, "", &SafetySwitch::update, "monitors contacts, wiring and button"};

    void update(hal::Cycle cycle) noexcept {
        const std::int64_t period_ns = cycle.period_ns();
        const Times times{Times::ns(discrepancy_time), Times::ns(debounce_time),
                          Times::ns(filter_time),      Times::ns(reset_min),
                          Times::ns(reset_max),        Times::ns(test_period),
                          Times::ns(test_width),       Times::ns(test_response)};
        // The host wrote the safe value (stop, a fault): a reset is required as after opening.
        if (state_ == is_safe && !safe) {
            state_ = waits_for_reset;
        }

        const bool sound = times.sound(period_ns) && reset_mode <= 2;
        const std::uint32_t broken =
            !sound ? std::uint32_t{bad_parameters} : test_.step({in_a, in_b}, times, period_ns);
        if (!test_.a().hides) {
            a_.follow(in_a, times, period_ns);
        }
        if (!test_.b().hides) {
            b_.follow(antivalent ? !in_b : in_b.get(), times, period_ns);
        }

        const bool accepted = press(times, period_ns);
        if (broken != 0) {
            state_ = broken;
        } else {
            move(accepted, times, period_ns);
        }

        test_a = test_.a().feed;
        test_b = test_.b().feed;
        show(sound);
    }

private:
    bool both_open() const noexcept { return !a_.closed && !b_.closed; }
    bool both_closed() const noexcept { return a_.closed && b_.closed; }
    bool latched() const noexcept { return state_ >= first_fault; }
    /// Returns whether a reset would be accepted.
    bool resettable() const noexcept {
        return state_ == waits_for_reset || (latched() && both_open());
    }

    /// Runs the state machine for one cycle.
    void move(bool accepted, const Times& times, std::int64_t period_ns) noexcept {
        in_state_ns_ += period_ns;
        const std::uint32_t next = next_state(accepted, in_state_ns_ > times.discrepancy);
        if (next != state_) {
            state_ = next;
            in_state_ns_ = 0;
        }
        if (state_ == waits_for_reset && reset_mode == 0) {
            state_ = is_safe;
        }
    }

    /// Once a contact has opened, both must have been open before both may be closed. `overdue`:
    /// the contacts have disagreed for too long.
    std::uint32_t next_state(bool accepted, bool overdue) const noexcept {
        if (latched() && !accepted) return state_;
        if (both_open()) return contacts_open;
        switch (state_) {
        case contacts_open: return both_closed() ? waits_for_reset : waits_for_closing;
        case waits_for_closing:
            if (both_closed()) return waits_for_reset;
            return overdue ? std::uint32_t{did_not_close} : state_;
        case waits_for_opening: return overdue ? std::uint32_t{did_not_open} : state_;
        case waits_for_reset:
        case is_safe:
            if (!both_closed()) return waits_for_opening;
            return accepted ? std::uint32_t{is_safe} : state_;
        default: return state_;
        }
    }

    /// Follows the button; true in the cycle a reset is given. A press counts only if it began when
    /// it could help.
    bool press(const Times& times, std::int64_t period_ns) noexcept {
        const bool down = reset;
        const bool pressed = down && !was_down_;
        const bool released = !down && was_down_;
        was_down_ = down;
        if (pressed) {
            counts_ = resettable();
            pressed_ns_ = 0;
        } else if (down) {
            pressed_ns_ = std::min(pressed_ns_ + period_ns, std::int64_t{1} << 60);
        }
        if (!resettable()) {
            counts_ = false;
        }
        stuck_ = down && reset_mode == 2 && pressed_ns_ > times.reset_max;
        if (reset_mode != 2) return pressed && counts_;
        return released && counts_ && pressed_ns_ + period_ns >= times.reset_min &&
               pressed_ns_ <= times.reset_max;
    }

    void show(bool sound) noexcept {
        // held, but this press gives no reset
        const bool useless = was_down_ && !(counts_ && reset_mode == 2);
        std::uint32_t shown = state_;
        if (stuck_ && !latched() && state_ != is_safe) {
            shown = button_stuck;
        } else if (state_ == waits_for_reset && useless) {
            shown = button_down;
        }
        safe = state_ == is_safe;
        ready = sound && resettable() && !stuck_ && !useless;
        reason = shown;
        fault = shown >= first_fault;
    }

    PulseTest test_;
    Contact a_, b_;
    std::uint32_t state_ = contacts_open;
    std::int64_t in_state_ns_ = 0;
    std::int64_t pressed_ns_ = 0;
    bool was_down_ = false;
    bool counts_ = false;
    bool stuck_ = false;
    hal::Retained retained_{*this,
                            {{"test", test_},
                             {"a", a_},
                             {"b", b_},
                             {"state", state_},
                             {"in-state-ns", in_state_ns_},
                             {"pressed-ns", pressed_ns_},
                             {"was-down", was_down_},
                             {"counts", counts_},
                             {"stuck", stuck_}}};
};

}  // namespace

HAL_COMPONENT(SafetySwitch, "safety_switch",
              "Two-channel safety input with reset, discrepancy time and test pulses", R"(
Monitors a switch with two contacts (door, emergency stop button, light curtain) and enables the
machine. It follows the practice of two-channel safety relays: ISO 13849-1 (category 3 and 4: a
single fault must not lose the function and is found at the next demand; clause 5.2.2: a manual
reset acts when the button is released), IEC 61496-1 (start and restart interlock, test pulses on
outputs), IEC 60204-1 (9.2.3.4: reset does not start motion), PLCopen Safety Part 1 (SF_Equivalent,
SF_Antivalent). It is software on one computer, not a certified safety function.

* **Contacts.** `antivalent` FALSE: both are closed while safe. TRUE: A is closed and B open. `safe`
  becomes FALSE in the cycle in which either contact changes (plus `filter-time`); they are safe
  again after `debounce-time`.
* **Discrepancy.** They may disagree for `discrepancy-time`; a longer disagreement is a fault. Once
  one has opened, both must open.
* **Reset.** With both contacts safe, `reset-mode` 0 sets `safe` immediately (also at the start), 1
  on a press of `reset`, 2 on its release after a press between `reset-min-time` and
  `reset-max-time`. A press that started too early does not count. A stop or a fault of the runtime
  also requires a reset.
* **Test pulses.** With `test-period` above 0, `test-a` and `test-b` alternately become FALSE for
  `test-width`. Supply A from `test-a` and B from `test-b`. A conducting contact must show its pulse
  (else it is shorted to the supply or to the other), and the other must not. A contact that opens
  during its pulse is seen `test-response` after it: reaction time grows by `test-width` +
  `test-response`.
* **Faults** remain until the cause no longer exists, both contacts have opened and `reset` was
  pressed; then both must close again.

| reason | |
| --- | --- |
| 0 | safe |
| 1 | both contacts open |
| 2 | one contact closed, waiting for the other |
| 3 | one contact opened, waiting for the other |
| 4 | waiting for reset |
| 5 | reset is held: release it |
| 10 | fault: one contact did not close in time |
| 11 | fault: one contact did not open in time |
| 12, 13 | fault: A or B did not follow its test pulse |
| 14 | fault: the contacts are shorted to each other |
| 15 | fault: reset is stuck (ends when it is released) |
| 16 | fault: invalid parameter (negative, or test pulses that do not fit into test-period) |

    loadrt safety_switch names=base-switch
    addf base-switch servo-thread
    setp base-switch.antivalent 1
    net base-down   => base-switch.in-a
    net base-lifted => base-switch.in-b
    net base-safe   <= base-switch.safe
)")
