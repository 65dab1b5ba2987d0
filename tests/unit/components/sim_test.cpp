// SPDX-License-Identifier: MIT
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <vector>

#include "components/sim/furuta_dynamics.hpp"
#include "unit/components/component_host.hpp"

namespace {

using hal::test::Instance;
using std::numbers::pi;

constexpr std::int64_t base_ns = 100'000;

/// A furuta without friction and with the amplifier off.
struct FreeFuruta : Instance {
    explicit FreeFuruta(const char* pendulum = "0", const char* arm = "0")
        : Instance("furuta", {{"pendulum_angle", pendulum}, {"arm_angle", arm}}) {
        for (const char* friction :
             {"arm-viscous", "arm-coulomb", "pendulum-viscous", "pendulum-coulomb"}) {
            set(friction, 0.0);
        }
        set("enable", false);
    }
};

/// The constants of the default rig, from the manual's own words: bars and rods.
struct Rig {
    double L = 0.2;
    double l = 0.15;
    double m = 0.1;
    double arm_mass = 0.2;
    double rotor = 7.5e-5;
    double g = 9.80665;
    double J = rotor + 6.667e-4 + arm_mass * 0.1 * 0.1 + m * L * L;
    double K = 7.5e-4 + m * l * l;
};

TEST(Furuta, Energy_is_kept_without_friction_and_motor) {
    FreeFuruta furuta("3.0", "0.4");
    furuta.run("update", base_ns);
    const double start = furuta.get<double>("energy");
    EXPECT_NEAR(start, Rig{}.m * Rig{}.g * Rig{}.l * (1 - std::cos(3.0)), 1e-6);
    double fastest = 0.0;
    for (int i = 0; i < 6000; ++i) {  // a minute, chaotic tumbling of both links
        furuta.run("update", base_ns, 100);
        ASSERT_NEAR(furuta.get<double>("energy"), start, 1e-9 * start);
        fastest = std::max(fastest, std::abs(furuta.get<double>("arm-velocity")));
    }
    EXPECT_GT(fastest, 3.0);  // the links did exchange energy
}

TEST(Furuta, Energy_does_not_depend_on_the_thread_period) {
    FreeFuruta fine("2.0"), coarse("2.0");
    fine.run("update", 50'000, 20'000);
    coarse.run("update", 1'000'000, 1000);
    EXPECT_NEAR(fine.get<double>("pendulum-angle"), coarse.get<double>("pendulum-angle"), 1e-7);
    EXPECT_NEAR(fine.get<double>("arm-angle"), coarse.get<double>("arm-angle"), 1e-7);
}

/// Mean period of the swing over `swings` zero crossings upwards.
double period_of_swing(Instance& furuta, int swings) {
    double last = 0.0;
    double first_at = 0.0;
    double at = 0.0;
    int seen = -1;
    for (std::int64_t cycle = 1; seen < swings; ++cycle) {
        furuta.run("update", base_ns);
        const double now = furuta.get<double>("pendulum-angle");
        if (last < 0.0 && now >= 0.0) {
            at = (static_cast<double>(cycle) - now / (now - last)) * 1e-9 * base_ns;
            if (++seen == 0) {
                first_at = at;
            }
        }
        last = now;
    }
    return (at - first_at) / swings;
}

TEST(Furuta, Small_swings_have_the_frequency_of_the_linear_equations) {
    const Rig rig;
    FreeFuruta free("0.001");
    const double c = rig.m * rig.L * rig.l;
    EXPECT_NEAR(2 * pi / period_of_swing(free, 10),
                std::sqrt(rig.m * rig.g * rig.l * rig.J / (rig.J * rig.K - c * c)), 1e-4);

    FreeFuruta held("0.001");
    held.set("rotor-inertia", 1e6);
    EXPECT_NEAR(2 * pi / period_of_swing(held, 10), std::sqrt(rig.m * rig.g * rig.l / rig.K), 1e-4);
}

TEST(Furuta, A_free_swing_halves_in_some_fifteen_seconds) {
    Instance furuta("furuta", {{"pendulum_angle", "0.5"}});
    furuta.set("enable", false);
    furuta.set("rotor-inertia", 1e6);
    double max = 0.0;
    for (int i = 0; i < 16000; ++i) {
        furuta.run("update", 1'000'000);
        if (i >= 14000) {
            max = std::max(max, furuta.get<double>("pendulum-angle"));
        }
    }
    EXPECT_NEAR(max, 0.25, 0.05);
}

TEST(Furuta, Push_gives_the_centre_of_mass_its_speed_and_is_taken_back) {
    FreeFuruta furuta;
    furuta.set("push", 0.2);
    furuta.run("update", 1'000);
    EXPECT_EQ(furuta.get<double>("push"), 0.0);
    EXPECT_NEAR(furuta.get<double>("pendulum-velocity"), 0.2 / 0.15, 1e-4);
    // J q' + c a' of the linear equations is untouched: the arm recoils
    EXPECT_NEAR(furuta.get<double>("arm-velocity"), -0.1 * 0.2 * 0.15 / Rig{}.J * 0.2 / 0.15, 1e-4);
    furuta.run("update", 1'000);
    EXPECT_NEAR(furuta.get<double>("pendulum-velocity"), 0.2 / 0.15, 1e-3);  // once only
}

TEST(Furuta, Amplifier_limits_the_current) {
    Instance furuta("furuta");
    furuta.set("rotor-inertia", 1e6);  // the arm stands: no back-EMF
    furuta.set("voltage", 24.0);
    furuta.run("update", base_ns, 1000);
    EXPECT_DOUBLE_EQ(furuta.get<double>("motor-current"), 4.0);
    EXPECT_DOUBLE_EQ(furuta.get<double>("motor-torque"), 4.0 * 0.0677);
    furuta.set("voltage", -1.36);
    furuta.run("update", base_ns, 1000);
    EXPECT_NEAR(furuta.get<double>("motor-current"), -2.0, 1e-6);
    furuta.set("voltage", 0.0);
    furuta.set("pwm", true);
    furuta.set("dir", true);
    furuta.run("update", base_ns, 1000);
    EXPECT_DOUBLE_EQ(furuta.get<double>("motor-current"), -4.0);
    furuta.set("enable", false);
    furuta.run("update", base_ns);
    EXPECT_EQ(furuta.get<double>("motor-current"), 0.0);
}

TEST(Furuta, Pendulum_encoder_arrives_late_by_the_radio_delay) {
    FreeFuruta furuta("1.0");
    furuta.set("radio-delay", 0.005);
    std::vector<std::int32_t> due;
    for (int i = 0; i < 3000; ++i) {
        furuta.run("update", base_ns);
        due.push_back(static_cast<std::int32_t>(
            std::floor(furuta.get<double>("pendulum-angle") * 2000 / (2 * pi) + 0.5)));
        const std::size_t sent = static_cast<std::size_t>(std::max(0, i - 50));
        ASSERT_EQ(furuta.get<std::int32_t>("pendulum-counts"), due[sent]) << i;
        ASSERT_EQ(furuta.get<std::int32_t>("arm-counts"),
                  static_cast<std::int32_t>(
                      std::floor(furuta.get<double>("arm-angle") * 2000 / (2 * pi) + 0.5)));
    }
    EXPECT_LT(due.back(), 0);
}

TEST(Furuta, Quadrature_outputs_decode_to_the_counts) {
    FreeFuruta furuta("2.5");
    Instance arm("encoder"), pendulum("encoder");
    const auto sample = [&] {
        furuta.run("update", base_ns);
        for (const char* phase : {"phase-A", "phase-B", "phase-Z"}) {
            arm.set(phase, furuta.get<bool>(std::string("arm-") + phase));
            pendulum.set(phase, furuta.get<bool>(std::string("pendulum-") + phase));
        }
        arm.run("update-counters", base_ns);
        pendulum.run("update-counters", base_ns);
    };
    sample();
    const std::int32_t start = furuta.get<std::int32_t>("pendulum-counts");
    for (int i = 0; i < 20'000; ++i) {
        sample();
        ASSERT_EQ(arm.get<std::int32_t>("rawcounts"), furuta.get<std::int32_t>("arm-counts"));
        ASSERT_EQ(pendulum.get<std::int32_t>("rawcounts"),
                  furuta.get<std::int32_t>("pendulum-counts") - start);
        ASSERT_EQ(furuta.get<bool>("pendulum-phase-Z"),
                  furuta.get<std::int32_t>("pendulum-counts") % 2000 == 0);
    }
    EXPECT_EQ(pendulum.get<std::uint32_t>("quad-errors"), 0u);
}

using Vector = std::array<double, 3>;

Vector cross(const Vector& a, const Vector& b) {
    return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}

/// tip_ratio the long way: arm and rod as rows of mass points, their accelerations by differences
/// of positions.
double tip_ratio_of_points(const sim::FurutaDynamics& rig, const sim::FurutaState& s,
                           double torque) {
    constexpr double h = 1e-4;
    constexpr int parts = 400;
    const std::array<sim::FurutaState, 3> states{rig.step(s, torque, -h), s,
                                                 rig.step(s, torque, h)};
    Vector moment{};
    double force_up = rig.base_mass * rig.gravity;
    const auto add = [&](double mass, auto place) {
        const Vector before = place(states[0]);
        const Vector now = place(states[1]);
        const Vector after = place(states[2]);
        Vector force;
        for (std::size_t i = 0; i < 3; ++i) {
            force[i] = mass * ((before[i] - 2 * now[i] + after[i]) / (h * h) +
                               (i == 2 ? rig.gravity : 0.0));
        }
        const Vector m = cross(now, force);
        for (std::size_t i = 0; i < 3; ++i) {
            moment[i] += m[i];
        }
        force_up += force[2];
    };
    for (int part = 0; part < parts; ++part) {
        const double along = 2.0 * (part + 0.5) / parts;
        add(rig.arm_mass / parts, [&](const sim::FurutaState& at) {
            return Vector{rig.arm_centre * along * std::cos(at.arm),
                          rig.arm_centre * along * std::sin(at.arm), rig.base_height};
        });
        add(rig.pendulum_mass / parts, [&](const sim::FurutaState& at) {
            const double r = rig.pendulum_centre * along;
            const double out = r * std::sin(at.pendulum);
            return Vector{rig.arm_length * std::cos(at.arm) - out * std::sin(at.arm),
                          rig.arm_length * std::sin(at.arm) + out * std::cos(at.arm),
                          rig.base_height - r * std::cos(at.pendulum)};
        });
    }
    return std::hypot(moment[0], moment[1]) / (force_up * rig.base_radius);
}

TEST(Furuta, Tip_ratio_is_that_of_the_sum_over_mass_points) {
    const Rig p;
    sim::FurutaDynamics rig{.gravity = p.g,
                            .arm_length = p.L,
                            .arm_mass = p.arm_mass,
                            .arm_centre = 0.1,
                            .arm_inertia = p.J - p.m * p.L * p.L,
                            .arm_viscous = 1e-3,
                            .arm_coulomb = 0,
                            .pendulum_mass = p.m,
                            .pendulum_centre = p.l,
                            .pendulum_inertia = 7.5e-4,
                            .pendulum_viscous = 1e-3,
                            .pendulum_coulomb = 0,
                            .base_mass = 2.5,
                            .base_radius = 0.08,
                            .base_height = 0.4};
    const std::array<sim::FurutaState, 5> states{
        {{0, 0, 0, 0}, {0.3, 0.7, 2, -3}, {-1, 2.5, -6, 4}, {2, -1.2, 9, 11}, {0.1, 3.1, 0, -14}}};
    for (const auto& s : states) {
        for (const double torque : {0.0, 0.25}) {
            const double expected = tip_ratio_of_points(rig, s, torque);
            EXPECT_NEAR(rig.tip_ratio(s, rig.acceleration(s, torque)), expected, 1e-3 * expected)
                << s.pendulum << ' ' << torque;
        }
    }
}

TEST(Furuta, Base_lifts_when_the_arm_spins_and_falls_back) {
    FreeFuruta furuta;
    furuta.run("update", base_ns);
    // weights only: (m_arm * 0.1 + m * 0.2) / (all * radius of the foot)
    EXPECT_NEAR(furuta.get<double>("tip-ratio"), (0.2 * 0.1 + 0.1 * 0.2) / (2.8 * 0.08), 1e-9);
    EXPECT_TRUE(furuta.get<bool>("base-down"));
    EXPECT_FALSE(furuta.get<bool>("base-lifted"));
    furuta.set("enable", true);
    furuta.set("voltage", 24.0);
    std::uint64_t cycles = 0;
    while (furuta.get<bool>("base-down") && ++cycles < 20'000) {
        furuta.run("update", base_ns);
    }
    EXPECT_GT(furuta.get<double>("tip-ratio"), 1.0);
    EXPECT_TRUE(furuta.get<bool>("base-lifted"));
    EXPECT_GT(std::abs(furuta.get<double>("arm-velocity")), 5.0);
    furuta.set("reset", true);
    furuta.run("update", base_ns);
    EXPECT_TRUE(furuta.get<bool>("base-down"));
    furuta.set("lift", true);
    furuta.run("update", base_ns);
    EXPECT_FALSE(furuta.get<bool>("base-down"));
}

TEST(Furuta, Nonsense_parameters_do_not_poison_the_state) {
    Instance furuta("furuta");
    furuta.set("pendulum-mass", 0.0);
    furuta.set("pendulum-inertia", 0.0);
    furuta.set("push", 1.0);
    furuta.run("update", base_ns, 10);
    furuta.set("pendulum-mass", std::nan(""));
    furuta.run("update", base_ns, 10);
    furuta.set("push", std::nan(""));
    furuta.run("update", base_ns, 10);
    furuta.set("pendulum-mass", 0.1);
    furuta.run("update", base_ns, 10);
    EXPECT_TRUE(std::isfinite(furuta.get<double>("pendulum-angle")));
}

TEST(DcMotor, Settles_at_the_speed_of_the_closed_form) {
    Instance motor("dc_motor");
    motor.set("coulomb", 0.0);
    motor.set("current-limit", 0.0);
    motor.set("voltage", 12.0);
    motor.run("update", base_ns, 20'000);
    const double k = 0.0677;
    const double speed = 12.0 * k / (k * k + 0.68 * 1e-4);
    EXPECT_NEAR(motor.get<double>("velocity"), speed, 1e-6 * speed);
    EXPECT_NEAR(motor.get<double>("current"), 1e-4 * speed / k, 1e-6);
    motor.set("load-torque", 0.05);
    motor.run("update", base_ns, 20'000);
    EXPECT_NEAR(motor.get<double>("velocity"), (12.0 * k - 0.68 * 0.05) / (k * k + 0.68 * 1e-4),
                1e-6 * speed);
}

TEST(DcMotor, Current_rises_with_the_time_constant_of_the_winding_up_to_the_limit) {
    Instance motor("dc_motor");
    motor.set("inertia", 1e6);
    motor.set("coulomb", 0.0);
    motor.set("voltage", 2.0);
    motor.run("update", base_ns, 10);  // 1 ms; L / R is 1.47 ms
    EXPECT_NEAR(motor.get<double>("current"), 2.0 / 0.68 * (1 - std::exp(-0.68)), 1e-6);
    motor.set("voltage", 24.0);
    motor.run("update", base_ns, 100);
    EXPECT_DOUBLE_EQ(motor.get<double>("current"), 4.0);
    motor.set("inductance", 0.0);
    motor.set("voltage", 1.7);
    motor.run("update", base_ns);
    EXPECT_NEAR(motor.get<double>("current"), 2.5, 1e-6);
}

TEST(DcMotor, Accelerates_by_the_current_limit_and_moves_the_screw) {
    Instance motor("dc_motor");
    motor.set("viscous", 0.0);
    motor.set("coulomb", 0.0);
    motor.set("inductance", 0.0);
    motor.set("pitch", 5.0);
    motor.set("max-position", 1.0);
    motor.set("pwm", true);
    // 0.1 s at 4 A: 0.2708 N*m on 2e-4 kg*m^2 stays below the no-load speed
    motor.run("update", base_ns, 1000);
    const double a = 4.0 * 0.0677 / 2e-4;
    // half a step less: the torque is the mean of a step
    EXPECT_NEAR(motor.get<double>("velocity"), a * 0.1, 0.2);
    EXPECT_NEAR(motor.get<double>("position"), 0.5 * a * 0.01 / (2 * pi) * 5.0, 0.02);
    EXPECT_EQ(
        motor.get<std::int32_t>("counts"),
        static_cast<std::int32_t>(std::floor(motor.get<double>("angle") * 2000 / (2 * pi) + 0.5)));
    EXPECT_TRUE(motor.get<bool>("at-max"));
    EXPECT_FALSE(motor.get<bool>("at-min"));
}

}  // namespace
