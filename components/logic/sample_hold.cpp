// SPDX-License-Identifier: MIT
#include "hal/component.hpp"

namespace {

struct SampleHold : hal::Component {
    using Component::Component;
    hal::In<std::int32_t>  in{*this, "in", "the value"};
    hal::In<bool>          hold{*this, "hold", "TRUE: out stays as it is"};
    hal::Out<std::int32_t> out{*this, "out", "in, or what it was when hold became TRUE"};
    hal::Function          run{*this, "", hal::step<&SampleHold::update>, "copies in"};

    void update(hal::Cycle) noexcept {
        if (!hold) out = in.get();
    }
};

}  // namespace

HAL_COMPONENT(SampleHold, "sample_hold", "Follows an integer, or holds it", R"(
    loadrt sample_hold names=jog-counts
    addf jog-counts servo
    net wheel-counts => jog-counts.in
    net tool-changing => jog-counts.hold
    net x-jog-counts <= jog-counts.out
)")
