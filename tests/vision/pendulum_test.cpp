// SPDX-License-Identifier: MIT
// Angles from rendered frames against the angles they were rendered from. The renderer has its own
// geometry.
#include <cmath>
#include <cstdio>
#include <numbers>

#include "scene_views.hpp"
#include "vision/detect/pendulum.hpp"

namespace {

using namespace hal::vision;
using namespace hal::vision::test;

struct Errors {
    double arm = 0.0;
    double pendulum = 0.0;
    double worst = 0.0;  // rms, rms, greatest of both
    int found = 0;
    int asked = 0;
};

/// 120 attitudes of the pendulum, under one condition.
template <class Change>
Errors measure(const char* what, Change change) {
    const scene::Settings settings;
    Errors errors;
    for (int i = 0; i < 120; ++i) {
        const double arm = spread(i, 2.0, -1.0, 1.0);

        const double pendulum = spread(i, 3.0, -std::numbers::pi, std::numbers::pi);
        scene::State state = rig_state(arm, pendulum);
        change(state);
        const PendulumSeen seen =
            find_pendulum(frame_of(settings, state, state, static_cast<std::uint64_t>(i)), {}, {});
        ++errors.asked;
        if (!seen.found) continue;
        const double off_arm = seen.arm - arm;

        const double off_pendulum =
            std::remainder(seen.pendulum - pendulum, 2.0 * std::numbers::pi);
        ++errors.found;
        errors.arm += off_arm * off_arm;
        errors.pendulum += off_pendulum * off_pendulum;
        errors.worst =
            std::fmax(errors.worst, std::fmax(std::fabs(off_arm), std::fabs(off_pendulum)));
    }
    errors.arm = std::sqrt(errors.arm / errors.found);

    errors.pendulum = std::sqrt(errors.pendulum / errors.found);
    std::printf(
        "%s: %d of %d found, arm %.2f mrad rms, pendulum %.2f mrad rms, greatest %.2f mrad\n", what,
        errors.found, errors.asked, errors.arm * 1e3, errors.pendulum * 1e3, errors.worst * 1e3);
    return errors;
}

TEST(Pendulum, angles_are_right_to_a_milliradian) {
    const Errors errors = measure("noise 3", [](scene::State&) {});
    EXPECT_GE(errors.found, 117);
    EXPECT_LT(errors.arm, 0.8e-3);
    EXPECT_LT(errors.pendulum, 0.8e-3);
    EXPECT_LT(errors.worst, 4e-3);
}

TEST(Pendulum, light_noise_and_blur_cost_little) {
    const Errors dim =
        measure("light 0.4", [](scene::State& s) { s.values[scene::at::light] = 0.4; });
    EXPECT_GE(dim.found, 117);
    EXPECT_LT(dim.pendulum, 2e-3);
    const Errors bright = measure("light 1.3, overexposed",
                                  [](scene::State& s) { s.values[scene::at::light] = 1.3; });
    EXPECT_GE(bright.found, 117);
    EXPECT_LT(bright.pendulum, 3e-3);
    const Errors noisy =
        measure("noise 10", [](scene::State& s) { s.values[scene::at::noise] = 10.0; });
    EXPECT_GE(noisy.found, 117);
    EXPECT_LT(noisy.pendulum, 3e-3);
    const Errors blurred =
        measure("blur 2 px", [](scene::State& s) { s.values[scene::at::blur] = 2.0; });
    EXPECT_GE(blurred.found, 117);
    EXPECT_LT(blurred.pendulum, 2e-3);
}

TEST(Pendulum, a_smeared_picture_shows_the_middle_of_the_exposure) {
    const scene::Settings settings;
    double worst = 0.0;
    for (int i = 0; i < 20; ++i) {
        const double pendulum = spread(i, 3.0, -3.0, 3.0);
        const PendulumSeen seen = find_pendulum(
            frame_of(settings, rig_state(0.1, pendulum - 0.05), rig_state(0.1, pendulum + 0.05), 7),
            {}, {});
        ASSERT_TRUE(seen.found) << pendulum;
        worst = std::fmax(worst, std::fabs(seen.pendulum - pendulum));
    }
    std::printf("0.1 rad in an exposure: greatest error %.2f mrad\n", worst * 1e3);
    EXPECT_LT(worst, 4e-3);
}

TEST(Pendulum, what_does_not_show_both_balls_is_not_found) {
    const scene::Settings settings;
    scene::State state = rig_state(0.2, 2.9);
    const auto found = [&] {
        return find_pendulum(frame_of(settings, state, state, 1), {}, {}).found;
    };
    EXPECT_TRUE(found());
    state.values[scene::at::covered] = 0.9;
    EXPECT_FALSE(found());
    state.values[scene::at::covered] = 0.0;
    state.values[scene::at::light] = 0.02;
    EXPECT_FALSE(found());

    Frame grey = frame_of(settings, rig_state(0.2, 2.9), rig_state(0.2, 2.9), 1);
    grey.format = Format::grey;
    grey.width = 960;  // the same bytes
    EXPECT_FALSE(find_pendulum(grey, {}, {}).found);
    Frame tiny;
    tiny.resize(1, 1, Format::bgr);
    EXPECT_FALSE(find_pendulum(tiny, {}, {}).found);
}

TEST(Pendulum, balls_that_fit_no_angles_are_refused_by_their_residual) {
    PendulumView view;
    view.rod_length = 0.2;  // it is 0.3
    const scene::Settings settings;
    const PendulumSeen seen =
        find_pendulum(frame_of(settings, rig_state(0.2, 2.9), rig_state(0.2, 2.9), 1), view, {});
    EXPECT_FALSE(seen.found);
    EXPECT_GT(seen.residual, 1.5);
}

TEST(Pendulum, two_attitudes_that_look_the_same_are_not_told_apart_by_luck) {
    // with the arm across the camera's axis the pendulum swings in a plane that the camera sees
    // nearly from its edge
    const scene::Settings settings;
    int found = 0;
    for (int i = 0; i < 60; ++i) {
        const double arm = (i % 2 ? 1.0 : -1.0) * spread(i, 2.0, 1.35, 1.75);

        const double pendulum = spread(i, 3.0, -std::numbers::pi, std::numbers::pi);
        const auto state = rig_state(arm, pendulum);
        const PendulumSeen seen =
            find_pendulum(frame_of(settings, state, state, static_cast<std::uint64_t>(i)), {}, {});
        if (!seen.found) continue;
        ++found;
        EXPECT_LT(std::fabs(std::remainder(seen.pendulum - pendulum, 2.0 * std::numbers::pi)), 0.02)
            << arm << ' ' << pendulum;
    }
    std::printf("arm at 77 to 100 degrees: %d of 60 found, all correct\n", found);
    for (const double pendulum : {-2.5, -1.0, 0.8, 2.0}) {
        const auto edge = rig_state(std::acos(0.2 / 1.2), pendulum);  // the camera is in the plane
        EXPECT_FALSE(find_pendulum(frame_of(settings, edge, edge, 1), {}, {}).found) << pendulum;
    }
}

TEST(Scene, same_seed_same_bytes) {
    const scene::Settings settings;
    scene::Settings other = settings;
    other.seed = 2;
    const scene::State state = rig_state(0.3, 1.0);
    EXPECT_EQ(scene::render(settings, state, state, 5), scene::render(settings, state, state, 5));
    EXPECT_NE(scene::render(settings, state, state, 5), scene::render(settings, state, state, 6));
    EXPECT_NE(scene::render(settings, state, state, 5), scene::render(other, state, state, 5));
}

TEST(Stage, states_lie_between_their_neighbours) {
    scene::Stage stage{scene::Settings{}};
    scene::State seen;
    EXPECT_FALSE(stage.newest(seen));
    EXPECT_FALSE(stage.when(0, seen));
    std::array<double, scene::max_values> values{};
    for (int i = 0; i < 2000; ++i) {
        values[scene::at::arm] = i;
        values[scene::at::light] = i;
        stage.put(i * 1000, values);
    }
    ASSERT_TRUE(stage.when(1'990'250, seen));
    EXPECT_DOUBLE_EQ(seen[scene::at::arm], 1990.25);
    EXPECT_DOUBLE_EQ(seen[scene::at::light], 1990.0);  // a condition is not between two
    ASSERT_TRUE(stage.when(9'000'000, seen));
    EXPECT_DOUBLE_EQ(seen[scene::at::arm], 1999.0);
    ASSERT_TRUE(stage.when(0, seen));  // gone: the oldest that is kept
    EXPECT_DOUBLE_EQ(seen[scene::at::arm], 2000.0 - 504.0);
    ASSERT_TRUE(stage.newest(seen));
    EXPECT_DOUBLE_EQ(seen[scene::at::arm], 1999.0);
}

TEST(Stage, a_name_is_given_once) {
    scene::open("here", std::make_shared<scene::Stage>(scene::Settings{}));
    EXPECT_THROW(scene::open("here", nullptr), std::invalid_argument);
    EXPECT_NE(scene::find("here"), nullptr);
    scene::close("here");
    EXPECT_EQ(scene::find("here"), nullptr);
}

}  // namespace
