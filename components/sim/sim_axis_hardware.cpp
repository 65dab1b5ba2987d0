// SPDX-License-Identifier: MIT
#include <algorithm>
#include <array>
#include <cstddef>
#include <optional>
#include <string>

#include "hal/component.hpp"

namespace {

constexpr std::array names = {"X", "X2", "Y", "Y2", "Z", "A", "U", "V"};

struct SimAxisHardware : hal::Component {
    struct Axis {
        std::optional<hal::In<double>> position, home_position, max_upper, max_lower, min_upper,
            min_lower, home_width;
        std::optional<hal::In<bool>> homing;
        std::optional<hal::Out<bool>> home, max, min, both, max_home, min_home, both_home;
    };
    std::array<Axis, names.size()> axes;
    hal::Out<bool> home_all{*this, "homesw-all", "TRUE: an axis is homing and a home switch is on"};
    hal::Out<bool> limit_all{*this, "limitsw-all",
                             "TRUE: no axis is homing and a limit switch is on"};
    hal::Out<bool> all{*this, "limitsw-homesw-all",
                       "TRUE: homesw-all or limitsw-all, as with all switches on one input"};
    hal::In<double> limit_offset{*this,
                                 "limit-offset",
                                 "distance by which limit switches trip after their positions",
                                 {.initial = 0.01}};
    hal::Function run{*this, "update", &SimAxisHardware::update, "updates the switches"};

    explicit SimAxisHardware(const hal_host* host) : Component(host) {
        for (std::size_t i = 0; i < names.size(); ++i) {
            const std::string n = names[i];
            Axis& a = axes[i];
            const auto real = [&](auto& pin, const char* end, const char* doc, double initial) {
                pin.emplace(*this, (n + end).c_str(), doc,
                            hal::PinOptions<double>{.initial = initial});
            };
            const auto bit = [&](auto& pin, const char* end, const char* doc) {
                pin.emplace(*this, (n + end).c_str(), doc);
            };
            real(a.position, "current-pos", "position of the axis", 0.0);
            real(a.home_position, "homesw-pos", "position of the home switch", 1.0);
            real(a.max_upper, "maxsw-upper", "upper end of the maximum switch", 0.0);
            real(a.max_lower, "maxsw-lower", "lower end of the maximum switch", 0.0);
            real(a.min_upper, "minsw-upper", "upper end of the minimum switch", 0.0);
            real(a.min_lower, "minsw-lower", "lower end of the minimum switch", 0.0);
            real(a.home_width, "homesw-hyst", "width of the home switch, centred", 0.025);
            bit(a.homing, "homing", "TRUE while the axis is homing");
            bit(a.home, "homesw-out", "home switch");
            bit(a.max, "maxsw-out", "maximum switch");
            bit(a.min, "minsw-out", "minimum switch");
            bit(a.both, "bothsw-out", "either limit switch, FALSE while any axis is homing");
            bit(a.max_home, "maxsw-homesw-out", "maximum or home switch");
            bit(a.min_home, "minsw-homesw-out", "minimum or home switch");
            bit(a.both_home, "bothsw-homesw-out",
                "any switch; while any axis is homing the home switch only");
        }
    }

    void update(hal::Cycle) noexcept {
        bool any_home = false;
        bool any_limit = false;
        const bool homing =
            std::any_of(axes.begin(), axes.end(), [](const Axis& a) { return a.homing->get(); });
        for (Axis& a : axes) {
            const double at = *a.position;
            // a NaN trips a switch
            const bool home = !(std::fabs(at - *a.home_position) > 0.5 * *a.home_width);
            const bool max = is_between(*a.max_lower + limit_offset, at, *a.max_upper);
            const bool min = is_between(*a.min_lower, at, *a.min_upper - limit_offset);
            const bool limit = !homing && (max || min);
            *a.home = home;
            *a.max = max;
            *a.min = min;
            *a.both = limit;
            *a.max_home = max || home;
            *a.min_home = min || home;
            *a.both_home = limit || home;
            any_home = any_home || home;
            any_limit = any_limit || limit;
        }
        home_all = any_home && homing;
        limit_all = any_limit;
        all = home_all || any_limit;
    }

private:
    static bool is_between(double low, double value, double high) noexcept {
        return !(value >= high || value <= low);
    }
};

}  // namespace

HAL_COMPONENT(SimAxisHardware, "sim_axis_hardware",
              "Simulated home and limit switches of X, Y, Z, A, U, V and tandem X2, Y2", R"(
Each axis has a home switch centred at `homesw-pos`, `homesw-hyst` wide, and two limit switches with
a lower and an upper end. The maximum switch trips `limit-offset` above its lower end, the minimum
switch `limit-offset` below its upper end. Further pins combine switches, as on machines with shared
inputs; while any axis is homing they ignore all limit switches, and `homesw-all` ignores the home
switches while none is.

**Differences from LinuxCNC:** `Amaxsw-homesw-out`, `Aminsw-homesw-out` and `Abothsw-homesw-out`
work (LinuxCNC: always FALSE).

    loadrt sim_axis_hardware names=switches
    addf switches.update servo
    setp switches.Xmaxsw-upper 101
    setp switches.Xmaxsw-lower 100
    setp switches.Xhomesw-pos 2
    net x-pos  => switches.Xcurrent-pos
    net x-home <= switches.Xhomesw-out
    net limits <= switches.limitsw-all
)")
