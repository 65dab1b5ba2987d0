// SPDX-License-Identifier: MIT
// Records every step of its life; fails one of them on request.
#include <chrono>
#include <thread>

#include "hal/component.hpp"
#include "watch.hpp"

namespace {

struct Life : hal::Component {
    using Component::Component;
    hal::Argument address{*this, "watch", 0, "what it reports to"};
    hal::TextArgument failing{*this, "fail", "nothing", "step that fails: construct or start"};
    hal::In<bool> in{*this, "in", "copied to out"};
    hal::Out<bool> out{*this, "out", "in", {.safe = true}};
    hal::Out<double> level{*this, "level", "7", {.safe = -1.0}};
    hal::Function run{*this, "", &Life::copy, "copies"};
    hal::Emergency emergency{*this, &Life::make_safe, "counts"};
    hal::test::Watch& watch = constructed();

    ~Life() { ++watch.destroyed; }
    hal::test::Watch& constructed() {
        if (failing.get() == "construct") {
            throw std::runtime_error("the test rejects the construction");
        }
        auto& found = hal::test::Watch::at(address);
        ++found.constructed;
        return found;
    }
    void start() {
        if (failing.get() == "start") throw std::runtime_error("the test rejects the start");
        ++watch.started;
        if (hal::test::Watch* const other = watch.hang_at_start.exchange(nullptr)) {
            other->hang = true;
            // a limit, because a thread that got no CPU runs no functions
            for (int turn = 0; turn < 60'000 && !other->hanging; ++turn) {
                std::this_thread::sleep_for(std::chrono::milliseconds(1));
            }
        }
    }
    void stop() noexcept { ++watch.stopped; }
    void copy(hal::Cycle) noexcept {
        const int now = ++watch.inside;
        if (now > watch.max_inside) {
            watch.max_inside = now;
        }
        while (watch.hang) {
            watch.hanging = true;
            // a loop at real-time priority would stop other tests, too
            std::this_thread::sleep_for(std::chrono::milliseconds(1));
        }
        watch.hanging = false;
        ++watch.runs;
        out = in.get();
        level = 7.0;
        --watch.inside;
    }
    void make_safe(hal::Cycle) noexcept { ++watch.emergencies; }
};

}  // namespace

HAL_COMPONENT(Life, "test-life", "Reports every step of its life")
