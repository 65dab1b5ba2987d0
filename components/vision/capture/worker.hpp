// SPDX-License-Identifier: MIT
// From a source to a detector: opens the source, takes the newest frame, validates it, passes it
// on; logs errors and retries.
#pragma once

#include <functional>
#include <memory>
#include <string>

#include "hal/message_log.hpp"
#include "vision/capture/source.hpp"

namespace hal::vision {

/// Status of the source; sent to the cycle with every result and whenever it changes.
struct Status {
    std::uint32_t frames = 0;  ///< valid frames
    std::uint32_t dropped = 0;  ///< skipped for a newer one or lost by the camera
    std::uint32_t bad = 0;  ///< invalid frames: damaged, too large, black, frozen, wrong size
    std::uint32_t openings = 0;  ///< number of times the source was opened
    FrameError error = FrameError::missing;
    bool ok = false;  ///< it is open without an error
};

/// Neither real-time nor with a thread of its own: hal::Background calls turn().
class Worker {
public:
    /// Calls `detect` with each valid frame, and `publish` after it and after each change of the
    /// status. Messages name `instance`. [setup]
    Worker(std::string instance, std::unique_ptr<Source> source,
           std::function<void(const Frame&)> detect, std::function<void(const Status&)> publish);

    /// Accepts frames of this size only, the size of the calibration `file`. [setup]
    void expect(int width, int height, std::string file);
    /// Sets the number of identical frames that count as a frozen camera; 0: never. [helper thread]
    void freeze_after(std::uint32_t frames) { frozen_after_ = frames; }
    std::uint32_t source_frozen_after() const { return source_->frozen_after(); }
    /// Sends messages to `print` instead of standard error, for tests. [setup]
    void print_to(const std::function<void(const std::string&)>& print);

    /// Does the work due at `now_ns`; waits for a frame, at most 0.1 s, if `may_wait`. [helper
    /// thread]
    void turn(std::int64_t now_ns, bool may_wait) noexcept;
    /// Closes the source while no turn runs; the next one reopens it. [setup]
    void close() noexcept;
    const Status& status() const { return status_; }

private:
    void step(std::int64_t now_ns, bool may_wait);
    void open(std::int64_t now_ns);
    void take(const Frame& frame, std::int64_t now_ns);
    bool black(const Frame& frame) const;
    bool frozen(const Frame& frame);
    void report(Problem problem, std::int64_t now_ns);
    void recovered(std::int64_t now_ns);
    void publish();
    void print(const std::string& sentence);

    const std::string instance_;
    std::unique_ptr<hal::MessageLog> log_;
    const std::unique_ptr<Source> source_;
    const std::function<void(const Frame&)> detect_;
    const std::function<void(const Status&)> publish_;
    Frame frame_;
    Status status_;
    std::string file_, remark_;
    int width_ = 0;
    int height_ = 0;  // 0: any
    std::uint32_t frozen_after_ = 0;
    std::uint32_t equal_ = 0;
    std::uint32_t dropped_before_ = 0;
    std::uint64_t picture_ = 0;  // hash of the last frame
    bool open_ = false;
    bool reported_ = false;
    bool ever_ = false;
    std::int64_t now_ = 0;  // of this turn
    std::int64_t try_again_ns_ = INT64_MIN;
    std::int64_t last_frame_ns_ = 0;
    std::int64_t since_ns_ = 0;
    // time of the last message about it
    std::int64_t said_ns_[frame_error_count];
};

}  // namespace hal::vision
