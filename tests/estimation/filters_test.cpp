// SPDX-License-Identifier: MIT
// Kalman filters and filters with bad, late and missing measurements; NaN, and comparisons sample
// by sample.
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numbers>
#include <random>

// Eigen stops the test when it takes memory where the cycle runs.
#define EIGEN_RUNTIME_NO_MALLOC
#undef eigen_assert
#define eigen_assert(x)                       \
    do {                                      \
        if (!(x)) throw std::logic_error(#x); \
    } while (false)
#include "estimation/past.hpp"
#include "unit/components/component_host.hpp"

namespace {

using hal::test::Arguments;
using hal::test::Instance;
using namespace hal::estimation;
constexpr double nan = std::numeric_limits<double>::quiet_NaN();

const Arguments sled{{"a", "1,0.001;0,1"},     {"b", "0;0.001"}, {"c", "1,0"},
                     {"qn", "1e-12,0;0,1e-6"}, {"rn", "1e-6"},   {"x0", "0,0"},
                     {"p0", "diag 1e-4 1"}};

std::string refusal(const std::string& component, const Arguments& arguments) {
    try {
        Instance refused(component, arguments);
    } catch (const std::runtime_error& e) {
        return e.what();
    }
    return "";
}

void expect_refused(const std::string& component, const Arguments& arguments, const char* why) {
    EXPECT_NE(refusal(component, arguments).find(why), std::string::npos)
        << refusal(component, arguments);
}

TEST(Kalman, Late_measurements_give_the_estimate_that_they_would_have_given_in_time) {
    Instance in_time("kalman", sled), late("kalman", sled);
    late.set("age-0", 0.003);
    std::vector<double> places, speeds;
    std::mt19937 random(3);
    std::normal_distribution<double> noise(0.0, 1e-3);
    double x = 0.0;
    double v = 0.0;
    std::vector<double> z;
    for (int k = 0; k < 500; ++k) {
        const double u = std::sin(0.02 * k);
        if (k > 0) {
            x += 0.001 * v;
            v += 0.001 * u;
        }
        z.push_back(x + noise(random));
        in_time.set("u-0", k > 0 ? u : 0.0);
        late.set("u-0", k > 0 ? u : 0.0);
        in_time.set("z-0", z.back());
        in_time.run("update");
        late.set("new-0", k >= 3);
        late.set("z-0", k >= 3 ? z[static_cast<std::size_t>(k - 3)] : 0.0);
        late.run("update");
        places.push_back(in_time.get<double>("x-0"));
        speeds.push_back(in_time.get<double>("x-1"));
        // led on by three steps from the estimate of then, with the inputs since
        if (k >= 3) {
            double place = places[static_cast<std::size_t>(k - 3)];

            double speed = speeds[static_cast<std::size_t>(k - 3)];
            for (int j = k - 2; j <= k; ++j) {
                place += 0.001 * speed;
                speed += 0.001 * std::sin(0.02 * j);
            }
            ASSERT_NEAR(late.get<double>("x-0"), place, 1e-12);
            ASSERT_NEAR(late.get<double>("x-1"), speed, 1e-11);
        }
    }
    EXPECT_EQ(late.get<std::uint32_t>("late"), 0u);
}

TEST(Kalman, What_is_no_number_or_too_old_is_left_out_and_counted) {
    Instance filter("kalman", sled);
    filter.set("z-0", 0.5);
    filter.run("update", 1'000'000, 200);
    const double before = filter.get<double>("x-0");
    const double sure = filter.get<double>("sigma-0");
    filter.set("z-0", nan);
    filter.run("update", 1'000'000, 50);
    EXPECT_EQ(filter.get<std::uint32_t>("skipped"), 50u);
    EXPECT_NEAR(filter.get<double>("x-0"), before, 1e-3);
    EXPECT_GT(filter.get<double>("sigma-0"), sure);  // and knows that it knows less
    filter.set("z-0", 9.0);
    filter.set("age-0", 1.0);
    filter.run("update");
    EXPECT_EQ(filter.get<std::uint32_t>("late"), 1u);
    EXPECT_NEAR(filter.get<double>("x-0"), before, 1e-3);
}

TEST(Kalman, Outliers_stay_beyond_the_gate_and_silence_makes_it_invalid) {
    Instance filter("kalman", sled);
    filter.set("gate", 5.0);
    filter.set("timeout", 0.01);
    EXPECT_FALSE(filter.get<bool>("valid"));
    filter.run("update", 1'000'000, 100);
    EXPECT_TRUE(filter.get<bool>("valid"));
    filter.set("z-0", 1.0);
    filter.run("update", 1'000'000, 9);
    EXPECT_EQ(filter.get<std::uint32_t>("outliers"), 9u);
    EXPECT_NEAR(filter.get<double>("x-0"), 0.0, 1e-3);
    EXPECT_TRUE(filter.get<bool>("valid"));
    filter.run("update", 1'000'000, 5);
    EXPECT_FALSE(filter.get<bool>("valid"));
}

TEST(Kalman, A_covariance_that_is_lost_starts_again_and_is_counted) {
    Instance filter("kalman", {{"a", "2"}, {"c", "1"}, {"qn", "1"}, {"rn", "1"}});
    filter.set("z-0", 3.0);
    filter.set("new-0", false);
    filter.run("update", 1'000'000, 600);  // it grows fourfold in each cycle, beyond all numbers
    EXPECT_EQ(filter.get<std::uint32_t>("renewals"), 1u);
    EXPECT_TRUE(std::isfinite(filter.get<double>("sigma-0")));
    filter.set("new-0", true);
    filter.run("update", 1'000'000, 100);
    EXPECT_TRUE(filter.get<bool>("valid"));
    // Riccati's equation for these
    EXPECT_NEAR(filter.get<double>("sigma-0"), std::sqrt((2 + std::sqrt(5)) / (3 + std::sqrt(5))),
                1e-9);
}

TEST(Kalman, Measurements_with_dependent_noises_are_taken_together_or_not_at_all) {
    Instance filter("kalman", {{"a", "1"}, {"c", "1;1"}, {"qn", "1e-4"}, {"rn", "1,0.5;0.5,1"}});
    filter.set("z-0", 1.0);
    filter.set("z-1", nan);
    filter.run("update");
    EXPECT_EQ(filter.get<std::uint32_t>("skipped"), 1u);
    EXPECT_EQ(filter.get<double>("x-0"), 0.0);
    filter.set("z-1", 1.0);
    filter.run("update", 1'000'000, 3000);
    EXPECT_NEAR(filter.get<double>("x-0"), 1.0, 1e-6);
}

TEST(Kalman, A_plant_that_cannot_be_seen_is_refused_by_name) {
    expect_refused("kalman", {{"a", "1,0;0,1.5"}, {"c", "1,0"}, {"qn", "diag 1 1"}, {"rn", "1"}},
                   "undetectable: no measurement shows its mode at 1.5, strongest in state 1");
    // dies out by itself
    EXPECT_EQ(
        refusal("kalman", {{"a", "1,0;0,0.5"}, {"c", "1,0"}, {"qn", "diag 1 1"}, {"rn", "1"}}), "");
    expect_refused("kalman", {{"a", "1,0;0,1"}, {"c", "1,0,0"}, {"qn", "diag 1 1"}, {"rn", "1"}},
                   "C is 1 x 3, not 1 x 2");
    expect_refused("kalman", {{"a", "1"}, {"c", "1"}, {"qn", "1"}, {"rn", "0"}},
                   "RN is not positive");
    expect_refused("kalman",
                   {{"a", "1,0;0,1"}, {"c", "1,0;0,1"}, {"qn", "1,2;0,1"}, {"rn", "diag 1 1"}},
                   "QN is not symmetric");
}

TEST(Lqr, A_plant_that_cannot_be_steered_is_refused_by_name) {
    expect_refused("lqr",
                   {{"a", "0,1,0;0,0,0;0,0,2"}, {"b", "0;1;0"}, {"q", "diag 1 1 1"}, {"r", "1"}},
                   "no input reaches its mode at 2, strongest in state 2");
    expect_refused("lqr", {{"a", "0,1;0,0"}, {"b", "0;1"}, {"q", "diag 0 1"}, {"r", "1"}},
                   "the cost does not observe the plant's mode at 0, strongest in state 0");
    expect_refused("lqr", {{"a", "0,1;0,0"}, {"b", "0;1"}, {"q", "diag 1 1"}, {"r", "-1"}},
                   "R is not positive");
    expect_refused("lqr", {{"a", "0,1;0"}, {"b", "0;1"}, {"q", "diag 1 1"}, {"r", "1"}},
                   "row 2 of A has 1 number, its first has 2");
    expect_refused("lqr", {{"b", "0;1"}}, "A is missing");
}

TEST(Lqr, New_weights_make_a_new_gain_outside_of_the_cycle_and_bad_ones_leave_the_old) {
    Instance lqr("lqr", {{"a", "0"}, {"b", "1"}, {"q", "1"}, {"r", "1"}});
    EXPECT_NEAR(lqr.get<double>("gain-0-0"), 1.0, 1e-12);  // sqrt(q / r)
    const auto wait = [&] {
        lqr.run("update");
        while (lqr.get<bool>("designing")) {
            lqr.run("update");
        }
    };
    lqr.set("q-0", 9.0);
    wait();
    EXPECT_NEAR(lqr.get<double>("gain-0-0"), 3.0, 1e-12);
    EXPECT_EQ(lqr.get<std::uint32_t>("designs"), 1u);
    for (const double bad : {-1.0, nan}) {
        lqr.set("r-0", bad);
        wait();
        EXPECT_TRUE(lqr.get<bool>("rejected"));
        EXPECT_NEAR(lqr.get<double>("gain-0-0"), 3.0, 1e-12);
    }
    lqr.set("r-0", 1.0);
    wait();
    EXPECT_FALSE(lqr.get<bool>("rejected"));
    lqr.set("x-0", 2.0);
    lqr.run("update");
    EXPECT_NEAR(lqr.get<double>("u-0"), -6.0, 1e-12);
    lqr.set("x-0", nan);
    lqr.run("update");
    EXPECT_NEAR(lqr.get<double>("u-0"), -6.0, 1e-12);
    EXPECT_EQ(lqr.get<std::uint32_t>("bad-inputs"), 1u);
}

TEST(Joseph, Keeps_a_covariance_symmetric_and_positive_where_the_short_form_does_not) {
    // one measurement 1e10 times as good as what was known, over and over
    const Eigen::Index n = 3;
    Vector x = Vector::Zero(n), c(n);
    Matrix p = Matrix::Identity(n, n) * 1e6;
    Matrix q = Matrix::Identity(n, n) * 1e-3;

    Matrix a = Matrix::Identity(n, n);
    a(0, 1) = a(1, 2) = 0.01;
    Matrix naive = p;
    bool lost = false;
    Eigen::internal::set_is_malloc_allowed(false);
    for (int k = 0; k < 3000; ++k) {
        c << 1.0, 1e-3 * (k % 7), 1.0 - 1e-9 * (k % 5);
        Matrix next;
        propagate_covariance(next, a, p, q);
        p = next;
        ASSERT_EQ(static_cast<int>(correct(x, p, c, 0.1, 1e-14, 0.0)),
                  static_cast<int>(Correction::used));
        for (Eigen::Index i = 0; i < n; ++i) {
            ASSERT_GE(p(i, i), 0.0) << k;
            for (Eigen::Index j = 0; j < n; ++j) {
                ASSERT_EQ(p(i, j), p(j, i)) << k;
            }
        }
        // the short form: P - kc'P
        Vector pc, unused;
        multiply(next, a, naive);
        for (Eigen::Index i = 0; i < n; ++i) {
            for (Eigen::Index j = 0; j < n; ++j) {
                naive(i, j) = q(i, j);
                for (Eigen::Index l = 0; l < n; ++l) {
                    naive(i, j) += next(i, l) * a(j, l);
                }
            }
        }
        multiply(pc, naive, c);
        double s = 1e-14;
        for (Eigen::Index i = 0; i < n; ++i) {
            s += c(i) * pc(i);
        }
        Vector gain = pc / s;
        Matrix before = naive;
        for (Eigen::Index i = 0; i < n; ++i) {
            for (Eigen::Index j = 0; j < n; ++j) {
                for (Eigen::Index l = 0; l < n; ++l) {
                    naive(i, j) -= gain(i) * c(l) * before(l, j);
                }
            }
        }
        for (Eigen::Index i = 0; i < n; ++i) {
            for (Eigen::Index j = 0; j < n; ++j) {
                lost = lost || naive(i, j) != naive(j, i) || naive(i, i) < 0.0;
            }
        }
    }
    Eigen::internal::set_is_malloc_allowed(true);
    EXPECT_TRUE(lost);  // otherwise this test would prove nothing
}

TEST(Ekf, Follows_a_pendulum_that_it_sees_late_and_noisily) {
    Instance ekf("ekf");
    ekf.set("encoder-age", 0.005);
    std::mt19937 random(5);
    std::normal_distribution<double> noise(0.0, 2e-3);
    double angle = 1.2;
    double speed = 0.0;
    double worst = 0.0;
    std::vector<double> seen;
    for (int k = 0; k < 5000; ++k) {
        const double h = 1e-4;
        for (int i = 0; i < 10; ++i) {
            speed += h * (-9.81 / 0.3 * std::sin(angle) - 0.1 * speed);
            angle += h * speed;
        }
        seen.push_back(angle + noise(random));
        // a turn more: it wraps
        ekf.set("encoder",
                k >= 5 ? seen[static_cast<std::size_t>(k - 5)] + 2.0 * std::numbers::pi : 0.0);
        ekf.set("encoder-new", k >= 5);
        ekf.run("update");
        if (k > 1000) {
            worst = std::max(worst, std::fabs(ekf.get<double>("x-speed") - speed));
        }
    }
    EXPECT_LT(worst, 0.1);  // of up to 6.5 rad/s
    EXPECT_EQ(ekf.get<std::uint32_t>("renewals"), 0u);
    ekf.set("encoder", nan);
    ekf.run("update");
    EXPECT_EQ(ekf.get<std::uint32_t>("skipped"), 1u);
}

TEST(Luenberger, Refuses_what_cannot_be_observed_and_finds_the_speed_where_it_can) {
    expect_refused("luenberger", {{"a", "1,0;0,1"}, {"c", "1,0"}, {"poles", "0.5,0.6"}},
                   "not observable");
    expect_refused("luenberger", {{"a", "1,1;0,1"}, {"c", "1,0"}, {"poles", "0.5,1.6"}},
                   "outside of the unit circle");
    expect_refused("luenberger", {{"a", "1,1;0,1"}, {"c", "1,0"}, {"l", "5;5"}}, "unstable");
    Instance observer("luenberger");
    for (int k = 0; k < 1000; ++k) {
        observer.set("z-0", 0.001 * 3.0 * k);
        observer.run("update");
    }
    EXPECT_NEAR(observer.get<double>("x-1"), 3.0, 1e-6);
    observer.set("z-0", nan);
    observer.run("update");
    EXPECT_NEAR(observer.get<double>("x-1"), 3.0, 1e-6);
    EXPECT_EQ(observer.get<std::uint32_t>("skipped"), 1u);
}

TEST(Filters, Survive_what_is_not_a_number) {
    for (const char* name : {"filter_biquad", "notch", "fir", "savgol_diff"}) {
        Instance filter(name);
        const char* out = std::string(name) == "savgol_diff" ? "smooth" : "out";
        filter.set("in", 0.5);
        filter.run(300);
        // each passes what does not change
        EXPECT_NEAR(filter.get<double>(out), 0.5, 1e-9) << name;
        for (const double bad : {nan, std::numeric_limits<double>::infinity(), 1e308}) {
            filter.set("in", bad);
            filter.run(3);
        }
        filter.set("in", 0.5);
        filter.run(3000);
        EXPECT_NEAR(filter.get<double>(out), 0.5, 1e-9) << name;
        EXPECT_GE(filter.get<std::uint32_t>("bad-inputs"), 6u) << name;
    }
}

/// Amplitude of what a filter makes of a sine of 1 after it has settled, by projection on sine and
/// cosine.
double response(Instance& filter, double hertz) {
    double sine = 0.0;
    double cosine = 0.0;
    const int n = 4000;
    for (int k = 0; k < 2 * n; ++k) {
        const double phase = 2.0 * std::numbers::pi * hertz * 0.001 * k;
        filter.set("in", std::sin(phase));
        filter.run();
        if (k >= n) {
            sine += filter.get<double>("out") * std::sin(phase);

            cosine += filter.get<double>("out") * std::cos(phase);
        }
    }
    return 2.0 / n * std::hypot(sine, cosine);
}

TEST(Filters, Have_the_response_that_their_manual_states) {
    Instance low("filter_biquad", {{"order", "4"}});
    low.set("frequency", 50.0);
    EXPECT_NEAR(response(low, 50.0), std::sqrt(0.5), 1e-3);
    EXPECT_NEAR(response(low, 5.0), 1.0, 1e-3);
    EXPECT_LT(response(low, 200.0), 0.003);
    Instance hum("notch", {{"harmonics", "2"}});
    EXPECT_NEAR(response(hum, 50.0), 0.0, 1e-6);
    EXPECT_NEAR(response(hum, 100.0), 0.0, 1e-6);
    EXPECT_NEAR(response(hum, 10.0), 1.0, 0.02);
    hum.set("frequency", 60.0);
    EXPECT_NEAR(response(hum, 60.0), 0.0, 1e-6);
    Instance fir("fir", {{"length", "61"}, {"corner", "0.05"}});
    EXPECT_NEAR(response(fir, 50.0), 0.5, 0.01);
    EXPECT_LT(response(fir, 100.0), 0.003);
}

TEST(Savgol, Differentiates_a_parabola_exactly) {
    Instance filter("savgol_diff", {{"window", "15"}, {"order", "2"}});
    for (int k = 0; k < 100; ++k) {
        const double t = 0.001 * k;
        filter.set("in", 3.0 + 2.0 * t - 5.0 * t * t);
        filter.run();
    }
    EXPECT_NEAR(filter.get<double>("smooth"), 3.0 + 2.0 * 0.099 - 5.0 * 0.099 * 0.099, 1e-12);
    EXPECT_NEAR(filter.get<double>("slope"), 2.0 - 10.0 * 0.099, 1e-8);
    EXPECT_NEAR(filter.get<double>("curvature"), -10.0, 1e-5);
}

}  // namespace
