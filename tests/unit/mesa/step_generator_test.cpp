// SPDX-License-Identifier: MIT
// The step generator, which computes many clocks at once, beside one that computes each.
#include "mesa/card/step_generator.hpp"

#include <random>

namespace hal::mesa {
namespace {

/// What the chip does in each clock.
struct ClockByClock {
    std::uint64_t position = 0;
    std::int32_t rate = 0;
    int direction = 1;
    std::int64_t busy = 0;
    StepGenerator::Times times;

    void set_rate(std::int32_t to) {
        const int now = to < 0 ? -1 : 1;
        if (to != 0 && now != direction) {
            direction = now;
            busy += std::int64_t{times.hold} + times.setup + 2;
        }
        rate = to;
    }
    std::int64_t advance(std::int64_t clocks) {
        std::int64_t steps = 0;
        for (; clocks > 0; --clocks) {
            busy = std::max<std::int64_t>(0, busy - 1);
            const std::uint64_t next = position + static_cast<std::uint64_t>(std::int64_t{rate});
            const bool is_step = next >> 32 != position >> 32;
            if (is_step && busy > 0) continue;
            position = next;
            if (!is_step) continue;
            steps += rate > 0 ? 1 : -1;
            busy = std::int64_t{times.length} + times.space + 2;
        }
        return steps;
    }
};

TEST(StepGenerator, Makes_the_same_steps_as_the_chip_clock_by_clock) {
    std::mt19937 dice(7);
    const auto up_to = [&](unsigned limit) { return static_cast<std::uint32_t>(dice() % limit); };
    for (int run = 0; run < 300; ++run) {
        StepGenerator tested;
        ClockByClock wanted;
        const unsigned scale = 1U << up_to(11);
        wanted.times = {up_to(scale), up_to(scale), up_to(scale), up_to(scale)};
        tested.times() = wanted.times;
        std::int64_t tested_steps = 0;
        std::int64_t wanted_steps = 0;
        for (int turn = 0; turn < 40; ++turn) {
            if (up_to(3) == 0) {
                const int shift = static_cast<int>(up_to(20));
                const std::int32_t rate = static_cast<std::int32_t>(dice()) >> shift;
                const std::int32_t to = up_to(10) == 0 ? 0 : rate;
                tested.set_rate(to);
                wanted.set_rate(to);
            }
            const std::int64_t clocks = up_to(2000);
            tested_steps += tested.advance(clocks);
            wanted_steps += wanted.advance(clocks);
            ASSERT_EQ(tested_steps, wanted_steps) << "run " << run << ", turn " << turn;
            ASSERT_EQ(tested.accumulator(), static_cast<std::uint32_t>(wanted.position >> 16))
                << "run " << run << ", turn " << turn;
        }
    }
}

}  // namespace
}  // namespace hal::mesa
