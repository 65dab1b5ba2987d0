// SPDX-License-Identifier: MIT
#include "vision/capture/worker.hpp"

#include <gtest/gtest.h>

#include <new>
#include <stdexcept>

namespace hal::vision {
namespace {

constexpr std::int64_t ms = 1'000'000;
constexpr std::int64_t second = 1000 * ms;

/// A camera of 8 x 6 pixels at 100 frames a second that follows the test's script.
class Puppet : public Source {
public:
    bool there = true;

public:
    bool cut = false;

public:
    bool starved = false;
    std::uint8_t brightness = 100;
    bool still = false;
    bool gives = true;
    bool damaged = false;
    int width = 8;
    int opened = 0;
    int closed = 0;
    std::string other;
    std::int64_t taken = -1;

    bool open(std::int64_t) override {
        if (!there) return fail(FrameError::missing, "there is no camera /dev/video9");
        ++opened;
        skipped_ = 0;
        taken = -1;
        return true;
    }
    Got next(std::int64_t now, std::int64_t, Frame& frame) override {
        if (starved) throw std::bad_alloc();
        if (cut) {
            fail(FrameError::unplugged, "/dev/video9 was unplugged");
            return Got::lost;
        }
        const std::int64_t n = now / (10 * ms);
        if (!gives || n == taken) return Got::nothing;
        if (taken >= 0) {
            skipped_ += static_cast<std::uint64_t>(n - taken - 1);
        }
        taken = n;
        if (damaged) {
            fail(FrameError::damaged, "half of a frame");
            return Got::bad;
        }
        frame.resize(width, 6, Format::grey);
        std::fill(frame.pixels.begin(), frame.pixels.end(), brightness);
        if (!still && brightness > 0) {
            frame.pixels[static_cast<std::size_t>(n % 8)] ^= 1;
        }
        frame.stamp_ns = n * 10 * ms;
        return Got::frame;
    }
    void close() noexcept override { ++closed; }
    std::string remark() const override { return other; }
};

struct Rig : testing::Test {
    Puppet* camera = new Puppet;
    std::vector<std::string> lines;
    std::vector<Status> published;
    int seen = 0;
    bool throws = false;
    std::int64_t now = 0;
    std::int64_t stamp = -1;
    Worker worker{"eye", std::unique_ptr<Source>(camera), [this](const Frame& frame) {
        if (throws) throw std::runtime_error("no memory");
        ++seen;
        stamp = frame.stamp_ns;
    }, [this](const Status& status) { published.push_back(status); }};

    Rig() {
        worker.print_to([this](const std::string& line) { lines.push_back(line); });
    }
    void run(std::int64_t ns, std::int64_t step = 10 * ms) {
        for (const std::int64_t end = now + ns; now < end; now += step) {
            worker.turn(now, false);
        }
    }
    const Status& status() const { return worker.status(); }
};

TEST_F(Rig, Worker_gives_each_frame_once) {
    run(100 * ms, ms);
    EXPECT_EQ(seen, 10);
    EXPECT_EQ(stamp, 90 * ms);
    EXPECT_EQ(status().frames, 10u);
    EXPECT_EQ(status().dropped, 0u);
    EXPECT_TRUE(status().ok);
    EXPECT_TRUE(lines.empty());
}

TEST_F(Rig, Worker_takes_the_newest_and_counts_those_it_missed) {
    run(300 * ms, 30 * ms);
    EXPECT_EQ(seen, 10);
    EXPECT_EQ(status().dropped, 18u);
}

TEST_F(Rig, Worker_looks_for_an_absent_camera_every_second_and_says_it_once) {
    camera->there = false;
    run(5 * second);
    EXPECT_EQ(lines, std::vector<std::string>{
                         "eye: there is no camera /dev/video9; retrying every second"});
    EXPECT_EQ(status().error, FrameError::missing);
    camera->there = true;
    run(second + 10 * ms);
    EXPECT_EQ(lines.back(), "eye: first valid frame after 5.0 s");
    EXPECT_TRUE(status().ok);
    EXPECT_EQ(status().openings, 1u);
}

TEST_F(Rig, Worker_goes_on_by_itself_after_the_camera_was_unplugged) {
    run(second);
    camera->cut = true;
    camera->there = false;
    run(3 * second);
    EXPECT_FALSE(status().ok);
    EXPECT_EQ(lines, (std::vector<std::string>{
                         "eye: /dev/video9 was unplugged; retrying every second",
                         "eye: there is no camera /dev/video9; retrying every second"}));
    EXPECT_EQ(camera->closed, 1);
    camera->cut = false;
    camera->there = true;
    run(second + 10 * ms);
    EXPECT_EQ(lines.back(), "eye: frames are valid again after 3.0 s");
    EXPECT_TRUE(status().ok);
    EXPECT_EQ(status().openings, 2u);
    EXPECT_EQ(status().error, FrameError::none);
}

TEST_F(Rig, Worker_says_once_what_the_camera_does_other_than_it_was_told) {
    camera->other = "/dev/video9 gives 15 frames per second, not 30";
    run(second);
    camera->cut = true;
    run(second);
    camera->cut = false;
    run(second + 10 * ms);
    EXPECT_EQ(status().openings, 2u);
    EXPECT_EQ(lines,
              (std::vector<std::string>{"eye: /dev/video9 gives 15 frames per second, not 30",
                                        "eye: /dev/video9 was unplugged; retrying every second",
                                        "eye: frames are valid again after 1.0 s"}));
}

TEST_F(Rig, Worker_says_once_that_frames_are_black_and_counts_them) {
    run(second);
    camera->brightness = 3;
    run(5 * second);
    EXPECT_EQ(lines,
              std::vector<std::string>{"eye: frames are black; check the light and the lens cap"});
    EXPECT_EQ(status().bad, 500u);
    EXPECT_EQ(seen, 100);
    EXPECT_FALSE(status().ok);
    camera->brightness = 100;
    run(10 * ms);
    EXPECT_EQ(lines.back(), "eye: frames are valid again after 5.0 s");
}

TEST_F(Rig, Worker_takes_equal_frames_for_a_frozen_camera_if_it_is_told) {
    camera->still = true;
    run(second);
    EXPECT_TRUE(status().ok);
    worker.freeze_after(10);
    run(second);
    EXPECT_EQ(lines, std::vector<std::string>{
                         "eye: 10 frames in a row are identical; the camera is frozen"});
    EXPECT_EQ(status().error, FrameError::frozen);
    EXPECT_EQ(status().bad, 91u);
    camera->still = false;
    run(10 * ms);
    EXPECT_TRUE(status().ok);
}

TEST_F(Rig, Worker_refuses_frames_that_the_calibration_is_not_about) {
    worker.expect(640, 480, "room.camera");
    run(second);
    EXPECT_EQ(lines, std::vector<std::string>{"eye: frames are 8 x 6 and the calibration "
                                              "room.camera is for 640 x 480; take the file of this "
                                              "camera, or set the source's width and height"});
    EXPECT_EQ(status().error, FrameError::wrong_size);
    EXPECT_EQ(seen, 0);
}

TEST_F(Rig, Worker_says_that_no_frames_come) {
    run(second);
    camera->gives = false;
    run(5 * second);
    EXPECT_EQ(lines, std::vector<std::string>{"eye: no frame for 1.0 s"});
    EXPECT_EQ(status().error, FrameError::timeout);
    EXPECT_FALSE(status().ok);
    camera->gives = true;
    run(10 * ms);
    EXPECT_TRUE(status().ok);
}

TEST_F(Rig, Worker_outlives_a_detector_that_throws) {
    throws = true;
    run(second);
    EXPECT_EQ(lines, std::vector<std::string>{"eye: cannot process a frame: no memory"});
    EXPECT_EQ(status().bad, 100u);
    throws = false;
    run(10 * ms);
    EXPECT_TRUE(status().ok);
}

TEST_F(Rig, Worker_outlives_a_source_that_finds_no_memory) {
    run(second);
    camera->starved = true;
    run(3 * second);
    EXPECT_EQ(lines, std::vector<std::string>{
                         "eye: cannot read frames: std::bad_alloc; retrying every second"});
    EXPECT_FALSE(status().ok);
    EXPECT_FALSE(published.back().ok);
    camera->starved = false;
    run(second + 10 * ms);
    EXPECT_TRUE(status().ok);
}

TEST_F(Rig, Worker_does_not_flood_when_every_second_frame_is_damaged) {
    for (int i = 0; i < 1500; ++i) {
        camera->damaged = i % 2 == 1;
        run(10 * ms);
    }
    EXPECT_EQ(status().bad, 750u);
    EXPECT_EQ(lines, (std::vector<std::string>{
                         "eye: half of a frame", "eye: frames are valid again after 0.0 s",
                         "eye: half of a frame", "eye: frames are valid again after 0.0 s"}));
}

TEST_F(Rig, Worker_publishes_each_frame_and_each_change) {
    camera->there = false;
    run(second);
    EXPECT_EQ(published.size(), 1u);
    EXPECT_EQ(published.back().error, FrameError::missing);
    camera->there = true;
    run(second);
    EXPECT_EQ(published.size(), 101u);
    EXPECT_TRUE(published.back().ok);
}

}  // namespace
}  // namespace hal::vision
