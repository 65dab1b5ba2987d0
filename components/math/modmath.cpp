// SPDX-License-Identifier: MIT
#include "hal/naming.hpp"

namespace {

struct Modmath : hal::Component {
    using Component::Component;
    hal::InstanceName      name{*this, "mod-dir"};
    hal::InstanceCount     count{*this, "mod_dir", 1, "how many instances"};
    hal::In<std::int32_t>  actual{*this, "actual", "where it is"};
    hal::In<std::int32_t>  desired{*this, "desired", "where it shall be"};
    hal::Io<std::int32_t>  min{*this, "min-num", "first position", {.initial = 0}};
    hal::Io<std::int32_t>  max{*this, "max-num", "last position", {.initial = 15}};
    hal::Io<bool>          wrap{*this, "wrap", "TRUE: the first position follows the last one", {.initial = true}};
    hal::Out<bool>         up{*this, "up", "TRUE: the way up is not longer"};
    hal::Out<bool>         down{*this, "down", "TRUE: the way down is shorter"};
    hal::Out<bool>         on_target{*this, "on-target", "TRUE: it is there"};
    hal::Function          run{*this, "", hal::step<&Modmath::update>, "chooses the way"};

    void update(hal::Cycle) noexcept {
        const std::int64_t positions = std::int64_t{max} - min + 1, apart = std::int64_t{desired} - actual;
        if (wrap && positions > 0) {
            const std::int64_t upward = (apart % positions + positions) % positions;
            show(upward == 0, upward <= positions / 2);
        } else show(apart == 0, apart > 0);
    }

private:
    void show(bool there, bool upward) noexcept {
        up = !there && upward;
        down = !there && !upward;
        on_target = there;
    }
};

}  // namespace

HAL_COMPONENT(Modmath, "modmath", "The shorter way to a position of a magazine", R"(
The positions are `min-num` to `max-num`. With `wrap` they lie on a circle, and of two equal ways `up` is taken; without,
on a line. `mod_dir=2` makes two instances, `mod-dir.0` and `mod-dir.1`.

    loadrt modmath names=magazine
    addf magazine servo
    setp magazine.min-num 1
    setp magazine.max-num 24
    net pocket-now     => magazine.actual
    net pocket-wanted  => magazine.desired
    net turn-forward   <= magazine.up
    net turn-backward  <= magazine.down
    net pocket-reached <= magazine.on-target
)")
