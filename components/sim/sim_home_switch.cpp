// SPDX-License-Identifier: MIT
#include "hal/component.hpp"
#include "hal/edge.hpp"
#include "hal/retained.hpp"

namespace {

struct SimHomeSwitch : hal::Component {
    using Component::Component;
    hal::In<double> cur_pos{*this, "cur-pos", "position of the axis"};
    hal::In<double> home_pos{
        *this,
        "home-pos",
        "position of the switch; its sign is the side on which the switch is on",
        {.initial = 1.0}};
    hal::In<double> hysteresis{
        *this, "hysteresis", "distance back to the point where it turns off", {.initial = 0.1}};
    hal::Out<bool> home_sw{*this, "home-sw", "TRUE: the switch is on"};
    hal::Io<bool> index_enable{
        *this, "index-enable",
        "cleared index-delay-ms after it became TRUE, as by an encoder index"};
    hal::In<double> index_delay{
        *this, "index-delay-ms", "delay of the index", {.initial = 10.0, .unit = "ms"}};
    hal::Function run{*this, "", &SimHomeSwitch::update, "updates the switch and the index"};

    void update(hal::Cycle cycle) noexcept {
        update_switch();
        update_index(static_cast<double>(cycle.period_ns()) * 1e-6);
    }

private:
    void update_switch() noexcept {
        const bool upper_side = home_pos >= 0.0;
        if (upper_side ? cur_pos >= home_pos : cur_pos <= home_pos) {
            home_sw = true;
            return;
        }
        const double off = upper_side ? home_pos - hysteresis : home_pos + hysteresis;
        if (upper_side ? cur_pos <= off : cur_pos >= off) {
            home_sw = false;
        }
    }

    void update_index(double period_ms) noexcept {
        const bool waiting = left_ms_ > 0.0;
        if (waiting) {
            left_ms_ -= period_ms;
        }
        if (waiting && left_ms_ <= 0.0) {
            index_enable = false;
            return;
        }
        if (enable_edge_.rises(index_enable)) {
            left_ms_ = index_delay;
        }
    }

    double left_ms_ = 0.0;  // until index-enable is cleared; 0: not waiting
    hal::RisingEdge enable_edge_;
    hal::Retained retained_{*this, {{"left-ms", left_ms_}, {"was-enabled", enable_edge_}}};
};

}  // namespace

HAL_COMPONENT(SimHomeSwitch, "sim_home_switch", "Simulated home switch and index", R"(
`home-sw` is on at and above `home-pos`, or at and below it if `home-pos` is negative; it turns off
`hysteresis` before that position. A rising edge of `index-enable` starts a delay of
`index-delay-ms`, after which it is cleared; a delay of 0 or less does not clear it.

    loadrt sim_home_switch names=x-home
    addf x-home servo
    setp x-home.home-pos -0.5
    net x-pos   => x-home.cur-pos
    net x-index => x-home.index-enable
    net x-on    <= x-home.home-sw
)")
