// SPDX-License-Identifier: MIT
// Who is alive: heartbeat produced (1017h) and consumed (1016h), node guarding answered and life guarding (100Ch, 100Dh).
#pragma once

#include <array>

#include "dictionary.hpp"
#include "events.hpp"
#include "frames.hpp"

namespace hal::canopen {

class ErrorControl final : public Handler {
public:
    ErrorControl(Dictionary&, FrameQueue& out);  // [setup]
    /// Communication was reset. [realtime]
    void reset(std::uint8_t node_id) noexcept;
    /// The boot-up message and from then on the heartbeat. [realtime]
    void boot(Time now) noexcept;
    void set_state(NmtState state) noexcept { state_ = state; }

    /// True: it is a frame of error control. [realtime]
    bool handle(const Frame&, Time now, Events&) noexcept;
    struct Verdict {
        bool lost = false;      ///< a node we consume, or the master's guarding, fell silent just now
        std::uint8_t node = 0;  ///< which; 0: the master
        bool back = false;      ///< nothing is silent any more
    };
    Verdict poll(Time now, Events&) noexcept;

    /// Every node of 1016h is heard. Nodes not heard yet do not count as lost.
    bool all_alive() const noexcept { return lost_ == 0 && !life_lost_; }
    /// Somebody else sent with our node-id since communication was reset.
    bool collided() const noexcept { return collided_; }

    Abort writing(Entry&, std::span<const std::uint8_t>) noexcept override;
    void written(Entry&) noexcept override;

private:
    struct Consumer {
        std::uint8_t node = 0;
        Time limit = 0, heard = 0;
        bool watching = false, lost = false;
        NmtState state = NmtState::initialising;
    };
    void read_consumer(const Entry&) noexcept;
    void read_producer() noexcept;
    void send_boot_up() noexcept;

    Dictionary& dictionary_;
    FrameQueue& out_;
    std::uint8_t node_id_ = 0;
    NmtState state_ = NmtState::initialising;
    Time period_ = 0, next_ = 0;
    bool booted_ = false, boot_pending_ = false, due_now_ = false;
    // life guarding
    Time life_time_ = 0, guarded_ = 0;
    bool guarding_ = false, life_lost_ = false;
    std::uint8_t toggle_ = 0;
    std::array<Consumer, 128> consumers_{};
    std::size_t highest_ = 0;
    unsigned lost_ = 0;
    bool collided_ = false;
};

}  // namespace hal::canopen
