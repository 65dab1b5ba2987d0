// SPDX-License-Identifier: MIT
#include "hal/component.hpp"
#include "hal/retained.hpp"

namespace {

struct Multiclick : hal::Component {
    using Component::Component;
    hal::In<bool> in{*this, "in", "button"};
    hal::Out<bool> single{*this, "single-click", "pulse at the end of the first click"};
    hal::Out<bool> single_only{*this, "single-click-only",
                               "pulse after a first click without a second one"};
    hal::Out<bool> twice{*this, "double-click", "pulse at the end of the second click"};
    hal::Out<bool> twice_only{*this, "double-click-only",
                              "pulse after a second click without a third one"};
    hal::Out<bool> triple{*this, "triple-click", "pulse at the end of the third click"};
    hal::Out<bool> triple_only{*this, "triple-click-only",
                               "pulse after a third click without a fourth one"};
    hal::Out<bool> quadruple{*this, "quadruple-click", "pulse at the end of the fourth click"};
    hal::Out<bool> quadruple_only{*this, "quadruple-click-only",
                                  "pulse after a fourth click without a fifth one"};
    hal::Out<std::int32_t> state{
        *this, "state",
        "0 idle; 1, 3, 5, 7 pressed; 2, 4, 6, 8 released; 9 waiting for the release"};
    hal::Param<bool> invert{*this, "invert-input", "TRUE: clicks start with a falling edge"};
    hal::Param<std::uint32_t> max_hold{*this,
                                       "max-hold-ns",
                                       "maximum duration of a press that counts as a click",
                                       {.initial = 250'000'000, .unit = "ns"}};
    hal::Param<std::uint32_t> max_space{*this,
                                        "max-space-ns",
                                        "maximum pause between two clicks of a series",
                                        {.initial = 250'000'000, .unit = "ns"}};
    hal::Param<std::uint32_t> output_hold{*this,
                                          "output-hold-ns",
                                          "duration of the output pulses",
                                          {.initial = 100'000'000, .unit = "ns"}};
    hal::Function run{*this, "", hal::step<&Multiclick::update>, "detects clicks"};

    void update(hal::Cycle cycle) noexcept {
        const std::int64_t period = cycle.period_ns();
        for (std::size_t i = 0; i < std::size(pulses_); ++i) {
            Pulse& pulse = pulses_[i];
            pulse.age_ns += pulse.age_ns < forever ? period : 0;
            if (*outs_[i] && pulse.age_ns >= pulse.hold_ns) {
                *outs_[i] = false;
            }
        }
        in_state_ns_ += in_state_ns_ < forever ? period : 0;
        step(in != invert);
        state = state_;
    }

private:
    static constexpr std::int64_t forever = std::int64_t{1} << 62;
    static constexpr std::int32_t idle = 0;
    static constexpr std::int32_t last_release = 8;
    static constexpr std::int32_t waiting = 9;

    struct Pulse {
        std::int64_t age_ns = 0;
        std::int64_t hold_ns = 0;
    };

    void step(bool pressed) {
        if (state_ == waiting) {
            if (!pressed) {
                enter(idle);
            }
        } else if (state_ % 2 == 1) {
            if (!pressed) {
                start(state_ - 1);
                enter(state_ + 1);
            } else if (in_state_ns_ > limit_ns_) {
                enter(waiting);
            }
        } else if (pressed) {
            enter(state_ == last_release ? waiting : state_ + 1);  // a fifth click is ignored
        } else if (state_ != idle && in_state_ns_ > limit_ns_) {
            start(state_ - 1);
            enter(idle);
        }
    }
    void enter(std::int32_t next) {
        state_ = next;
        in_state_ns_ = 0;
        limit_ns_ = next % 2 == 1 ? max_hold : max_space;
    }
    void start(std::int32_t i) {
        *outs_[i] = true;
        pulses_[i] = {0, output_hold};
    }

    // In the order of the states that start them.
    hal::Out<bool>* const outs_[8] = {&single, &single_only, &twice,     &twice_only,
                                      &triple, &triple_only, &quadruple, &quadruple_only};
    Pulse pulses_[8] = {};
    std::int64_t in_state_ns_ = 0;
    std::int64_t limit_ns_ = 0;  // of this state: max-hold-ns or max-space-ns when it began
    std::int32_t state_ = idle;
    hal::Retained retained_{*this,
                            {{"pulses", pulses_},
                             {"in-state-ns", in_state_ns_},
                             {"limit-ns", limit_ns_},
                             {"state", state_}}};
};

}  // namespace

HAL_COMPONENT(Multiclick, "multiclick", "Detects single, double, triple and quadruple clicks", R"(
A click is a press of at most `max-hold-ns`. Clicks with pauses of at most `max-space-ns` between
them form a series: the outputs without `only` are TRUE for `output-hold-ns` from the end of the
click, those with `only` from the end of the series. A longer press ends the series without an
`only` output. Debounce a noisy button first (`debounce`).

    loadrt multiclick names=pendant
    addf pendant servo
    net pendant-button => pendant.in
    net start-program  <= pendant.single-click-only
    net home-all       <= pendant.double-click-only
)")
