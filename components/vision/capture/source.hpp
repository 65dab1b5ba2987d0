// SPDX-License-Identifier: MIT
// Where frames come from. An address picks the driver: v4l2:/dev/video0, frames:FOLDER, sim:SCENE.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <string>

#include "vision/capture/address.hpp"
#include "vision/capture/frame.hpp"

namespace hal::vision {

/// What keeps frames from being of use. The numbers are those of the pin `trouble`.
enum class Trouble : std::uint8_t {
    none,
    absent,       ///< there is no such camera or folder
    refused,      ///< it is there and cannot be used: permission, busy, no camera, no usable format
    unplugged,    ///< it was there and went away
    silent,       ///< it gives no frames
    damaged,      ///< a frame or file that cannot be read
    huge,         ///< a frame larger than a frame may be
    black,        ///< nothing is seen
    frozen,       ///< always the same picture
    wrong_size,   ///< frames are not of the calibration's size
    ended,        ///< all frames of a folder were shown
};
constexpr int trouble_count = 11;
/// "unplugged", "wrong size" … [any]
const char* word(Trouble);

struct Problem {
    Trouble     kind = Trouble::none;
    std::string text;  ///< a sentence without its end: "/dev/video0 was unplugged"
};

enum class Got : std::uint8_t {
    frame,    ///< it is in `frame`
    nothing,  ///< none until the time-out
    bad,      ///< one came and is of no use: problem(); the next may be good
    lost,     ///< the source is of no use any more: problem(); close it, open it again
};

/// One camera, or what stands in for one. Used by one thread at a time. The constructor reads the address and touches nothing.
class Source {
public:
    virtual ~Source() = default;
    /// False: problem() says why. May be tried again. [setup, or the helper thread]
    virtual bool open(std::int64_t now_ns) = 0;
    /// The newest frame that there is at `now_ns` and was not given yet; older ones are skipped and counted. Waits for it at most
    /// `timeout_ns`; 0: not at all, so that what comes depends on `now_ns` alone where a source can do that.
    virtual Got    next(std::int64_t now_ns, std::int64_t timeout_ns, Frame& frame) = 0;
    virtual void   close() noexcept = 0;
    const Problem& problem() const { return problem_; }
    /// Of the source that is open: what it does other than its address says, a sentence without its end; empty when there is nothing.
    virtual std::string remark() const { return {}; }
    /// Frames that were there and were not given, since open(). What the sender lost counts too.
    std::uint64_t skipped() const { return skipped_; }
    /// How long no frame may come before that is worth a line, s.
    virtual double patience_s() const { return 1.0; }
    /// So many equal frames in a row are a frozen camera; 0: they are no such sign, as pictures have no noise.
    virtual std::uint32_t frozen_after() const { return 0; }

protected:
    bool fail(Trouble kind, std::string text) {
        problem_ = {kind, std::move(text)};
        return false;
    }
    std::uint64_t skipped_ = 0;

private:
    Problem problem_;
};

/// Throws std::invalid_argument when the address is wrong. `find` gives the place of a file or folder that is named relative to the
/// netlist (hal::Texts::find). [setup]
std::unique_ptr<Source> make_source(const std::string& address, const std::function<std::string(const std::string&)>& find);

std::unique_ptr<Source> v4l2_source(Address);  ///< shared by all that name the camera
std::unique_ptr<Source> frames_source(Address, const std::function<std::string(const std::string&)>& find);
std::unique_ptr<Source> sim_source(Address);  ///< scene/source_sim.cpp

}  // namespace hal::vision
