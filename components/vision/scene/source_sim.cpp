// SPDX-License-Identifier: MIT
// sim:NAME, the camera of a vision_scene. What it gives at a moment depends on that moment and on
// the states of the scene alone.
#include <algorithm>
#include <chrono>
#include <cmath>
#include <thread>

#include "vision/capture/source.hpp"
#include "vision/scene/render.hpp"

namespace hal::vision {

namespace {

constexpr std::int64_t timeout_for_scene = 200'000'000;

std::int64_t nanoseconds(double seconds) noexcept {
    return std::isfinite(seconds)
               ? static_cast<std::int64_t>(std::clamp(seconds, 0.0, 10.0) * 1e9 + 0.5)
               : 0;
}

class SimSource : public Source {
public:
    explicit SimSource(std::string name) : name_(std::move(name)) {}

    bool open(std::int64_t now_ns) override {
        opened_ns_ = now_ns;
        last_ = -1;
        skipped_ = 0;
        if (const auto stage = scene::find(name_); stage && is_unplugged(*stage)) {
            return unplugged();
        }
        return true;
    }
    void close() noexcept override { picture_.clear(); }
    // a sensor without noise and a scene at rest look the same
    std::uint32_t frozen_after() const override { return 10; }

    Got next(std::int64_t now_ns, std::int64_t timeout_ns, Frame& frame) override {
        const Got got = look(now_ns, frame);
        if (got != Got::nothing || timeout_ns <= 0) return got;
        const std::int64_t wait = std::clamp<std::int64_t>(due_ns_ - now_ns, 0, timeout_ns);
        std::this_thread::sleep_for(std::chrono::nanoseconds(wait));
        return look(now_ns + wait, frame);
    }

private:
    static bool is_unplugged(const scene::Stage& stage) {
        scene::State state;
        return stage.newest(state) && state[scene::at::unplugged] != 0.0;
    }
    bool unplugged() { return fail(FrameError::unplugged, "sim:" + name_ + " was unplugged"); }

    /// The newest picture that has arrived by `now_ns`; due_ns_ is when there is another one.
    Got look(std::int64_t now_ns, Frame& frame) {
        const auto stage = scene::find(name_);
        due_ns_ = now_ns + 10'000'000;
        scene::State newest;
        if (!stage) {
            if (now_ns - opened_ns_ < timeout_for_scene) return Got::nothing;
            fail(FrameError::missing,
                 "missing scene sim:" + name_ + ": loadrt vision_scene camera=" + name_);
            return Got::lost;
        }
        if (!stage->newest(newest)) return Got::nothing;
        if (newest[scene::at::unplugged] != 0.0) {
            unplugged();
            return Got::lost;
        }
        const scene::Settings& of = stage->settings();
        const std::int64_t period = std::max<std::int64_t>(std::llround(1e9 / of.fps), 1);

        const std::int64_t exposure = nanoseconds(newest[scene::at::exposure]);

        const std::int64_t delay = nanoseconds(newest[scene::at::delay]);
        const std::int64_t ready = now_ns - exposure - delay;
        const std::int64_t n = ready < 0 ? -1 : ready / period;
        due_ns_ = (std::max(n, last_) + 1) * period + exposure + delay;
        if (n <= last_) return Got::nothing;
        scene::State begin, end;
        if (!stage->when(n * period, begin) || !stage->when(n * period + exposure, end)) {
            return Got::nothing;
        }
        if (last_ >= 0) {
            skipped_ += static_cast<std::uint64_t>(n - last_ - 1);
        }
        last_ = n;
        if (picture_.empty() || end[scene::at::frozen] == 0.0) {
            picture_ = scene::render(of, begin, end, static_cast<std::uint64_t>(n));
        }
        frame.resize(of.width, of.height, Format::bgr);
        std::copy(picture_.begin(), picture_.end(), frame.pixels.begin());
        if (of.grey) {
            to_grey(frame);
        }
        frame.stamp_ns = n * period + exposure / 2;
        frame.number = static_cast<std::uint64_t>(n);
        return Got::frame;
    }

    const std::string name_;
    std::vector<std::uint8_t> picture_;  // the last one, for a camera that hangs
    std::int64_t opened_ns_ = 0;
    std::int64_t last_ = -1;
    std::int64_t due_ns_ = 0;
};

}  // namespace

std::unique_ptr<Source> sim_source(Address address) {
    address.finish();
    return std::make_unique<SimSource>(address.place());
}

}  // namespace hal::vision
