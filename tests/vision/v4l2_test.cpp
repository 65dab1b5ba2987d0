// SPDX-License-Identifier: MIT
// A camera against a stand-in for the kernel's calls.
#include "vision/capture/v4l2.hpp"

#include <gtest/gtest.h>
#include <linux/videodev2.h>

#include <cerrno>
#include <deque>
#include <set>

namespace hal::vision {
namespace {

constexpr int width = 16;
constexpr int height = 4;

class Kernel : public VideoSystem {
public:
    std::vector<std::uint32_t> formats{V4L2_PIX_FMT_MJPEG, V4L2_PIX_FMT_YUYV};
    std::uint32_t capabilities = V4L2_CAP_VIDEO_CAPTURE | V4L2_CAP_STREAMING;
    std::uint32_t gives_width = width;
    std::uint32_t gives_height = height;
    std::uint32_t gives_format = 0;
    std::uint32_t line = 0;
    int open_error = 0;
    int format_error = 0;
    int rate_error = 0;
    int fail_call = -1;
    int calls = 0;
    v4l2_fract gives_period{0, 0};  ///< 0: what is asked for
    bool gone = false;
    bool no_camera = false;
    bool monotonic = true;
    std::uint32_t bytes = width * height * 2;
    int open_now = 0;
    int mapped = 0;
    bool streams = false;

    /// A frame is in the next free buffer, all of it `value` and grey.
    void shoot(std::uint32_t sequence, std::uint8_t value, std::uint32_t flags = 0) {
        ASSERT_FALSE(queued_.empty()) << "no buffer was given back";
        const std::uint32_t index = queued_.front();
        queued_.pop_front();
        for (std::size_t i = 0; i < memory_[index].size(); ++i) {
            memory_[index][i] = i % 2 == 0 ? value : 128;
        }
        v4l2_buffer b{};
        b.index = index;
        b.sequence = sequence;

        b.flags = flags | (monotonic ? V4L2_BUF_FLAG_TIMESTAMP_MONOTONIC : 0);
        b.bytesused = bytes;
        b.timestamp.tv_sec = 5;
        b.timestamp.tv_usec = static_cast<long>(sequence);
        done_.push_back(b);
    }

    int open(const char* path) override {
        EXPECT_STREQ(path, "/dev/video0");
        if (open_error != 0) {
            errno = open_error;
            return -1;
        }
        if (fails()) return -1;
        ++open_now;
        return 7;
    }
    int control(int fd, unsigned long request, void* argument) override {
        EXPECT_EQ(fd, 7);
        if (gone) {
            errno = ENODEV;
            return -1;
        }
        if (request != VIDIOC_DQBUF && request != VIDIOC_STREAMOFF && request != VIDIOC_ENUM_FMT &&
            request != VIDIOC_S_PARM && fails()) {
            return -1;
        }
        switch (request) {
        case VIDIOC_QUERYCAP:
            if (no_camera) {
                errno = ENOTTY;
                return -1;
            }
            static_cast<v4l2_capability*>(argument)->capabilities = capabilities;
            return 0;
        case VIDIOC_ENUM_FMT: {
            auto& one = *static_cast<v4l2_fmtdesc*>(argument);
            if (one.index >= formats.size()) {
                errno = EINVAL;
                return -1;
            }
            one.pixelformat = formats[one.index];
            return 0;
        }
        case VIDIOC_S_FMT: {
            if (format_error != 0) {
                errno = format_error;
                return -1;
            }
            auto& pix = static_cast<v4l2_format*>(argument)->fmt.pix;
            pix.width = gives_width;
            pix.height = gives_height;
            pix.bytesperline = line;
            if (gives_format != 0) {
                pix.pixelformat = gives_format;
            }
            return 0;
        }
        case VIDIOC_S_PARM:
            if (rate_error != 0) {
                errno = rate_error;
                return -1;
            }
            if (gives_period.numerator != 0) {
                static_cast<v4l2_streamparm*>(argument)->parm.capture.timeperframe = gives_period;
            }
            return 0;
        case VIDIOC_REQBUFS: static_cast<v4l2_requestbuffers*>(argument)->count = 3; return 0;
        case VIDIOC_QUERYBUF: {
            auto& b = *static_cast<v4l2_buffer*>(argument);
            b.length = width * height * 2 + 64;
            b.m.offset = b.index;
            return 0;
        }
        case VIDIOC_QBUF: queued_.push_back(static_cast<v4l2_buffer*>(argument)->index); return 0;
        case VIDIOC_DQBUF:
            if (done_.empty()) {
                errno = EAGAIN;
                return -1;
            }
            *static_cast<v4l2_buffer*>(argument) = done_.front();
            done_.pop_front();
            return 0;
        case VIDIOC_STREAMON: streams = true; return 0;
        case VIDIOC_STREAMOFF: streams = false; return 0;
        default: return 0;
        }
    }
    void* map(int, std::size_t bytes_, std::int64_t offset) override {
        if (fails()) return nullptr;
        ++mapped;
        auto& memory = memory_[static_cast<std::size_t>(offset)];
        memory.resize(bytes_);
        return memory.data();
    }
    void unmap(void*, std::size_t) override { --mapped; }
    int wait(int, int) override { return gone ? -1 : done_.empty() ? 0 : 1; }
    void close(int) override {
        if (--open_now == 0) {
            queued_.clear();
            done_.clear();
        }
    }

private:
    bool fails() {
        if (calls++ != fail_call) return false;
        errno = EIO;
        return true;
    }
    std::vector<std::uint8_t> memory_[8];
    std::deque<std::uint32_t> queued_;
    std::deque<v4l2_buffer> done_;
};

struct V4l2 : testing::Test {
    Kernel kernel;
    std::unique_ptr<Source> camera = make("v4l2:/dev/video0?width=16&height=4&fps=30");
    Frame frame;

    std::unique_ptr<Source> make(const char* address) {
        return v4l2_source(Address(address), kernel);
    }
    std::string refusal() {
        EXPECT_FALSE(camera->open(0));
        EXPECT_EQ(kernel.open_now, 0);
        EXPECT_EQ(kernel.mapped, 0);
        return camera->problem().text;
    }
};

TEST_F(V4l2, camera_gives_colour_frames_with_the_time_of_their_exposure) {
    ASSERT_TRUE(camera->open(0));
    EXPECT_TRUE(kernel.streams);
    kernel.shoot(0, 126);
    ASSERT_EQ(camera->next(0, 0, frame), Got::frame);
    EXPECT_EQ(frame.format, Format::bgr);
    EXPECT_EQ(frame.width, width);
    // (126 - 16) 255 / 219
    EXPECT_EQ(frame.pixels, std::vector<std::uint8_t>(width * height * 3, 128));
    EXPECT_EQ(frame.stamp_ns, 5'000'000'000);
    EXPECT_EQ(camera->next(0, 0, frame), Got::nothing);
}

TEST_F(V4l2, camera_gives_the_newest_frame_and_all_buffers_back) {
    ASSERT_TRUE(camera->open(0));
    for (std::uint32_t round = 0; round < 50; ++round) {
        for (std::uint32_t i = 0; i < 3; ++i) {
            kernel.shoot(4 * round + i, static_cast<std::uint8_t>(16 + round));
        }
        ASSERT_EQ(camera->next(0, 0, frame), Got::frame);
        EXPECT_EQ(frame.number, 4 * round + 2);
    }
    // two that were older and one that the driver lost, each time
    EXPECT_EQ(camera->skipped(), 49u * 3);
}

TEST_F(V4l2, camera_may_be_grey_and_have_rows_with_a_gap) {
    kernel.formats = {V4L2_PIX_FMT_GREY};
    kernel.line = 20;
    kernel.bytes = 20 * height;
    ASSERT_TRUE(camera->open(0));
    kernel.shoot(0, 77);
    ASSERT_EQ(camera->next(0, 0, frame), Got::frame);
    EXPECT_EQ(frame.format, Format::grey);
    EXPECT_EQ(frame.row(1)[0], 77);
    camera = make("v4l2:/dev/video0?width=16&height=4&grey");
    kernel.formats = {V4L2_PIX_FMT_YUYV};
    kernel.line = 0;
    kernel.bytes = width * height * 2;
    ASSERT_TRUE(camera->open(0));
    kernel.shoot(0, 55);
    ASSERT_EQ(camera->next(0, 0, frame), Got::frame);
    EXPECT_EQ(frame.pixels, std::vector<std::uint8_t>(width * height, 55));
}

TEST_F(V4l2, frame_that_is_damaged_or_short_is_bad_and_the_next_is_good) {
    ASSERT_TRUE(camera->open(0));
    kernel.shoot(0, 50, V4L2_BUF_FLAG_ERROR);
    EXPECT_EQ(camera->next(0, 0, frame), Got::bad);
    EXPECT_EQ(camera->problem().text, "/dev/video0 marks a frame as damaged");
    kernel.bytes = 100;
    kernel.shoot(1, 50);
    EXPECT_EQ(camera->next(0, 0, frame), Got::bad);
    EXPECT_EQ(camera->problem().text, "/dev/video0 gives 100 bytes of a frame of 128");
    kernel.bytes = 128;
    kernel.shoot(2, 50);
    EXPECT_EQ(camera->next(0, 0, frame), Got::frame);
    EXPECT_EQ(camera->skipped(), 0u);
}

TEST_F(V4l2, camera_that_is_unplugged_is_lost_and_can_be_opened_again) {
    ASSERT_TRUE(camera->open(0));
    kernel.gone = true;
    EXPECT_EQ(camera->next(0, 0, frame), Got::lost);
    EXPECT_EQ(camera->problem().kind, FrameError::unplugged);
    EXPECT_EQ(camera->problem().text, "/dev/video0 was unplugged");
    camera->close();
    EXPECT_EQ(kernel.open_now, 0);
    EXPECT_EQ(kernel.mapped, 0);
    kernel.gone = false;
    ASSERT_TRUE(camera->open(0));
    kernel.shoot(0, 50);
    EXPECT_EQ(camera->next(0, 0, frame), Got::frame);
}

TEST_F(V4l2, stamp_is_the_arrival_where_the_driver_has_another_clock) {
    kernel.monotonic = false;
    ASSERT_TRUE(camera->open(0));
    kernel.shoot(0, 50);
    ASSERT_EQ(camera->next(1234, 0, frame), Got::frame);
    EXPECT_EQ(frame.stamp_ns, 1234);
}

TEST_F(V4l2, rate_that_a_camera_does_not_have_is_said_and_counts) {
    ASSERT_TRUE(camera->open(0));
    EXPECT_EQ(camera->remark(), "");
    EXPECT_DOUBLE_EQ(camera->timeout_s(), 1.1);
    camera->close();
    // a frame in two seconds: it is not silent before three did not come
    kernel.gives_period = {2, 1};
    ASSERT_TRUE(camera->open(0));
    EXPECT_EQ(camera->remark(),
              "/dev/video0 gives 0.5 frames per second, not 30; to list the rates of each size: "
              "v4l2-ctl -d /dev/video0 --list-formats-ext");
    EXPECT_DOUBLE_EQ(camera->timeout_s(), 7.0);
    camera->close();
    kernel.gives_period = {1001, 30'000};  // 29.97: what is called 30
    ASSERT_TRUE(camera->open(0));
    EXPECT_EQ(camera->remark(), "");
    camera->close();
    kernel.rate_error = ENOTTY;
    ASSERT_TRUE(camera->open(0));
    EXPECT_EQ(camera->remark(), "/dev/video0 has a fixed frame rate; fps=30 has no effect");
    EXPECT_DOUBLE_EQ(camera->timeout_s(), 1.1);
    camera = make("v4l2:/dev/video0?width=16&height=4");
    ASSERT_TRUE(camera->open(0));
    EXPECT_EQ(camera->remark(), "") << "nobody asked for one";
}

TEST_F(V4l2, refusals_say_what_to_do) {
    kernel.open_error = ENOENT;
    EXPECT_EQ(refusal(), "missing camera /dev/video0; to list cameras: ls -l /dev/v4l/by-id");
    EXPECT_EQ(camera->problem().kind, FrameError::missing);
    kernel.open_error = EACCES;
    EXPECT_EQ(
        refusal(),
        "/dev/video0: permission denied; type: sudo usermod -aG video $USER, and log in again");
    kernel.open_error = 0;
    kernel.no_camera = true;
    EXPECT_EQ(refusal(), "/dev/video0 is not a camera; to list cameras: ls -l /dev/v4l/by-id");
    kernel.no_camera = false;
    kernel.capabilities = V4L2_CAP_META_CAPTURE | V4L2_CAP_STREAMING;
    EXPECT_EQ(
        refusal(),
        "/dev/video0 gives no frames; a camera has several devices, and often the even ones do");
    kernel.capabilities = V4L2_CAP_VIDEO_CAPTURE | V4L2_CAP_STREAMING;
    kernel.formats = {V4L2_PIX_FMT_MJPEG, V4L2_PIX_FMT_H264};
    EXPECT_EQ(refusal(),
              "/dev/video0 offers MJPG, H264; only YUYV and GREY are read; ffmpeg -i /dev/video0 "
              "-pix_fmt yuyv422 -f v4l2 "
              "/dev/videoN makes YUYV of it for a v4l2loopback device");
    kernel.formats = {V4L2_PIX_FMT_YUYV};
    kernel.gives_format = V4L2_PIX_FMT_MJPEG;
    EXPECT_EQ(refusal(),
              "/dev/video0 gives MJPG and not YUYV at this size; take a smaller one: v4l2-ctl -d "
              "/dev/video0 --list-formats-ext");
    kernel.gives_format = 0;
    kernel.gives_width = 640;
    kernel.gives_height = 480;
    EXPECT_EQ(refusal(),
              "/dev/video0 has no frames of 16 x 4; write v4l2:/dev/video0?width=640&height=480");
    kernel.format_error = EBUSY;
    EXPECT_EQ(refusal(), "/dev/video0 is used by another program; type: fuser -v /dev/video0");
    EXPECT_EQ(camera->problem().kind, FrameError::unusable);
}

TEST_F(V4l2, every_call_may_fail_and_nothing_is_left_open) {
    for (int nth = 0; nth < 100; ++nth) {
        kernel.calls = 0;
        kernel.fail_call = nth;
        if (camera->open(0)) {
            EXPECT_GT(nth, 8);
            camera->close();
            EXPECT_EQ(kernel.open_now, 0);
            return;
        }
        EXPECT_TRUE(camera->problem().text.starts_with("/dev/video0 ") ||
                    camera->problem().text.starts_with("/dev/video0: "))
            << nth << camera->problem().text;
        EXPECT_EQ(kernel.open_now, 0) << nth;
        EXPECT_EQ(kernel.mapped, 0) << nth;
    }
    FAIL() << "it never opens";
}

struct SharedCamera : testing::Test {
    Kernel kernel;
    std::unique_ptr<Source> a = make("v4l2:/dev/video0?width=16&height=4");

    std::unique_ptr<Source> b = make("v4l2:/dev/video0?width=16&height=4");
    Frame frame;

    std::unique_ptr<Source> make(const char* address) {
        return shared_camera(Address(address), kernel);
    }
};

TEST_F(SharedCamera, gives_each_frame_to_all_who_opened_it) {
    ASSERT_TRUE(a->open(0));
    ASSERT_TRUE(b->open(0));
    EXPECT_EQ(kernel.open_now, 1);
    for (std::uint32_t i = 0; i < 5; ++i) {
        kernel.shoot(i, static_cast<std::uint8_t>(50 + i));
        ASSERT_EQ(a->next(0, 0, frame), Got::frame);
        EXPECT_EQ(a->next(0, 0, frame), Got::nothing);
        if (i == 2) {
            continue;  // b is busy
        }
        ASSERT_EQ(b->next(0, 0, frame), Got::frame);
        EXPECT_EQ(frame.number, i);
        EXPECT_EQ(b->next(0, 0, frame), Got::nothing);
    }
    EXPECT_EQ(a->skipped(), 0u);
    EXPECT_EQ(b->skipped(), 1u);
    a->close();
    EXPECT_EQ(kernel.open_now, 1);
    b->close();
    EXPECT_EQ(kernel.open_now, 0);
    EXPECT_EQ(kernel.mapped, 0);
}

TEST_F(SharedCamera, is_opened_in_one_way_only) {
    ASSERT_TRUE(a->open(0));
    b = make("v4l2:/dev/video0?width=16&height=4&grey");
    EXPECT_FALSE(b->open(0));
    EXPECT_EQ(b->problem().text,
              "another component has opened v4l2:/dev/video0?width=16&height=4; a camera has one "
              "set of options: use "
              "the same source= for both");
    a->close();
    EXPECT_TRUE(b->open(0));
}

TEST_F(SharedCamera, that_is_unplugged_is_lost_to_all_and_comes_back_to_all) {
    ASSERT_TRUE(a->open(0));
    ASSERT_TRUE(b->open(0));
    kernel.gone = true;
    EXPECT_EQ(a->next(0, 0, frame), Got::lost);
    EXPECT_EQ(a->problem().text, "/dev/video0 was unplugged");
    a->close();
    kernel.gone = false;
    ASSERT_TRUE(a->open(0));
    EXPECT_EQ(b->next(0, 0, frame), Got::lost) << "what it had open was the camera before";
    EXPECT_EQ(b->problem().text, "/dev/video0 was unplugged");
    b->close();
    ASSERT_TRUE(b->open(0));
    EXPECT_EQ(kernel.open_now, 1);
    kernel.shoot(0, 50);
    EXPECT_EQ(a->next(0, 0, frame), Got::frame);
    EXPECT_EQ(b->next(0, 0, frame), Got::frame);
}

TEST_F(SharedCamera, says_what_the_camera_says) {
    kernel.gives_period = {1, 5};
    EXPECT_EQ(a->remark(), "");
    ASSERT_TRUE(a->open(0));
    EXPECT_EQ(a->remark(),
              "/dev/video0 gives 5 frames per second, not 30; to list the rates of each size: "
              "v4l2-ctl -d /dev/video0 --list-formats-ext");
    EXPECT_DOUBLE_EQ(a->timeout_s(), 1.6);
}

TEST_F(SharedCamera, that_cannot_be_opened_says_why_to_each) {
    kernel.open_error = ENOENT;
    EXPECT_FALSE(a->open(0));
    EXPECT_FALSE(b->open(0));
    EXPECT_EQ(b->problem().text,
              "missing camera /dev/video0; to list cameras: ls -l /dev/v4l/by-id");
    EXPECT_EQ(kernel.open_now, 0);
}

TEST(Yuyv, becomes_the_colours_of_bt_601) {
    // red; a mixture; black; white
    const std::uint8_t yuyv[] = {81, 90, 145, 240, 16, 128, 235, 128};
    std::uint8_t bgr[12];
    yuyv_to_bgr(yuyv, bgr, 4);
    EXPECT_NEAR(bgr[0], 0, 1);
    EXPECT_NEAR(bgr[1], 0, 1);
    EXPECT_NEAR(bgr[2], 254, 1);
    EXPECT_EQ(bgr[6], 0);
    EXPECT_EQ(bgr[7], 0);
    EXPECT_EQ(bgr[8], 0);
    EXPECT_EQ(bgr[9], 255);
    EXPECT_EQ(bgr[11], 255);
}

}  // namespace
}  // namespace hal::vision
