// SPDX-License-Identifier: MIT
#include "can_replay.hpp"

#include <time.h>

#include <algorithm>
#include <memory>
#include <vector>

#include "link/capture.hpp"
#include "link/filtering.hpp"
#include "link/system.hpp"

namespace hal::can::replay {

namespace {

class ReplayLink final : public FilteringLink {
public:
    ReplayLink(const std::string& file, const Options& options, std::vector<Frame> frames)
        : options_(options), frames_(std::move(frames)) {
        counting_.bit_rate = options.bit_rate != unlimited ? options.bit_rate : 0;
        counting_.data_rate = options.data_rate;
        description_ = describe(file);
        description_.bit_rate = counting_.bit_rate;
        description_.data_rate = counting_.data_rate;

        description_.fd = options.fd;
    }
    Sent send(const Frame& frame, std::int64_t) noexcept override {
        if (!frame.valid() || options_.listen_only) {
            Counting::add(counting_.dropped);
            return Sent::rejected;
        }
        counting_.count_sent(frame);
        return Sent::queued;
    }
    void flush(std::int64_t) noexcept override {}
    std::size_t receive(std::span<Frame> batch, std::int64_t now_ns) noexcept override {
        const auto now = now_ns != unclocked ? now_ns : link::monotonic_ns();
        if (next_ == 0 && !begun_) {
            begun_ = true;
            shift_ = now - (frames_.empty() ? 0 : frames_.front().time_ns);
        }
        std::size_t count = 0;
        for (; count < batch.size() && next_ < frames_.size() &&
               frames_[next_].time_ns + shift_ <= now;
             ++next_) {
            Frame f = frames_[next_];
            if (f.error) {
                Counting::add(counting_.errors);
            }
            if (f.error ? !options_.error_frames : !filters_.pass(f)) continue;
            f.time_ns += shift_;
            if (!f.error) {
                counting_.count_received(f);
            }
            batch[count++] = f;
        }
        counting_.tick(now);
        if (next_ == frames_.size()) {
            counting_.state.store(State::down, std::memory_order_relaxed);
        }
        return count;
    }
    Statistics statistics() const noexcept override { return counting_.read(0); }
    bool wait(std::int64_t at_most_ns) override {
        if (next_ == frames_.size()) return false;
        const auto left = begun_ ? std::max<std::int64_t>(
                                       0, frames_[next_].time_ns + shift_ - link::monotonic_ns())
                                 : 0;
        const auto pause = std::clamp<std::int64_t>(at_most_ns, 0, left);
        const timespec time = link::to_timespec(pause);
        if (pause > 0) {
            nanosleep(&time, nullptr);
        }
        return left <= at_most_ns;
    }

private:
    const Options options_;
    const std::vector<Frame> frames_;
    std::size_t next_ = 0;  // from here on: used by the receiving thread
    bool begun_ = false;
    std::int64_t shift_ = 0;
};

}  // namespace

Description describe(const std::string& file) {
    return {.address = "replay:" + file,
            .transport = "capture",
            .simulated = true,
            .has_stamps = true,
            .file = file};
}

Opened open(const std::string& file, const Options& options) {
    if (file.empty()) {
        return {nullptr, "missing file; write replay:capture.log or replay:capture.pcapng"};
    }
    auto capture = read_capture(file);
    if (!capture.problem.empty()) {
        return {nullptr, capture.problem};
    }
    if (capture.frames.empty()) {
        return {nullptr, "no CAN frames in this file; expected a candump log, pcapng or pcap"};
    }
    return {std::make_unique<ReplayLink>(file, options, std::move(capture.frames)), {}};
}

}  // namespace hal::can::replay
