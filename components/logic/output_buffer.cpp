// SPDX-License-Identifier: MIT
#include "hal/component.hpp"

namespace {

struct OutputBuffer : hal::Component {
    using Component::Component;
    hal::Argument count{*this, "personality", 8, "number of bits", {.min = 1, .max = 64}};
    hal::In<bool> enable{*this, "enable", "FALSE sets all outputs to FALSE"};
    hal::Ins<bool> in{*this, "in-#", count, "input #"};
    hal::Outs<bool> out{*this, "out-#", count, "input # while enable is TRUE", {.safe = false}};
    hal::Function run{*this, "", hal::step<&OutputBuffer::update>, "copies the bits"};

    void update(hal::Cycle) noexcept {
        const bool pass = enable;
        for (std::size_t i = 0; i < out.size(); ++i) {
            out[i] = pass && in[i];
        }
    }
};

}  // namespace

HAL_COMPONENT(OutputBuffer, "output_buffer", "Passes several bits while enabled", R"(
While `enable` is TRUE each output equals its input; otherwise all outputs are FALSE. `personality`
is the number of bits.

    loadrt output_buffer names=valves personality=2
    addf valves servo
    net estop-ok    => valves.enable
    net clamp-part  => valves.in-0
    net blow-air    => valves.in-1
    net clamp-valve <= valves.out-0
    net air-valve   <= valves.out-1
)")
