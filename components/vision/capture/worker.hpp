// SPDX-License-Identifier: MIT
// From a source to a detector: opens, takes the newest frame, looks whether it is of use, has it worked on; says what is wrong and
// tries again.
#pragma once

#include <functional>
#include <memory>
#include <string>

#include "hal/message_log.hpp"
#include "vision/capture/source.hpp"

namespace hal::vision {

/// How the source does; goes to the cycle with every result and whenever it changes.
struct Status {
    std::uint32_t frames = 0;  ///< that came and were of use
    std::uint32_t dropped = 0;  ///< that were not looked at, since a newer one was there or the sender lost them
    std::uint32_t bad = 0;  ///< that were of no use: damaged, huge, black, frozen, of the wrong size
    std::uint32_t openings = 0;  ///< times that the source was opened
    Trouble       trouble = Trouble::absent;
    bool          ok = false;  ///< it is open and nothing is wrong
};

/// Not real time and without a thread: hal::Background calls turn().
class Worker {
public:
    /// `detect` is called with each frame that is of use, `publish` after it and after each change of the status without one. Lines are
    /// about `instance`. [setup]
    Worker(std::string instance, std::unique_ptr<Source> source, std::function<void(const Frame&)> detect,
           std::function<void(const Status&)> publish);

    /// Only frames of this size are of use, because `file` (a calibration) is about such. [setup]
    void expect(int width, int height, std::string file);
    /// Equal frames in a row that are a frozen camera; 0: never. [helper thread]
    void          freeze_after(std::uint32_t frames) { frozen_after_ = frames; }
    std::uint32_t source_frozen_after() const { return source_->frozen_after(); }
    /// Where lines go instead of standard error: for tests. [setup]
    void say_to(const std::function<void(const std::string&)>& say);

    /// A piece of work at `now_ns`; waits for a frame, at most 0.1 s, if it may. [helper thread]
    void turn(std::int64_t now_ns, bool may_wait) noexcept;
    /// Closes the source. No turn runs, and the next one opens it again. [setup]
    void          close() noexcept;
    const Status& status() const { return status_; }

private:
    void step(std::int64_t now_ns, bool may_wait);
    void open(std::int64_t now_ns);
    void take(const Frame& frame, std::int64_t now_ns);
    bool black(const Frame& frame) const;
    bool frozen(const Frame& frame);
    void trouble(Problem problem, std::int64_t now_ns);
    void well(std::int64_t now_ns);
    void publish();
    void say(const std::string& sentence);

    const std::string                        instance_;
    std::unique_ptr<hal::MessageLog>         log_;
    const std::unique_ptr<Source>            source_;
    const std::function<void(const Frame&)>  detect_;
    const std::function<void(const Status&)> publish_;
    Frame                                    frame_;
    Status                                   status_;
    std::string                              file_, remark_;
    int                                      width_ = 0, height_ = 0;  // 0: any
    std::uint32_t                            frozen_after_ = 0, equal_ = 0, dropped_before_ = 0;
    std::uint64_t                            picture_ = 0;  // a hash of the last one
    bool                                     open_ = false, told_ = false, ever_ = false;
    std::int64_t                             now_ = 0;  // of this turn
    std::int64_t                             try_again_ns_ = INT64_MIN, last_frame_ns_ = 0, since_ns_ = 0;
    std::int64_t                             said_ns_[trouble_count];  // when a line was last said about it
};

}  // namespace hal::vision
