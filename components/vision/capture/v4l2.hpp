// SPDX-License-Identifier: MIT
// A camera by Video4Linux2 (the kernel's userspace API guide, part I), memory-mapped buffers.
#pragma once

#include <cstddef>
#include <memory>

#include "vision/capture/source.hpp"

namespace hal::vision {

/// The system calls a camera is used by, so that tests can stand in for the kernel. They return -1
/// and set errno as the real ones do.
class VideoSystem {
public:
    virtual ~VideoSystem() = default;
    virtual int open(const char* path) = 0;  ///< read and write, non-blocking
    virtual int control(int fd, unsigned long request, void* argument) = 0;
    virtual void* map(int fd, std::size_t bytes, std::int64_t offset) = 0;  ///< nullptr: failed
    virtual void unmap(void* at, std::size_t bytes) = 0;
    /// 1: a frame may be there, 0: time-out, -1: the device is in an error or gone.
    virtual int wait(int fd, int timeout_ms) = 0;
    virtual void close(int fd) = 0;
};
VideoSystem& kernel();

/// Alone with its camera.
std::unique_ptr<Source> v4l2_source(Address, VideoSystem&);
/// The same camera may be opened by several, all in one way: each gets each frame. Their helper
/// threads meet at a lock, no cycle does.
std::unique_ptr<Source> shared_camera(Address, VideoSystem&);

/// YUYV (4:2:2, ITU-R BT.601 limited range) to BGR, `pixels` even. [any]
void yuyv_to_bgr(const std::uint8_t* yuyv, std::uint8_t* bgr, std::size_t pixels);

}  // namespace hal::vision
