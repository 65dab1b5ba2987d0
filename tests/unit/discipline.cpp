// SPDX-License-Identifier: MIT
// Discipline against a beat of another clock, simulated: the clock's phase is what its steps and the drift make of it.
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "hal/discipline.hpp"

namespace hal::test {
namespace {

/// A beat whose period is `drift` longer than the clock's, seen with normal noise.
struct Beat {
    double period_ns = 1e6, drift = 200e-6, noise_ns = 2000;
    double phase_ns = 0;  ///< of the beat, by the clock; what a perfect discipline would bring to 0
    std::mt19937 random{1};

    std::int64_t seen() { return std::llround(phase_ns + (noise_ns > 0 ? std::normal_distribution<>(0, noise_ns)(random) : 0.0)); }
    void pass(std::int64_t step) { phase_ns += drift * period_ns - static_cast<double>(step); }
    std::int64_t turn(Discipline& discipline) {
        const std::int64_t step = discipline.follow(seen(), static_cast<std::int64_t>(period_ns));
        pass(step);
        return step;
    }
    /// Root mean square of the true phase over `beats`.
    double rms(Discipline& discipline, int beats) {
        double sum = 0;
        for (int i = 0; i < beats; ++i) {
            turn(discipline);
            sum += phase_ns * phase_ns;
        }
        return std::sqrt(sum / beats);
    }
};

TEST(Discipline, Holds_a_beat_200_ppm_off_with_2_us_of_noise_to_a_quarter_of_that) {
    for (const unsigned seed : {1u, 2u, 3u, 4u, 5u}) {
        Beat beat{.phase_ns = 300'000};
        beat.random.seed(seed);
        Discipline discipline;
        beat.rms(discipline, 200);
        EXPECT_LT(beat.rms(discipline, 5000), 700) << seed;
        EXPECT_TRUE(discipline.locked());
        EXPECT_NEAR(discipline.rate(), 200e-6, 100e-6);
        EXPECT_NEAR(discipline.scatter_ns(), 1700, 900);
    }
}

TEST(Discipline, Does_the_same_at_100_us) {
    Beat beat{.period_ns = 1e5, .phase_ns = -40'000};
    Discipline discipline;
    beat.rms(discipline, 200);
    EXPECT_LT(beat.rms(discipline, 5000), 700);
}

TEST(Discipline, Finds_an_exact_beat_exactly) {
    Beat beat{.noise_ns = 0, .phase_ns = -450'000};
    Discipline discipline;
    for (int i = 0; i < 300; ++i) beat.turn(discipline);
    EXPECT_LE(beat.rms(discipline, 100), 1.0);
    EXPECT_NEAR(discipline.rate(), 200e-6, 1e-6);
}

TEST(Discipline, Brings_a_fraction_of_a_nanosecond_per_beat_to_account) {
    Beat beat{.drift = 3e-10, .noise_ns = 0};  // 0.3 ns in ten beats: far below one step
    Discipline discipline;
    for (int i = 0; i < 100'000; ++i) beat.turn(discipline);
    EXPECT_LT(std::abs(beat.phase_ns), 5.0) << "there is no dead band";
}

TEST(Discipline, Acquires_the_phase_in_steps_of_its_limit_and_overshoots_by_no_more_than_noise) {
    Beat beat{.phase_ns = 450'000};
    Discipline discipline;
    int beats = 0;
    for (double before = beat.phase_ns; beat.phase_ns > 5000; before = beat.phase_ns, ++beats) {
        ASSERT_LE(std::abs(beat.turn(discipline)), 100'000);
        ASSERT_LT(beat.phase_ns, before);
        ASSERT_FALSE(discipline.locked());
    }
    EXPECT_LE(beats, 6);
    for (int i = 0; i < 50; ++i) {
        beat.turn(discipline);
        ASSERT_GT(beat.phase_ns, -8000);
    }
}

TEST(Discipline, A_step_obeys_the_limit_it_is_given) {
    Discipline discipline;
    EXPECT_EQ(discipline.follow(-450'000, 4'000'000, 100'000), -100'000);
    EXPECT_EQ(discipline.follow(-350'000, 4'000'000, 100'000), -100'000);
}

TEST(Discipline, A_beat_that_was_held_up_hardly_counts) {
    Beat beat{.noise_ns = 200};
    Discipline discipline;
    beat.rms(discipline, 500);
    for (int i = 0; i < 100; ++i) {
        beat.phase_ns += 130'000;  // behind a long frame of lower priority; three in a row at most
        for (int k = 0; k < 1 + i % 3; ++k) {
            const std::int64_t step = discipline.follow(beat.seen(), 1'000'000);
            beat.pass(step);
        }
        beat.phase_ns -= 130'000;
        beat.rms(discipline, 20);
        ASSERT_LT(std::abs(beat.phase_ns), 1000) << i;
        ASSERT_NEAR(discipline.rate(), 200e-6, 20e-6);
    }
}

TEST(Discipline, A_beat_in_a_new_place_is_taken_over_at_once_with_the_rate_kept) {
    Beat beat{.noise_ns = 200};
    Discipline discipline;
    beat.rms(discipline, 500);
    beat.phase_ns += 300'000;
    for (int i = 0; i < 4 + 3; ++i) beat.turn(discipline);
    beat.rms(discipline, 20);
    EXPECT_LT(std::abs(beat.phase_ns), 1000);
    EXPECT_NEAR(discipline.rate(), 200e-6, 100e-6);
}

TEST(Discipline, Coasts_at_the_rate_it_has_found) {
    Beat beat{.noise_ns = 200};
    Discipline discipline;
    EXPECT_EQ(discipline.coast(1'000'000), 0) << "nothing is known yet";
    beat.rms(discipline, 2000);
    for (int i = 0; i < 100; ++i) beat.pass(discipline.coast(1'000'000));
    EXPECT_LT(std::abs(beat.phase_ns), 1500) << "without it the clock would be 20 us off";
}

TEST(Discipline, Forgets_the_phase_and_keeps_the_rate_when_the_beat_is_lost) {
    Beat beat{.noise_ns = 200};
    Discipline discipline;
    beat.rms(discipline, 500);
    discipline.lose();
    EXPECT_FALSE(discipline.locked());
    beat.phase_ns = -80'000;
    for (int i = 0; i < 20; ++i) {
        beat.turn(discipline);
        ASSERT_NEAR(discipline.rate(), 200e-6, 50e-6);
    }
    EXPECT_LT(beat.rms(discipline, 100), 200);
    EXPECT_TRUE(discipline.locked());
}

TEST(Discipline, Is_locked_by_sixteen_near_beats_and_no_longer_when_they_are_twice_as_far) {
    Discipline discipline({.lock_ns = 1000});
    for (int i = 0; i < 15; ++i) discipline.follow(0, 1'000'000);
    EXPECT_FALSE(discipline.locked());
    discipline.follow(0, 1'000'000);
    EXPECT_TRUE(discipline.locked());
    for (int i = 0; i < 40; ++i) discipline.follow(i % 2 ? 1900 : -1900, 1'000'000);
    EXPECT_TRUE(discipline.locked());
    for (int i = 0; i < 40; ++i) discipline.follow(i % 2 ? 2200 : -2200, 1'000'000);
    EXPECT_FALSE(discipline.locked());
}

TEST(Discipline, Gives_up_on_a_beat_that_moves_with_the_clock) {
    Discipline discipline;
    std::int64_t sum = 0;
    for (int i = 0; i < 10'000; ++i) sum += discipline.follow(250'000, 1'000'000);  // whatever it steps, the beat is as late as before
    EXPECT_TRUE(discipline.in_vain());
    EXPECT_LT(sum, 3'000'000);
    EXPECT_FALSE(discipline.locked());
    discipline.lose();
    EXPECT_FALSE(discipline.in_vain());
}

TEST(Discipline, Does_not_give_up_on_a_beat_with_much_noise) {
    Beat beat{.noise_ns = 80'000};
    Discipline discipline({.lock_ns = 10'000});
    for (int i = 0; i < 100'000; ++i) beat.turn(discipline);
    EXPECT_FALSE(discipline.locked());
    EXPECT_FALSE(discipline.in_vain());
}

TEST(Discipline, A_rate_that_no_clock_has_is_not_followed) {
    Beat beat{.drift = 5e-3, .noise_ns = 0};
    Discipline discipline;
    beat.rms(discipline, 500);
    EXPECT_LE(std::abs(discipline.rate()), 1e-3);
}

}  // namespace
}  // namespace hal::test
