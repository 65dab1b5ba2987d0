// SPDX-License-Identifier: MIT
#include "hal/edge.hpp"
#include "hal/retained.hpp"
#include "iec_time.hpp"

namespace {

struct Tp : hal::Component {
    using Component::Component;
    hal::In<bool> in{*this, "in", "a rising edge starts the pulse"};
    hal::Out<bool> q{*this, "q", "TRUE during the pulse"};
    hal::Out<double> et{*this, "et", "time since the start of the pulse", {.unit = "s"}};
    iec::PresetTime pt{*this, "pt", "duration of the pulse", {.unit = "s"}};
    hal::Function run{*this, "", hal::step<&Tp::update>, "measures the time"};

    void update(hal::Cycle cycle) noexcept {
        pt.correct_sign();
        const bool rising_edge = in_edge_.rises(in);
        if (!q && !rising_edge) {
            et = 0.0;
            return;
        }
        q = et < pt;
        if (q) {
            et = et + cycle.seconds();
        }
    }

private:
    hal::RisingEdge in_edge_;
    hal::Retained retained_{*this, {{"was-in", in_edge_}}};
};

}  // namespace

HAL_COMPONENT(Tp, "tp", "IEC timer: pulse", R"(
A rising edge of `in` sets `q` for `pt` seconds, regardless of further changes of `in`. `et`
includes the current cycle; it returns to 0 in the second cycle after the pulse. An edge in the
first one is ignored, as in LinuxCNC. A negative `pt` is set to 0.

    loadrt tp names=lubricate
    addf lubricate servo
    setp lubricate.pt 2.5
    net part-done => lubricate.in
    net lube-pump <= lubricate.q
)")
