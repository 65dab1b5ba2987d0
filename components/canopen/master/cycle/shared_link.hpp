// SPDX-License-Identifier: MIT
// One CAN controller for several masters of this process: two independent masters would send NMT
// commands, SYNCs and heartbeats with the same identifier at the same time, which CAN does not
// allow.
#pragma once

#include <array>
#include <atomic>
#include <memory>
#include <string>

#include "hal/queue.hpp"
#include "link/can.hpp"

namespace hal::canopen {

class SharedBus;

/// A master's share of a link. What one sends the others hear, too. Those of one bus belong into
/// one thread; in another one a master that finds the link in use waits for its next cycle. Which
/// one gets it, and which one leads, is in the journal of the program.
class SharedLink final : public can::Link {
public:
    /// Opens the address, or joins those that have it open. [setup]
    static std::unique_ptr<SharedLink> open(const std::string& address, const can::Options&,
                                            std::string& problem);
    ~SharedLink() override;

    /// True for the one of those with this node-id that makes the SYNC and the heartbeat. When it
    /// goes, or has not asked for four periods, another takes over. [realtime]
    bool leads(std::uint8_t node_id, std::int64_t now_ns, std::int64_t period_ns) noexcept;

    can::Sent send(const can::Frame&, std::int64_t now_ns) noexcept override;
    void flush(std::int64_t now_ns) noexcept override;
    std::size_t receive(std::span<can::Frame> buffer, std::int64_t now_ns) noexcept override;
    can::Statistics statistics() const noexcept override;
    can::State state() const noexcept override;
    void restart() noexcept override;
    bool set_filters(std::span<const can::Filter>) override { return false; }
    const can::Description& description() const noexcept override;
    std::vector<can::DeliveryTime> delivery_times() const override;
    std::int64_t closing_ns() const noexcept override;
    bool wait(std::int64_t at_most_ns) override;
    bool rejected(can::Rejected&) noexcept override;

private:
    friend class SharedBus;
    explicit SharedLink(std::shared_ptr<SharedBus>);
    bool claims_lead(std::uint8_t node_id, std::int64_t now_ns, std::int64_t period_ns) noexcept;

    const std::shared_ptr<SharedBus> bus_;
    hal::Queue<can::Frame> incoming_{2048};  // pushed and popped by the holder of the bus
};

}  // namespace hal::canopen
