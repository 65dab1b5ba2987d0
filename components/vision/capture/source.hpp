// SPDX-License-Identifier: MIT
// Frame sources. The address selects the driver: v4l2:/dev/video0, frames:FOLDER, sim:SCENE.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <string>

#include "vision/capture/address.hpp"
#include "vision/capture/frame.hpp"

namespace hal::vision {

/// Reason why frames are invalid. The numbers are those of the pin `error-code`.
enum class FrameError : std::uint8_t {
    none,
    missing,      ///< missing camera or folder
    unusable,     ///< unusable: permission denied, busy, not a camera, no supported format
    unplugged,    ///< disconnected
    timeout,      ///< no frames
    damaged,      ///< unreadable frame or file
    too_large,    ///< frame larger than the limit
    black,        ///< black frames
    frozen,       ///< identical frames
    wrong_size,   ///< frames are not of the calibration's size
    ended,        ///< all frames of a folder were shown
};
constexpr int frame_error_count = 11;
/// "unplugged", "wrong size" … [any]
const char* to_string(FrameError);

struct Problem {
    FrameError kind = FrameError::none;
    std::string text;  ///< message without a full stop: "/dev/video0 was unplugged"
};

enum class Got : std::uint8_t {
    frame,    ///< it is in `frame`
    nothing,  ///< none until the timeout
    bad,      ///< an invalid frame: problem(); the next may be valid
    ended,    ///< no frame will follow: problem(), once
    lost,     ///< the source failed: problem(); close and reopen it
};

/// A camera or a substitute. Used by one thread at a time. The constructor parses the address and
/// opens nothing.
class Source {
public:
    virtual ~Source() = default;
    /// Opens the source. Returns false with the reason in problem(); may be retried. [setup, or the
    /// helper thread]
    virtual bool open(std::int64_t now_ns) = 0;
    /// Reads the newest unread frame at `now_ns`; older ones are skipped and counted. Waits at most
    /// `timeout_ns`; with 0 it does not wait, so that the result depends on `now_ns` alone where
    /// the source supports it.
    virtual Got next(std::int64_t now_ns, std::int64_t timeout_ns, Frame& frame) = 0;
    virtual void close() noexcept = 0;
    const Problem& problem() const { return problem_; }
    /// Returns how the open source deviates from its address, without a full stop; empty: it does
    /// not.
    virtual std::string remark() const { return {}; }
    /// Returns the number of frames skipped since open(), including those lost by the camera.
    std::uint64_t skipped() const { return skipped_; }
    /// Returns the time without a frame after which it is logged, s.
    virtual double timeout_s() const { return 1.0; }
    /// Returns the number of identical frames that count as a frozen camera; 0: never, for pictures
    /// without noise.
    virtual std::uint32_t frozen_after() const { return 0; }

protected:
    bool fail(FrameError kind, std::string text) {
        problem_ = {kind, std::move(text)};
        return false;
    }
    std::uint64_t skipped_ = 0;

private:
    Problem problem_;
};

/// Creates the source of an address. Throws std::invalid_argument if it is invalid. `find` returns
/// the path of a file or folder named relative to the netlist (hal::Texts::find). [setup]
std::unique_ptr<Source> make_source(const std::string& address,
                                    const std::function<std::string(const std::string&)>& find);

std::unique_ptr<Source> v4l2_source(Address);  ///< shared by all components that name the camera
std::unique_ptr<Source> frames_source(Address,
                                      const std::function<std::string(const std::string&)>& find);
std::unique_ptr<Source> sim_source(Address);  ///< scene/source_sim.cpp

}  // namespace hal::vision
