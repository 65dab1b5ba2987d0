// SPDX-License-Identifier: MIT
// SYNC (1005h, 1006h, 1007h, 1019h) and TIME (1012h), produced and consumed.
#pragma once

#include "dictionary.hpp"
#include "emcy.hpp"
#include "events.hpp"
#include "frames.hpp"

namespace hal::canopen {

class Sync final : public Handler {
public:
    Sync(Dictionary&, FrameQueue& out, Emcy&);  // [setup]
    void reset() noexcept;
    /// Pre-operational and operational nodes produce and consume. The grid of the producer starts anew. [realtime]
    void set_active(bool active) noexcept;
    /// True: it is a SYNC (to be taken by on_sync of the others). [realtime]
    bool handle(const Frame&, Time now) noexcept;
    /// True: a SYNC was produced now. A period that was missed is skipped; the grid stays. [realtime]
    bool poll(Time now) noexcept;
    /// Produces one now, for a master whose thread is the clock (1006h is 0 then). False: not the producer, or no room. [realtime]
    bool produce(Time now) noexcept;
    /// True once, when a consumer that knows the period (1006h) misses it. [realtime]
    bool lost(Time now) noexcept;

    bool producer() const noexcept { return (cob_ & cob_flag30) != 0; }
    std::uint32_t cob() const noexcept { return cob_; }
    std::uint8_t counter() const noexcept { return counter_; }        ///< of the last SYNC; 0: it had none
    std::uint8_t overflow() const noexcept { return overflow_; }      ///< 1019h
    Time period() const noexcept { return period_; }
    Time window() const noexcept { return window_; }
    Time last() const noexcept { return last_; }
    std::uint64_t skipped() const noexcept { return skipped_; }

    Abort writing(Entry&, std::span<const std::uint8_t>) noexcept override;
    void written(Entry&) noexcept override { reset(); }

private:
    Dictionary& dictionary_;
    FrameQueue& out_;
    Emcy& emcy_;
    std::uint32_t cob_ = 0x80;
    Time period_ = 0, window_ = 0, next_ = 0, last_ = 0;
    std::uint8_t overflow_ = 0, counter_ = 0, next_counter_ = 1;
    bool active_ = false, started_ = false, seen_ = false, told_lost_ = false;
    std::uint64_t skipped_ = 0;
};

class TimeStamp final : public Handler {
public:
    TimeStamp(Dictionary&, FrameQueue& out);  // [setup]
    void reset() noexcept { cob_ = dictionary_.get<std::uint32_t>(0x1012, 0); }
    /// True: it is a TIME and this node consumes it. [realtime]
    bool handle(const Frame&, TimeOfDay&) noexcept;
    /// False: 1012h does not make this node the producer, or no room. [realtime]
    bool produce(const TimeOfDay&) noexcept;
    Abort writing(Entry&, std::span<const std::uint8_t>) noexcept override;
    void written(Entry&) noexcept override { reset(); }

private:
    Dictionary& dictionary_;
    FrameQueue& out_;
    std::uint32_t cob_ = 0;
};

}  // namespace hal::canopen
