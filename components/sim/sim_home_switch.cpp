// SPDX-License-Identifier: MIT
#include "hal/component.hpp"

namespace {

struct SimHomeSwitch : hal::Component {
    using Component::Component;
    hal::In<double> cur_pos{*this, "cur-pos", "position of the axis"};
    hal::In<double> home_pos{*this, "home-pos", "position of the switch; its sign is the side on which the switch is on", {.initial = 1.0}};
    hal::In<double> hysteresis{*this, "hysteresis", "distance back to the point where it turns off", {.initial = 0.1}};
    hal::Out<bool>  home_sw{*this, "home-sw", "TRUE: the switch is on"};
    hal::Io<bool>   index_enable{*this, "index-enable", "TRUE is cleared after index-delay-ms, as by an encoder index"};
    hal::In<double> index_delay{*this, "index-delay-ms", "delay of the index", {.initial = 10.0, .unit = "ms"}};
    hal::Function   run{*this, "", &SimHomeSwitch::update, "updates the switch and the index"};

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

HAL_COMPONENT(SimHomeSwitch, "sim_home_switch", "Simulated home switch and index", R"(
`home-sw` is on at and above `home-pos`, or at and below it if `home-pos` is negative; it turns off `hysteresis`
before that position. `index-enable` is cleared after `index-delay-ms`.

    loadrt sim_home_switch names=x-home
    addf x-home servo
    setp x-home.home-pos -0.5
    net x-pos   => x-home.cur-pos
    net x-index => x-home.index-enable
    net x-on    <= x-home.home-sw
)")
