// SPDX-License-Identifier: MIT
// Discipline against a simulated reference clock: the phase results from the adjustments and the
// drift.
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "hal/discipline.hpp"

namespace hal::test {
namespace {

/// Reference whose period is `drift` longer than the clock's, measured with normally distributed
/// noise.
struct Reference {
    double period_ns = 1e6;
    double drift = 200e-6;
    double noise_ns = 2000;
    double phase_ns = 0;  ///< of the reference, by the clock; a perfect discipline brings it to 0
    std::mt19937 random{1};

    std::int64_t seen() {
        return std::llround(phase_ns +
                            (noise_ns > 0 ? std::normal_distribution<>(0, noise_ns)(random) : 0.0));
    }
    void pass(std::int64_t step) { phase_ns += drift * period_ns - static_cast<double>(step); }
    std::int64_t turn(Discipline& discipline) {
        const std::int64_t step = discipline.follow(seen(), static_cast<std::int64_t>(period_ns));
        pass(step);
        return step;
    }
    /// Returns the root mean square of the true phase over `periods`.
    double rms(Discipline& discipline, int periods) {
        double sum = 0;
        for (int i = 0; i < periods; ++i) {
            turn(discipline);
            sum += phase_ns * phase_ns;
        }
        return std::sqrt(sum / periods);
    }
};

TEST(Discipline, Holds_a_reference_200_ppm_off_with_2_us_of_noise_to_a_quarter_of_that) {
    for (const unsigned seed : {1u, 2u, 3u, 4u, 5u}) {
        Reference reference{.phase_ns = 300'000};
        reference.random.seed(seed);
        Discipline discipline;
        reference.rms(discipline, 200);
        EXPECT_LT(reference.rms(discipline, 5000), 700) << seed;
        EXPECT_TRUE(discipline.locked());
        EXPECT_NEAR(discipline.rate(), 200e-6, 100e-6);
        EXPECT_NEAR(discipline.scatter_ns(), 1700, 900);
    }
}

TEST(Discipline, Does_the_same_at_100_us) {
    Reference reference{.period_ns = 1e5, .phase_ns = -40'000};
    Discipline discipline;
    reference.rms(discipline, 200);
    EXPECT_LT(reference.rms(discipline, 5000), 700);
}

TEST(Discipline, Converges_exactly_to_an_exact_reference) {
    Reference reference{.noise_ns = 0, .phase_ns = -450'000};
    Discipline discipline;
    for (int i = 0; i < 300; ++i) {
        reference.turn(discipline);
    }
    EXPECT_LE(reference.rms(discipline, 100), 1.0);
    EXPECT_NEAR(discipline.rate(), 200e-6, 1e-6);
}

TEST(Discipline, Brings_a_fraction_of_a_nanosecond_per_period_to_account) {
    // 0.3 ns in ten periods: far below one adjustment
    Reference reference{.drift = 3e-10, .noise_ns = 0};
    Discipline discipline;
    for (int i = 0; i < 100'000; ++i) {
        reference.turn(discipline);
    }
    EXPECT_LT(std::abs(reference.phase_ns), 5.0) << "there is no dead band";
}

TEST(Discipline, Acquires_the_phase_in_steps_of_its_limit_and_overshoots_by_no_more_than_noise) {
    Reference reference{.phase_ns = 450'000};
    Discipline discipline;
    int periods = 0;
    for (double before = reference.phase_ns; reference.phase_ns > 5000;
         before = reference.phase_ns, ++periods) {
        ASSERT_LE(std::abs(reference.turn(discipline)), 100'000);
        ASSERT_LT(reference.phase_ns, before);
        ASSERT_FALSE(discipline.locked());
    }
    EXPECT_LE(periods, 6);
    for (int i = 0; i < 50; ++i) {
        reference.turn(discipline);
        ASSERT_GT(reference.phase_ns, -8000);
    }
}

TEST(Discipline, A_step_obeys_the_limit_it_is_given) {
    Discipline discipline;
    EXPECT_EQ(discipline.follow(-450'000, 4'000'000, 100'000), -100'000);
    EXPECT_EQ(discipline.follow(-350'000, 4'000'000, 100'000), -100'000);
}

TEST(Discipline, Delayed_references_hardly_count) {
    Reference reference{.noise_ns = 200};
    Discipline discipline;
    reference.rms(discipline, 500);
    for (int i = 0; i < 100; ++i) {
        // behind a long frame of lower priority; three in a row at most
        reference.phase_ns += 130'000;
        for (int k = 0; k < 1 + i % 3; ++k) {
            const std::int64_t step = discipline.follow(reference.seen(), 1'000'000);
            reference.pass(step);
        }
        reference.phase_ns -= 130'000;
        reference.rms(discipline, 20);
        ASSERT_LT(std::abs(reference.phase_ns), 1000) << i;
        ASSERT_NEAR(discipline.rate(), 200e-6, 20e-6);
    }
}

TEST(Discipline, A_reference_with_a_new_phase_is_adopted_at_once_with_the_rate_kept) {
    Reference reference{.noise_ns = 200};
    Discipline discipline;
    reference.rms(discipline, 500);
    reference.phase_ns += 300'000;
    for (int i = 0; i < 4 + 3; ++i) {
        reference.turn(discipline);
    }
    reference.rms(discipline, 20);
    EXPECT_LT(std::abs(reference.phase_ns), 1000);
    EXPECT_NEAR(discipline.rate(), 200e-6, 100e-6);
}

TEST(Discipline, Coasts_at_the_rate_it_has_found) {
    Reference reference{.noise_ns = 200};
    Discipline discipline;
    EXPECT_EQ(discipline.coast(1'000'000), 0) << "nothing is known yet";
    reference.rms(discipline, 2000);
    for (int i = 0; i < 100; ++i) {
        reference.pass(discipline.coast(1'000'000));
    }
    EXPECT_LT(std::abs(reference.phase_ns), 1500) << "without it the clock would be 20 us off";
}

TEST(Discipline, Forgets_the_phase_and_keeps_the_rate_when_the_reference_is_lost) {
    Reference reference{.noise_ns = 200};
    Discipline discipline;
    reference.rms(discipline, 500);
    discipline.lose();
    EXPECT_FALSE(discipline.locked());
    reference.phase_ns = -80'000;
    for (int i = 0; i < 20; ++i) {
        reference.turn(discipline);
        ASSERT_NEAR(discipline.rate(), 200e-6, 50e-6);
    }
    EXPECT_LT(reference.rms(discipline, 100), 200);
    EXPECT_TRUE(discipline.locked());
}

TEST(Discipline, Is_locked_by_sixteen_near_periods_and_no_longer_when_they_are_twice_as_far) {
    Discipline discipline({.lock_ns = 1000});
    for (int i = 0; i < 15; ++i) {
        discipline.follow(0, 1'000'000);
    }
    EXPECT_FALSE(discipline.locked());
    discipline.follow(0, 1'000'000);
    EXPECT_TRUE(discipline.locked());
    for (int i = 0; i < 40; ++i) {
        discipline.follow(i % 2 ? 1900 : -1900, 1'000'000);
    }
    EXPECT_TRUE(discipline.locked());
    for (int i = 0; i < 40; ++i) {
        discipline.follow(i % 2 ? 2200 : -2200, 1'000'000);
    }
    EXPECT_FALSE(discipline.locked());
}

TEST(Discipline, Gives_up_on_a_reference_that_moves_with_the_clock) {
    Discipline discipline;
    std::int64_t sum = 0;
    // no adjustment changes the phase of the reference
    for (int i = 0; i < 10'000; ++i) {
        sum += discipline.follow(250'000, 1'000'000);
    }
    EXPECT_TRUE(discipline.in_vain());
    EXPECT_LT(sum, 3'000'000);
    EXPECT_FALSE(discipline.locked());
    discipline.lose();
    EXPECT_FALSE(discipline.in_vain());
}

/// As a follower measures it, within half a period.
std::int64_t folded(double error_ns, double period_ns) {
    return std::llround(std::remainder(error_ns, period_ns));
}

TEST(Discipline, Distinguishes_a_reference_with_another_period_from_a_feedback_loop) {
    for (const double drift : {15e-3, -15e-3, 0.1, 0.3}) {
        Reference reference{.drift = drift, .noise_ns = 2000};
        Discipline discipline;
        const auto follow = [&](int events) {
            bool vain = false;
            for (int i = 0; i < events; ++i) {
                const std::int64_t error =
                    folded(static_cast<double>(reference.seen()), reference.period_ns);
                reference.pass(discipline.follow(error, 1'000'000));
                vain = vain || discipline.in_vain();
            }
            return vain;
        };
        EXPECT_FALSE(follow(5000)) << drift;
        EXPECT_FALSE(discipline.locked()) << drift;
        reference.drift = 200e-6;
        EXPECT_FALSE(follow(1000)) << drift;
        EXPECT_TRUE(discipline.locked()) << drift << ": its period is right";
        EXPECT_NEAR(discipline.rate(), 200e-6, 100e-6) << drift;
    }
}

TEST(Discipline, Follows_a_reference_that_no_longer_moves_with_the_clock) {
    Discipline discipline;
    for (int i = 0; i < 10'000; ++i) {
        discipline.follow(250'000, 1'000'000);
    }
    ASSERT_TRUE(discipline.in_vain());
    Reference other{.drift = 5e-3, .noise_ns = 2000};
    for (int i = 0; i < 100; ++i) {
        other.pass(discipline.follow(folded(static_cast<double>(other.seen()), 1e6), 1'000'000));
    }
    EXPECT_FALSE(discipline.in_vain());
    other.drift = 200e-6;
    for (int i = 0; i < 1000; ++i) {
        other.pass(discipline.follow(folded(static_cast<double>(other.seen()), 1e6), 1'000'000));
    }
    EXPECT_TRUE(discipline.locked());
}

TEST(Discipline, Does_not_give_up_on_a_reference_with_much_noise) {
    Reference reference{.noise_ns = 80'000};
    Discipline discipline({.lock_ns = 10'000});
    for (int i = 0; i < 100'000; ++i) {
        reference.turn(discipline);
    }
    EXPECT_FALSE(discipline.locked());
    EXPECT_FALSE(discipline.in_vain());
}

TEST(Discipline, A_rate_that_no_clock_has_is_not_followed) {
    Reference reference{.drift = 5e-3, .noise_ns = 0};
    Discipline discipline;
    reference.rms(discipline, 500);
    EXPECT_LE(std::abs(discipline.rate()), 1e-3);
}

}  // namespace
}  // namespace hal::test
