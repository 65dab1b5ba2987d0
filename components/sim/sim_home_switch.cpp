// SPDX-License-Identifier: MIT
#include "hal/component.hpp"

namespace {

struct SimHomeSwitch : hal::Component {
    using Component::Component;
    hal::In<double> cur_pos{*this, "cur-pos", "position of the axis"};
    hal::In<double> home_pos{*this, "home-pos", "position of the switch; its sign is the side on which it is on", {.initial = 1.0}};
    hal::In<double> hysteresis{*this, "hysteresis", "so far back until it is off again", {.initial = 0.1}};
    hal::Out<bool>  home_sw{*this, "home-sw", "TRUE: the switch is on"};
    hal::Io<bool>   index_enable{*this, "index-enable", "set: cleared after index-delay-ms, as by an encoder's index"};
    hal::In<double> index_delay{*this, "index-delay-ms", "how long the index lets wait", {.initial = 10.0, .unit = "ms"}};
    hal::Function   run{*this, "", &SimHomeSwitch::update, "switches"};

    void update(hal::Cycle cycle) noexcept {
        const double sign = home_pos < 0.0 ? -1.0 : 1.0;
        const double beyond = sign * (cur_pos - home_pos);
        home_sw = beyond >= 0.0 || (home_sw && beyond >= -std::fabs(hysteresis));

        waited_ms_ = index_enable ? std::min(waited_ms_ + cycle.seconds() * 1e3, 1e12) : 0.0;
        if (index_enable && !(waited_ms_ < index_delay)) {
            index_enable = false;
            waited_ms_ = 0.0;
        }
    }

private:
    double waited_ms_ = 0.0;
};

}  // namespace

HAL_COMPONENT(SimHomeSwitch, "sim_home_switch", "A simulated home switch, and index", R"(
`home-sw` goes on at `home-pos` and beyond it, to larger positions, or to smaller ones when `home-pos` is negative; off again `hysteresis`
before it. `index-enable` TRUE is cleared after `index-delay-ms`.

    loadrt sim_home_switch names=x-home
    addf x-home servo
    setp x-home.home-pos -0.5
    net x-pos   => x-home.cur-pos
    net x-index => x-home.index-enable
    net x-on    <= x-home.home-sw
)")
