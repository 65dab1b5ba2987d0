// SPDX-License-Identifier: MIT
// A packet socket whose frames the kernel writes into shared memory (TPACKET_V2): polling it costs
// no system call, and each frame has the time at which the kernel received it.
#pragma once

#include <atomic>
#include <string>

#include "link/ethernet.hpp"
#include "link/system.hpp"
#include "raw_clock.hpp"

namespace hal::ethernet::rawether {

class Receiver {
public:
    Receiver() = default;
    ~Receiver();
    Receiver(const Receiver&) = delete;
    Receiver& operator=(const Receiver&) = delete;

    /// Opens the socket; it receives nothing before bind(). Returns the problem, or "". [setup]
    std::string open(const Options&);
    /// Binds it to the interface of that number, also after the interface was lost. On failure
    /// `errno` is set. [setup] monitor
    bool bind(int index) noexcept;

    /// Returns the next frame, valid until the next call of this or of ready(). [realtime] receiver
    std::optional<Arrival> next(RealTime&) noexcept;
    /// Returns whether there is one. [realtime] receiver
    bool ready() noexcept {
        release();
        return (status(next_).load(std::memory_order_acquire) & user_) != 0;
    }
    int descriptor() const noexcept { return socket_.get(); }
    /// Returns how many frames the kernel dropped since the last call. [setup] monitor
    std::uint64_t lost() noexcept;

    /// written by the receiver
    std::atomic<std::uint64_t> received{0};
    std::atomic<std::uint64_t> received_bytes{0};
    std::atomic<std::uint64_t> errors{0};

private:
    std::atomic_ref<std::uint32_t> status(std::size_t frame) noexcept;
    void release() noexcept;
    static const std::uint32_t user_;

    link::Descriptor socket_;
    std::uint8_t* memory_ = nullptr;
    std::size_t frames_ = 0;
    std::uint16_t protocol_ = 0;  ///< of the socket: one type, or all with a filter
    bool promiscuous_ = false;
    std::size_t next_ = 0;  ///< this and the next two: used by the receiving thread
    bool held_ = false;  ///< the frame before `next_` is still in use
    std::int64_t last_ns_ = INT64_MIN / 2;
};

}  // namespace hal::ethernet::rawether
