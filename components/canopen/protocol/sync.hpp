// SPDX-License-Identifier: MIT
// Producers and consumers of SYNC (1005h, 1006h, 1007h, 1019h) and TIME (1012h) (CiA 301).
#pragma once

#include "dictionary.hpp"
#include "emcy.hpp"
#include "events.hpp"
#include "frames.hpp"

namespace hal::canopen {

/// The SYNC service of a node. All calls belong to one thread.
class Sync final : public Handler {
public:
    /// Creates the service; all arguments outlive it. [setup]
    Sync(Dictionary&, FrameQueue& out, Emcy&);
    /// Reads all parameters. [realtime]
    void reset() noexcept;
    /// Enables the service, in the NMT states pre-operational and operational; restarts the period
    /// of the producer. [realtime]
    void set_active(bool active) noexcept;
    /// Processes a frame; returns true if it is a SYNC. [realtime]
    bool handle(const Frame&, Time now) noexcept;
    /// Sends a SYNC when it is due and returns true if it did. Missed periods are skipped; the
    /// phase is kept. [realtime]
    bool poll(Time now) noexcept;
    /// Sends a SYNC now, for a thread that is the clock (with 1006h = 0). Returns false if this
    /// node is not the producer or the queue is full. [realtime]
    bool produce(Time now) noexcept;
    /// Returns true once when no SYNC arrived within one and a half times the period 1006h.
    /// [realtime]
    bool lost(Time now) noexcept;

    /// Returns true if this node produces SYNC (1005h bit 30). [any]
    bool producer() const noexcept { return (cob_ & cob_flag30) != 0; }
    /// Returns object 1005h. [any]
    std::uint32_t cob() const noexcept { return cob_; }
    /// Returns the counter of the last SYNC; 0: it carried none. [any]
    std::uint8_t counter() const noexcept { return counter_; }
    /// Returns the counter overflow value 1019h; 0: no counter. [any]
    std::uint8_t overflow() const noexcept { return overflow_; }
    /// Returns the communication cycle period 1006h in ns; 0: none. [any]
    Time period() const noexcept { return period_; }
    /// Returns the synchronous window 1007h in ns; 0: none. [any]
    Time window() const noexcept { return window_; }
    /// Returns the time of the last SYNC. [any]
    Time last() const noexcept { return last_; }
    /// Returns the number of periods for which no SYNC was sent. [any]
    std::uint64_t skipped() const noexcept { return skipped_; }

    Abort writing(Entry&, std::span<const std::uint8_t>) noexcept override;
    void written(Entry&) noexcept override { reset(); }

private:
    Dictionary& dictionary_;
    FrameQueue& out_;
    Emcy& emcy_;
    std::uint32_t cob_ = 0x80;
    Time period_ = 0;
    Time window_ = 0;
    Time next_ = 0;
    Time last_ = 0;
    std::uint8_t overflow_ = 0;
    std::uint8_t counter_ = 0;
    std::uint8_t next_counter_ = 1;
    bool active_ = false;
    bool started_ = false;
    bool seen_ = false;
    bool lost_reported_ = false;
    std::uint64_t skipped_ = 0;
};

/// The TIME service of a node. All calls belong to one thread.
class TimeStamp final : public Handler {
public:
    /// Creates the service; both arguments outlive it. [setup]
    TimeStamp(Dictionary&, FrameQueue& out);
    /// Reads 1012h. [realtime]
    void reset() noexcept { cob_ = dictionary_.get<std::uint32_t>(0x1012, 0); }
    /// Processes a frame; returns true and sets the time if it is a TIME message that this node
    /// consumes. [realtime]
    bool handle(const Frame&, TimeOfDay&) noexcept;
    /// Sends a TIME message. Returns false if this node is not the producer (1012h bit 30) or the
    /// queue is full. [realtime]
    bool produce(const TimeOfDay&) noexcept;
    Abort writing(Entry&, std::span<const std::uint8_t>) noexcept override;
    void written(Entry&) noexcept override { reset(); }

private:
    Dictionary& dictionary_;
    FrameQueue& out_;
    std::uint32_t cob_ = 0;
};

}  // namespace hal::canopen
