// SPDX-License-Identifier: MIT
// A packet socket whose frames the kernel writes into memory that it shares with us (TPACKET_V2): looking for one costs no system
// call, and each carries the time at which the kernel got it.
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

    /// Opens the socket; it receives nothing before bind(). What is wrong, or nothing. [setup]
    std::string open(const Options&);
    /// To the interface of that number, again after it was gone. `errno` says why not. [setup] monitor
    bool bind(int index) noexcept;

    /// The next frame; it stays until the next call of this or of ready(). [realtime] receiver
    std::optional<Arrival> next(RealTime&) noexcept;
    /// Whether there is one. [realtime] receiver
    bool ready() noexcept {
        release();
        return (status(next_).load(std::memory_order_acquire) & user_) != 0;
    }
    int descriptor() const noexcept { return socket_.get(); }
    /// What the kernel found no room for since the last call. [setup] monitor
    std::uint64_t lost() noexcept;

    std::atomic<std::uint64_t> received{0}, received_bytes{0}, errors{0};  ///< written by the receiver

private:
    std::atomic_ref<std::uint32_t> status(std::size_t frame) noexcept;
    void release() noexcept;
    static const std::uint32_t user_;

    link::Descriptor socket_;
    std::uint8_t* memory_ = nullptr;
    std::size_t frames_ = 0;
    std::uint16_t protocol_ = 0;  ///< as the socket takes it: one type, or all with a filter
    bool promiscuous_ = false;
    std::size_t next_ = 0;        ///< this and the next two: the receiving thread's
    bool held_ = false;           ///< the frame before `next_` is still looked at
    std::int64_t last_ns_ = INT64_MIN / 2;
};

}  // namespace hal::ethernet::rawether
