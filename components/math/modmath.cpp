// SPDX-License-Identifier: MIT
#include "hal/naming.hpp"

namespace {

struct Modmath : hal::Component {
    using Component::Component;
    hal::InstanceName name{*this, "mod-dir"};
    hal::InstanceCount count{*this, "mod_dir", 1, "number of instances"};
    hal::In<std::int32_t> actual{*this, "actual", "current position"};
    hal::In<std::int32_t> desired{*this, "desired", "target position"};
    hal::Io<std::int32_t> min{*this, "min-num", "lowest position", {.initial = 0}};
    hal::Io<std::int32_t> max{*this, "max-num", "highest position", {.initial = 15}};
    hal::Io<bool> wrap{
        *this, "wrap", "TRUE: the lowest position follows the highest one", {.initial = true}};
    hal::Out<bool> up{*this, "up", "TRUE: move up", {.safe = false}};
    hal::Out<bool> down{*this, "down", "TRUE: move down", {.safe = false}};
    hal::Out<bool> on_target{*this, "on-target", "TRUE: actual equals desired", {.initial = true}};
    hal::Function run{*this, "", hal::step<&Modmath::update>, "selects the direction"};

    void update(hal::Cycle) noexcept {
        const std::int64_t positions = std::int64_t{max} - min + 1;
        std::int64_t apart = in_range(desired, positions) - in_range(actual, positions);
        const std::int64_t half = positions / 2;
        if (wrap && apart > half) {
            apart -= positions;
        }
        if (wrap && apart < -half) {
            apart += positions;
        }
        show(apart == 0, apart > 0);
    }

private:
    /// A position outside of the range counts as one in it; the remainder of one below `min-num` is
    /// negative.
    std::int64_t in_range(std::int64_t position, std::int64_t positions) const noexcept {
        if (positions == 0 || (position >= min && position <= max)) return position;
        return min + (position - min) % positions;
    }

    void show(bool there, bool upward) noexcept {
        up = !there && upward;
        down = !there && !upward;
        on_target = there;
    }
};

}  // namespace

HAL_COMPONENT(Modmath, "modmath", "Shortest direction to a position of a tool magazine", R"(
The positions are `min-num` to `max-num`. With `wrap` they form a circle, and the shorter way is
selected, of two equal ones the one that does not cross the end; without `wrap` they form a line.
`mod_dir=2` creates two instances, `mod-dir.0` and `mod-dir.1`.

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
