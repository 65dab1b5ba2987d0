// SPDX-License-Identifier: MIT
#include <algorithm>

#include "hal/component.hpp"
#include "hal/retained.hpp"
#include "hal/texts.hpp"
#include "mobile/texts/goal_list.hpp"

namespace {

struct Goals : hal::Component {
    using Component::Component;

    hal::Texts texts{*this};
    hal::TextArgument file{
        *this,
        "file",
        "",
        "file beside the netlist with a line goal X Y for each; without it one goal, 0 0",
        {.per_instance = true}};

    hal::In<bool> next{*this, "next", "a rising edge proceeds to the next goal"};
    hal::In<bool> restart{*this, "restart", "TRUE returns to the first goal"};
    hal::Param<bool> loop{*this, "loop", "TRUE: the first goal follows the last"};
    hal::Out<double> x{*this, "x", "x of the goal", {.unit = "m"}};
    hal::Out<double> y{*this, "y", "y of the goal", {.unit = "m"}};
    hal::Out<std::uint32_t> index{*this, "index", "number of the goal, from 0"};
    hal::Out<std::uint32_t> left{*this, "left", "goals behind this one"};
    hal::Out<bool> done{*this, "done", "TRUE: next came at the last goal, and loop is FALSE"};

    hal::Function run{*this, "update", &Goals::update, "selects the goal"};

    hal::mobile::GoalList list = read();

    void update(hal::Cycle) noexcept {
        const auto count = static_cast<std::uint32_t>(list.goals.size());
        if (restart) {
            at_ = 0;
            done = false;
        } else if (next && !was_) {
            if (at_ + 1 < count) {
                ++at_;
            } else if (loop) {
                at_ = 0;
            } else {
                done = true;
            }
        }
        was_ = next;
        x = list.goals[at_].x;
        y = list.goals[at_].y;
        index = at_;
        left = count - 1 - at_;
    }

private:
    hal::mobile::GoalList read() const {
        hal::mobile::GoalList goals;
        if (file.get().empty()) {
            goals.goals.push_back({0.0, 0.0});
            return goals;
        }
        const std::string text = texts.read("file", file.get());
        goals.read(text);
        texts.reject(file.get(), text, "mobile-text", goals.problems);
        return goals;
    }
    std::uint32_t at_ = 0;
    bool was_ = false;
    hal::Retained retained_{*this, {{"at", at_}, {"was", was_}}};
};

}  // namespace

HAL_COMPONENT(Goals, "goals", "Places to drive to, one after the other", R"(
The file has a line `goal X Y` for each place, in metres, at most 256. A rising edge of `next`
proceeds; after the last goal `done` is TRUE, or with `loop` the first follows.

    loadrt goals names=tour
    loadrt drive_to names=pilot
    addf tour.update servo
    addf pilot servo
    setp tour.loop TRUE
    net goal-x  tour.x        => pilot.target-x
    net goal-y  tour.y        => pilot.target-y
    net arrived pilot.reached => tour.next
)")
