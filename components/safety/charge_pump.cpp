// SPDX-License-Identifier: MIT
#include <cstdint>

#include "hal/component.hpp"
#include "hal/retained.hpp"

namespace {

struct ChargePump : hal::Component {
    using Component::Component;
    static constexpr hal::Traits traits{.singleton = true};

    hal::Out<bool> out{*this, "out", "changes in every cycle", {.safe = false}};
    hal::Out<bool> half{*this, "out-2", "changes in every second cycle", {.safe = false}};
    hal::Out<bool> quarter{*this, "out-4", "changes in every fourth cycle", {.safe = false}};
    hal::In<bool> enable{*this, "enable", "FALSE sets the outputs low", {.initial = true}};

    hal::Function run{*this, "", &ChargePump::update, "generates the next half wave"};

    void update(hal::Cycle) noexcept {
        if (enable) {
            ++phase_;
        }
        out = enable && (phase_ & 1) != 0;
        half = enable && (phase_ & 2) != 0;
        quarter = enable && (phase_ & 4) != 0;
    }

private:
    std::uint32_t phase_ = 0;
    hal::Retained retained_{*this, {{"phase", phase_}}};
};

}  // namespace

HAL_COMPONENT(ChargePump, "charge_pump", "Square waves that show that the thread runs", R"(
A charge pump in an output stage keeps a relay closed only while its input is a square wave: when
the thread stops, the machine enters the safe state, regardless of the last output level. `out` has
half the frequency of the thread, `out-2` and `out-4` a half and a quarter of that. While `enable`
is FALSE the outputs are FALSE; the waves then go on where they stopped.

    loadrt charge_pump
    addf charge-pump servo-thread
    net alive  <= charge-pump.out
    net well   => charge-pump.enable
)")
