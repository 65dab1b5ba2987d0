// SPDX-License-Identifier: MIT
#include <linux/videodev2.h>

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <fcntl.h>
#include <optional>
#include <poll.h>
#include <stdexcept>
#include <sys/ioctl.h>
#include <sys/mman.h>
#include <unistd.h>

#include "hal/rejection.hpp"
#include "text/quoting.hpp"
#include "vision/capture/v4l2.hpp"

namespace hal::vision {

void yuyv_to_bgr(const std::uint8_t* yuyv, std::uint8_t* bgr, std::size_t pixels) {
    const auto clipped = [](int v) {
        return static_cast<std::uint8_t>(std::clamp(v >> 8, 0, 255));
    };
    for (std::size_t i = 0; i + 1 < pixels; i += 2, yuyv += 4) {
        const int u = yuyv[1] - 128;
        const int v = yuyv[3] - 128;
        for (const int y : {yuyv[0], yuyv[2]}) {
            const int c = 298 * (y - 16) + 128;  // BT.601: 255/219, 255/224 ... in 1/256
            *bgr++ = clipped(c + 516 * u);
            *bgr++ = clipped(c - 100 * u - 208 * v);
            *bgr++ = clipped(c + 409 * v);
        }
    }
}

namespace {

constexpr std::uint32_t buffers_wanted = 4;

class Kernel final : public VideoSystem {
    int open(const char* path) override { return ::open(path, O_RDWR | O_NONBLOCK | O_CLOEXEC); }
    int control(int fd, unsigned long request, void* argument) override {
        int result;
        do {
            result = ::ioctl(fd, request, argument);
        } while (result == -1 && errno == EINTR);
        return result;
    }
    void* map(int fd, std::size_t bytes, std::int64_t offset) override {
        void* const at = ::mmap(nullptr, bytes, PROT_READ | PROT_WRITE, MAP_SHARED, fd,
                                static_cast<off_t>(offset));
        return at == MAP_FAILED ? nullptr : at;
    }
    void unmap(void* at, std::size_t bytes) override { ::munmap(at, bytes); }
    int wait(int fd, int timeout_ms) override {
        pollfd one{fd, POLLIN, 0};
        const int found = ::poll(&one, 1, timeout_ms);
        if (found < 0) return errno == EINTR ? 0 : -1;
        if (found == 0) return 0;
        if ((one.revents & (POLLERR | POLLHUP | POLLNVAL)) != 0) return -1;
        return 1;
    }
    void close(int fd) override { ::close(fd); }
};

std::string four_letters(std::uint32_t code) {
    std::string text;
    for (int i = 0; i < 4; ++i) {
        const char c = static_cast<char>(code >> (8 * i) & 0x7f);
        text += c >= ' ' ? c : '?';
    }
    return text.substr(0, text.find_last_not_of(' ') + 1);
}

class V4l2 final : public Source {
public:
    V4l2(Address address, VideoSystem& system) : system_(system), device_(address.place()) {
        width_ = address.whole("width", 640, 2, max_width);
        height_ = address.whole("height", 480, 2, max_height);
        asked_ = address.has("fps");
        fps_ = given_fps_ = address.number("fps", 30.0, 0.1, 1000.0);
        grey_ = address.flag("grey");
        address.finish();
        if (device_.empty()) {
            throw hal::ArgumentError(
                "source", "source=" + address.text() + " has no device; write v4l2:/dev/video0");
        }
    }
    ~V4l2() override { close(); }

    bool open(std::int64_t) override {
        fd_ = system_.open(device_.c_str());
        if (fd_ < 0) return not_opened(errno);
        if (start()) {
            skipped_ = 0;
            any_ = false;
            return true;
        }
        close();
        return false;
    }

    /// Reads the newest frame that the driver has. Older ones are skipped.
    Got next(std::int64_t now, std::int64_t timeout, Frame& frame) override {
        const int ready = system_.wait(fd_, static_cast<int>(timeout / 1'000'000));
        if (ready < 0) return unplugged();
        if (ready == 0) return Got::nothing;
        std::optional<v4l2_buffer> newest;
        const bool is_connected = dequeue_newest(newest);
        if (!newest) return is_connected ? Got::nothing : unplugged();
        const bool is_valid = is_connected && read_frame(*newest, now, frame);
        if (!give_back(*newest) || !is_connected) return unplugged();
        return is_valid ? Got::frame : Got::bad;
    }

    void close() noexcept override {
        if (fd_ < 0) return;
        int type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
        system_.control(fd_, VIDIOC_STREAMOFF, &type);
        for (const Map& map : maps_) {
            system_.unmap(map.at, map.bytes);
        }
        maps_.clear();
        system_.close(fd_);
        fd_ = -1;
    }
    std::string remark() const override { return remark_; }
    double timeout_s() const override { return 1.0 + 3.0 / given_fps_; }
    std::uint32_t frozen_after() const override { return 10; }

private:
    struct Map {
        void* at;
        std::size_t bytes;
    };
    static v4l2_buffer blank(std::uint32_t index = 0) {
        v4l2_buffer buffer{};
        buffer.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
        buffer.memory = V4L2_MEMORY_MMAP;
        buffer.index = index;
        return buffer;
    }
    bool give_back(const v4l2_buffer& taken) {
        v4l2_buffer buffer = blank(taken.index);
        return system_.control(fd_, VIDIOC_QBUF, &buffer) != -1;
    }
    /// Gives all filled buffers but the newest back. Returns false if the camera is gone.
    bool dequeue_newest(std::optional<v4l2_buffer>& newest) {
        for (;;) {
            v4l2_buffer buffer = blank();
            if (system_.control(fd_, VIDIOC_DQBUF, &buffer) == -1) return errno == EAGAIN;
            if (buffer.index >= maps_.size()) continue;  // no driver does
            if (newest) {
                give_back(*newest);
            }
            newest = buffer;
        }
    }
    Got unplugged() {
        fail(FrameError::unplugged, device_ + " was unplugged");
        return Got::lost;
    }
    bool not_opened(int error) {
        if (error == ENOENT || error == ENODEV || error == ENXIO) {
            return fail(FrameError::missing,
                        "missing camera " + device_ + "; to list cameras: ls -l /dev/v4l/by-id");
        }
        if (error == EACCES || error == EPERM) {
            return fail(
                FrameError::unusable,
                device_ +
                    ": permission denied; type: sudo usermod -aG video $USER, and log in again");
        }
        if (error == EBUSY) return busy();
        return fail(FrameError::unusable, device_ + " cannot be opened: " + std::strerror(error));
    }
    bool busy() {
        return fail(FrameError::unusable,
                    device_ + " is used by another program; type: fuser -v " + device_);
    }
    bool failed(const char* what) {
        const int error = errno;
        if (error == EBUSY) return busy();
        if (error == ENODEV) return not_opened(error);
        return fail(FrameError::unusable, device_ + ": " + what + ": " + std::strerror(error));
    }

    bool start() {
        v4l2_capability able{};
        if (system_.control(fd_, VIDIOC_QUERYCAP, &able) == -1) {
            return fail(FrameError::unusable,
                        device_ + " is not a camera; to list cameras: ls -l /dev/v4l/by-id");
        }
        const std::uint32_t can =
            (able.capabilities & V4L2_CAP_DEVICE_CAPS) != 0 ? able.device_caps : able.capabilities;
        if ((can & V4L2_CAP_VIDEO_CAPTURE) == 0 || (can & V4L2_CAP_STREAMING) == 0) {
            return fail(
                FrameError::unusable,
                device_ +
                    " gives no frames; a camera has several devices, and often the even ones do");
        }
        return choose_format() && choose_rate() && map() && stream();
    }

    /// The formats of the device, as far as they matter.
    struct OfferedFormats {
        std::string names;
        bool yuyv = false;
        bool grey = false;
    };
    OfferedFormats offered_formats() {
        OfferedFormats offered;
        for (std::uint32_t i = 0; i < 64; ++i) {
            v4l2_fmtdesc one{};
            one.index = i;
            one.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
            if (system_.control(fd_, VIDIOC_ENUM_FMT, &one) == -1) break;
            offered.yuyv = offered.yuyv || one.pixelformat == V4L2_PIX_FMT_YUYV;
            offered.grey = offered.grey || one.pixelformat == V4L2_PIX_FMT_GREY;
            append_item(offered.names, four_letters(one.pixelformat));
        }
        return offered;
    }

    /// Sets the format and the size of the frames. Returns false after reporting why the device has
    /// none that can be read.
    bool choose_format() {
        const OfferedFormats offered = offered_formats();
        if (!offered.yuyv && !offered.grey) {
            return fail(FrameError::unusable,
                        device_ + " offers " +
                            (offered.names.empty() ? "no format" : offered.names) +
                            "; only YUYV and GREY are read; ffmpeg -i " + device_ +
                            " -pix_fmt yuyv422 -f v4l2 /dev/videoN makes YUYV of it for a "
                            "v4l2loopback device");
        }
        const bool wants_grey = offered.grey && (grey_ || !offered.yuyv);
        is_yuyv_ = !wants_grey;
        const std::uint32_t pixel_format = wants_grey ? V4L2_PIX_FMT_GREY : V4L2_PIX_FMT_YUYV;
        v4l2_format format{};
        format.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
        format.fmt.pix.width = static_cast<std::uint32_t>(width_);
        format.fmt.pix.height = static_cast<std::uint32_t>(height_);
        format.fmt.pix.pixelformat = pixel_format;
        format.fmt.pix.field = V4L2_FIELD_NONE;
        if (system_.control(fd_, VIDIOC_S_FMT, &format) == -1) return failed("format rejected");
        return accept(format.fmt.pix, pixel_format);
    }
    /// Checks the format that the driver has set, which may be another one. Returns false after
    /// reporting that.
    bool accept(const v4l2_pix_format& set, std::uint32_t pixel_format) {
        if (set.pixelformat != pixel_format) {
            return fail(FrameError::unusable,
                        device_ + " gives " + four_letters(set.pixelformat) + " and not " +
                            four_letters(pixel_format) +
                            " at this size; take a smaller one: v4l2-ctl -d " + device_ +
                            " --list-formats-ext");
        }
        if (set.width != static_cast<std::uint32_t>(width_) ||
            set.height != static_cast<std::uint32_t>(height_)) {
            return fail(FrameError::unusable,
                        device_ + " has no frames of " + std::to_string(width_) + " x " +
                            std::to_string(height_) + "; write v4l2:" + device_ + "?width=" +
                            std::to_string(set.width) + "&height=" + std::to_string(set.height));
        }
        line_ = std::max<std::size_t>(set.bytesperline, row_bytes());
        const bool has_half_pair = is_yuyv_ && width_ % 2 != 0;
        const bool line_is_too_long = line_ > std::size_t{16} * max_width;
        if (!Frame::fits(width_, height_) || line_is_too_long || has_half_pair) {
            return fail(FrameError::too_large, "frames of " + std::to_string(width_) + " x " +
                                                   std::to_string(height_) +
                                                   " are larger than a frame may be");
        }
        return true;
    }
    std::size_t row_bytes() const {
        const std::size_t bytes_per_pixel = is_yuyv_ ? 2 : 1;
        return static_cast<std::size_t>(width_) * bytes_per_pixel;
    }
    /// The camera may have other rates, or a fixed one: this is logged, and frames are used at its
    /// rate.
    bool choose_rate() {
        v4l2_streamparm parameters{};
        parameters.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
        v4l2_fract& period = parameters.parm.capture.timeperframe;
        period = {1000, static_cast<std::uint32_t>(std::lround(fps_ * 1000.0))};
        const bool is_settable = system_.control(fd_, VIDIOC_S_PARM, &parameters) != -1 &&
                                 period.numerator != 0 && period.denominator != 0;
        remark_.clear();
        if (!is_settable) {
            given_fps_ = fps_;
            if (asked_) {
                remark_ = device_ + " has a fixed frame rate; fps=" + rate(fps_) + " has no effect";
            }
            return true;
        }
        const double set_fps = static_cast<double>(period.denominator) / period.numerator;
        given_fps_ = std::clamp(set_fps, 0.1, 1000.0);
        if (std::fabs(given_fps_ - fps_) > 0.01 * fps_) {
            remark_ = device_ + " gives " + rate(given_fps_) + " frames per second, not " +
                      rate(fps_) + "; to list the rates of each size: v4l2-ctl -d " + device_ +
                      " --list-formats-ext";
        }
        return true;
    }
    static std::string rate(double fps) {
        char text[32];
        std::snprintf(text, sizeof text, "%.4g", fps);
        return text;
    }
    bool map() {
        v4l2_requestbuffers request{};
        request.count = buffers_wanted;
        request.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
        request.memory = V4L2_MEMORY_MMAP;
        if (system_.control(fd_, VIDIOC_REQBUFS, &request) == -1) {
            return failed("it gives no buffers");
        }
        for (std::uint32_t i = 0; i < std::min(request.count, 32u); ++i) {
            v4l2_buffer buffer = blank(i);
            if (system_.control(fd_, VIDIOC_QUERYBUF, &buffer) == -1) {
                return failed("it gives no buffers");
            }
            void* const at = system_.map(fd_, buffer.length, buffer.m.offset);
            if (at == nullptr) return failed("its buffers cannot be mapped");
            maps_.push_back({at, buffer.length});
            if (!give_back(buffer)) return failed("it takes no buffers");
        }
        return maps_.size() >= 2 ||
               fail(FrameError::unusable, device_ + " gives fewer than two buffers");
    }
    bool stream() {
        int type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
        return system_.control(fd_, VIDIOC_STREAMON, &type) != -1 || failed("it does not start");
    }

    /// Copies the frame of a buffer. Returns false after reporting that it is damaged.
    bool read_frame(const v4l2_buffer& buffer, std::int64_t now, Frame& frame) {
        count_skipped(buffer.sequence);
        const std::size_t needed = line_ * static_cast<std::size_t>(height_ - 1) + row_bytes();
        const Map& map = maps_[buffer.index];
        if ((buffer.flags & V4L2_BUF_FLAG_ERROR) != 0) {
            return fail(FrameError::damaged, device_ + " marks a frame as damaged");
        }
        if (std::min<std::size_t>(buffer.bytesused, map.bytes) < needed) {
            return fail(FrameError::damaged, device_ + " gives " +
                                                 std::to_string(buffer.bytesused) +
                                                 " bytes of a frame of " + std::to_string(needed));
        }
        frame.resize(width_, height_, is_yuyv_ && !grey_ ? Format::bgr : Format::grey);
        const auto* const bytes = static_cast<const std::uint8_t*>(map.at);
        for (int y = 0; y < height_; ++y) {
            copy_row(bytes + line_ * static_cast<std::size_t>(y), frame.row(y));
        }
        frame.number = buffer.sequence;
        const bool monotonic =
            (buffer.flags & V4L2_BUF_FLAG_TIMESTAMP_MASK) == V4L2_BUF_FLAG_TIMESTAMP_MONOTONIC;
        frame.stamp_ns = monotonic ? std::int64_t{buffer.timestamp.tv_sec} * 1'000'000'000 +
                                         std::int64_t{buffer.timestamp.tv_usec} * 1000
                                   : now;
        return true;
    }
    /// The driver also counts frames that it lost; frames skipped here leave the same gap in the
    /// sequence.
    void count_skipped(std::uint32_t sequence) {
        if (any_) {
            skipped_ += sequence - last_ - 1u;
        }
        last_ = sequence;
        any_ = true;
    }
    void copy_row(const std::uint8_t* from, std::uint8_t* to) const {
        const auto width = static_cast<std::size_t>(width_);
        if (!is_yuyv_) {
            std::memcpy(to, from, width);
        } else if (grey_) {
            for (std::size_t x = 0; x < width; ++x) {
                to[x] = from[2 * x];
            }
        } else {
            yuyv_to_bgr(from, to, width);
        }
    }

    VideoSystem& system_;
    const std::string device_;
    int width_ = 0;
    int height_ = 0;
    int fd_ = -1;
    double fps_ = 30.0;
    double given_fps_ = 30.0;  // asked for; what the camera makes of it
    std::string remark_;
    bool asked_ = false;
    bool grey_ = false;
    bool is_yuyv_ = false;
    bool any_ = false;  // a frame was read since the camera was opened
    std::size_t line_ = 0;  // bytes from row to row
    std::uint32_t last_ = 0;  // sequence number of the frame before
    std::vector<Map> maps_;
};

}  // namespace

VideoSystem& kernel() {
    static Kernel real;
    return real;
}

std::unique_ptr<Source> v4l2_source(Address address, VideoSystem& system) {
    return std::make_unique<V4l2>(std::move(address), system);
}

}  // namespace hal::vision
