// SPDX-License-Identifier: MIT
#include "hal/component.hpp"
#include "hal/retained.hpp"

namespace {

/// A parameter that the component sets as well.
class Position : public hal::Param<std::int32_t> {
public:
    using Param::Param;
    void move(std::int32_t value) noexcept { put(value); }
};

struct Multiswitch : hal::Component {
    using Component::Component;
    hal::Argument cfg{*this,
                      "cfg",
                      4,
                      "number of positions, for each switch",
                      {.per_instance = true, .min = 1, .max = 100}};
    hal::In<bool> up{*this, "up", "a rising edge selects the next position"};
    hal::In<bool> down{*this, "down", "a rising edge selects the previous position"};
    hal::Outs<bool> bit{*this, "bit-##", cfg, "TRUE in position #"};
    hal::Param<std::uint32_t> top{*this,
                                  "top-position",
                                  "highest position",
                                  {.initial = static_cast<std::uint32_t>(std::int64_t{cfg}) - 1}};
    Position position{*this, "position", "current position; may be set"};
    hal::Function run{*this, "", hal::step<&Multiswitch::update>, "moves the switch"};

    void update(hal::Cycle) noexcept {
        const bool up_now = up;
        const bool down_now = down;
        const auto last = static_cast<std::int64_t>(static_cast<std::int32_t>(top.get()));
        std::int64_t at = position;
        if (up_now && !was_up_) {
            ++at;
        }
        if (down_now && !was_down_) {
            --at;
        }
        if (at < 0) {
            at = last;
        }
        if (at < 0 || at > std::int64_t{top}) {
            at = 0;
        }
        was_up_ = up_now;
        was_down_ = down_now;
        position.move(static_cast<std::int32_t>(at));
        for (std::size_t i = 0; i < bit.size(); ++i) {
            bit[i] = static_cast<std::int64_t>(i) == at;
        }
    }

private:
    bool was_up_ = false;

private:
    bool was_down_ = false;
    hal::Retained retained_{*this, {{"was-up", was_up_}, {"was-down", was_down_}}};
};

}  // namespace

HAL_COMPONENT(Multiswitch, "multiswitch", "A switch of several positions, moved by buttons", R"(
Each press of `up` or `down` moves by one position and wraps around between `top-position` and 0.
The bit of the current position is TRUE; a position above the number of bits has none. `cfg=3,5`
creates two switches, with three and five positions.

    loadrt multiswitch names=jog-step cfg=3
    addf jog-step servo
    net button-up   => jog-step.up
    net button-down => jog-step.down
    net step-fine   <= jog-step.bit-00
    net step-medium <= jog-step.bit-01
    net step-coarse <= jog-step.bit-02
)")
