// SPDX-License-Identifier: MIT
// Bottles, cans and lines from rendered frames against where they were put.
#include <cmath>
#include <cstdio>
#include <numbers>

#include "scene_views.hpp"
#include "vision/detect/blob.hpp"
#include "vision/detect/line.hpp"

namespace {

using namespace hal::vision;
using namespace hal::vision::test;

const Ground ground = ground_before({}, 320, 240);
const std::array<BlobKind, 2> bottle_and_can{BlobKind{{120.0, 35.0}, 0.030},
                                             BlobKind{{0.0, 35.0}, 0.033}};

scene::Settings floor_settings(int objects) {
    scene::Settings settings;
    settings.kind = scene::Kind::floor;
    settings.objects = objects;
    return settings;
}

scene::State line_state(double y, double heading, double amplitude, double x) {
    scene::State state = usual_state();
    state.values[scene::at::line_width] = 0.02;
    state.values[scene::at::line_length] = 2.0;

    state.values[scene::at::line_dark] = 1.0;
    state.values[scene::at::line_amplitude] = amplitude;
    state.values[scene::at::x] = x;
    state.values[scene::at::y] = y;

    state.values[scene::at::heading] = heading;
    return state;
}

/// Offset, heading and curvature of y = amplitude sin(pi x), 0.3 m in front of a robot: Newton's
/// method along the robot's left.
struct Truth {
    Truth(double y, double h, double amplitude, double at) {
        double x = 0.0;
        double slope = 0.0;
        for (int turn = 0; turn < 50; ++turn) {
            x = at + 0.3 * std::cos(h) - offset * std::sin(h);
            slope = amplitude * std::numbers::pi * std::cos(std::numbers::pi * x);
            const double off = amplitude * std::sin(std::numbers::pi * x) -
                               (y + 0.3 * std::sin(h) + offset * std::cos(h));
            offset += off / (std::cos(h) + slope * std::sin(h));
        }
        heading = std::atan(slope) - h;
        curvature = -amplitude * std::numbers::pi * std::numbers::pi *
                    std::sin(std::numbers::pi * x) / std::pow(1.0 + slope * slope, 1.5);
    }
    double offset = 0.0;
    double heading = 0.0;
    double curvature = 0.0;
};

TEST(Line, offset_and_heading_are_right) {
    const auto settings = floor_settings(0);
    double offset = 0.0;
    double heading = 0.0;
    double curvature = 0.0;
    double squares = 0.0;
    int found = 0;
    for (int i = 0; i < 60; ++i) {
        const double y = spread(i, 2.0, -0.08, 0.08);
        const double h = spread(i, 3.0, -0.25, 0.25);

        const double amplitude = i % 2 ? 0.0 : 0.08;
        const double x = spread(i, 5.0, 0.0, 4.0);
        const auto state = line_state(y, h, amplitude, x);
        const auto seen =
            find_line(frame_of(settings, state, state, static_cast<std::uint64_t>(i)), ground, {});
        const Truth truth(y, h, amplitude, x);
        if (std::fabs(truth.offset) > 0.16) {
            continue;  // leaves the picture
        }
        ASSERT_TRUE(seen.found) << y << ' ' << h << ' ' << x;
        ++found;
        squares += (seen.offset - truth.offset) * (seen.offset - truth.offset);
        offset = std::fmax(offset, std::fabs(seen.offset - truth.offset));
        heading = std::fmax(heading, std::fabs(seen.heading - truth.heading));
        curvature = std::fmax(curvature, std::fabs(seen.curvature - truth.curvature));
    }
    std::printf(
        "%d lines: offset %.2f mm rms, %.2f mm at most; heading %.1f mrad at most; curvature %.2f "
        "1/m at most\n",
        found, 1e3 * std::sqrt(squares / found), 1e3 * offset, 1e3 * heading, curvature);
    EXPECT_GT(found, 40);
    EXPECT_LT(offset, 1.5e-3);
    EXPECT_LT(heading, 0.025);
    EXPECT_LT(curvature, 0.5);
}

TEST(Line, light_lines_gaps_and_things_beside_it_do_not_matter) {
    auto settings = floor_settings(1);
    auto state = line_state(0.03, 0.1, 0.0, 0.0);
    const Truth truth(0.03, 0.1, 0.0, 0.0);
    LineRules rules;
    const auto check = [&](const char* what) {
        const auto seen = find_line(frame_of(settings, state, state, 3), ground, rules);
        EXPECT_TRUE(seen.found) << what;
        EXPECT_NEAR(seen.offset, truth.offset, 2e-3) << what;
        EXPECT_NEAR(seen.heading, truth.heading, 0.02) << what;
        return seen.quality;
    };
    const double whole = check("a dark line");
    state.values[scene::at::line_gap] = 0.1;
    state.values[scene::at::x] = 0.4;  // the gap is 0.1 to 0.2 m ahead of here
    EXPECT_LE(check("a gap"), whole);
    state.values[scene::at::line_gap] = 0.0;
    state.values[scene::at::x] = 0.0;
    state.values[scene::at::objects] = 2.0;
    state.values[scene::at::objects + 1] = 0.4;

    state.values[scene::at::objects + 2] = -0.12;
    check("a can beside it");
    state.values[scene::at::objects] = 0.0;
    state.values[scene::at::line_dark] = 0.0;
    rules.dark = false;
    check("a light line");
    state.values[scene::at::noise] = 12.0;
    check("noise");
}

TEST(Line, no_line_is_not_found) {
    const auto settings = floor_settings(0);
    auto state = line_state(0.0, 0.0, 0.0, 0.0);
    state.values[scene::at::line_width] = 0.0;
    EXPECT_FALSE(find_line(frame_of(settings, state, state, 1), ground, {}).found);
    state.values[scene::at::line_width] = 0.06;  // three times as wide
    EXPECT_FALSE(find_line(frame_of(settings, state, state, 1), ground, {}).found);
    state = line_state(1.0, 0.0, 0.0, 0.0);  // far to the side
    EXPECT_FALSE(find_line(frame_of(settings, state, state, 1), ground, {}).found);
    Frame tiny;
    tiny.resize(1, 1, Format::grey);
    EXPECT_FALSE(find_line(tiny, ground, {}).found);
}

TEST(Blob, bottles_and_cans_are_where_they_stand) {
    const auto settings = floor_settings(2);
    double squares = 0.0;
    double worst = 0.0;
    int found = 0;
    for (int i = 0; i < 80; ++i) {
        // one on each side, so that neither hides the other
        const double bottle_x = spread(i, 2.0, 0.35, 1.1);

        const double bottle_y = bottle_x * spread(i, 3.0, 0.12, 0.35);
        const double can_x = spread(i, 5.0, 0.35, 1.1);
        const double can_y = -can_x * spread(i, 7.0, 0.12, 0.35);
        scene::State state = usual_state();
        const double things[] = {1.0, bottle_x, bottle_y, 2.0, can_x, can_y};
        std::copy(std::begin(things), std::end(things), state.values.begin() + scene::at::objects);
        const auto seen =
            find_blobs(frame_of(settings, state, state, static_cast<std::uint64_t>(i)), ground,
                       bottle_and_can, {});
        ASSERT_EQ(seen.size(), 2u) << i;
        for (const Sighting& s : seen) {
            const double off = std::hypot(s.x - (s.kind == 0 ? bottle_x : can_x),
                                          s.y - (s.kind == 0 ? bottle_y : can_y));
            squares += off * off;
            worst = std::fmax(worst, off);
            ++found;
        }
    }
    std::printf("%d things at 0.35 to 1.1 m: %.1f mm rms, %.1f mm at most\n", found,
                1e3 * std::sqrt(squares / found), 1e3 * worst);
    EXPECT_LT(std::sqrt(squares / found), 6e-3);
    EXPECT_LT(worst, 0.02);
}

TEST(Blob, what_the_lower_edge_cuts_is_not_told) {
    const auto settings = floor_settings(1);
    scene::State state = usual_state();
    const double thing[] = {1.0, 0.2, 0.0};
    std::copy(std::begin(thing), std::end(thing), state.values.begin() + scene::at::objects);
    EXPECT_TRUE(
        find_blobs(frame_of(settings, state, state, 1), ground, bottle_and_can, {}).empty());
    Frame tiny;
    tiny.resize(1, 1, Format::bgr);
    EXPECT_TRUE(find_blobs(tiny, ground, bottle_and_can, {}).empty());
}

Sighting thing(double x, double y, std::uint32_t kind = 0) { return {kind, x, y, 100.0}; }

TEST(Tracks, a_thing_keeps_its_id_and_its_place) {
    Tracks tracks(3);
    const TrackRules rules{.gate = 0.1, .gain = 1.0, .forget_ns = 1000};
    const std::array first{thing(1.0, 0.0), thing(2.0, 0.0)};

    const std::array swapped{thing(2.05, 0.0), thing(1.05, 0.0)};
    tracks.see(first, 0, rules);
    tracks.see(swapped, 100, rules);
    EXPECT_EQ(tracks.all()[0].id, 1u);
    EXPECT_DOUBLE_EQ(tracks.all()[0].x, 1.05);
    EXPECT_EQ(tracks.all()[1].id, 2u);
    EXPECT_DOUBLE_EQ(tracks.all()[1].x, 2.05);
    EXPECT_EQ(tracks.all()[1].sightings, 2u);
    EXPECT_EQ(tracks.all()[2].id, 0u);
}

TEST(Tracks, unseen_things_are_kept_for_a_while_then_gone) {
    Tracks tracks(2);
    const TrackRules rules{.gate = 0.1, .gain = 1.0, .forget_ns = 1000};
    const std::array one{thing(1.0, 0.0)};
    tracks.see(one, 0, rules);
    tracks.see({}, 1000, rules);
    EXPECT_EQ(tracks.all()[0].id, 1u);
    tracks.see({}, 1001, rules);
    EXPECT_EQ(tracks.all()[0].id, 0u);
    tracks.see(one, 1002, rules);
    EXPECT_EQ(tracks.all()[0].id, 2u);  // a new one
}

TEST(Tracks, another_kind_or_too_far_is_another_thing_and_a_full_row_counts) {
    Tracks tracks(2);
    const TrackRules rules{.gate = 0.1, .gain = 1.0, .forget_ns = 1000};
    const std::array one{thing(1.0, 0.0)};
    const std::array others{thing(1.0, 0.0, 1), thing(1.5, 0.0)};
    tracks.see(one, 0, rules);
    tracks.see(others, 10, rules);
    EXPECT_EQ(tracks.all()[0].kind, 0u);
    EXPECT_EQ(tracks.all()[1].kind, 1u);
    EXPECT_EQ(tracks.crowded(), 1u);
}

}  // namespace
