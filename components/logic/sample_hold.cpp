// SPDX-License-Identifier: MIT
#include "hal/component.hpp"

namespace {

struct SampleHold : hal::Component {
    using Component::Component;
    hal::In<std::int32_t> in{*this, "in", "value"};
    hal::In<bool> hold{*this, "hold", "TRUE holds out"};
    hal::Out<std::int32_t> out{*this, "out", "in, or its value when hold became TRUE"};
    hal::Function run{*this, "", hal::step<&SampleHold::update>, "copies in"};

    void update(hal::Cycle) noexcept {
        if (!hold) {
            out = in.get();
        }
    }
};

}  // namespace

HAL_COMPONENT(SampleHold, "sample_hold", "Passes an integer, or holds it", R"(
    loadrt sample_hold names=jog-counts
    addf jog-counts servo
    net wheel-counts => jog-counts.in
    net tool-changing => jog-counts.hold
    net x-jog-counts <= jog-counts.out
)")
