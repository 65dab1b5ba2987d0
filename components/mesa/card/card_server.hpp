// SPDX-License-Identifier: MIT
// An emulated card as a device that answers datagrams, with the faults of the card and of the way
// to it.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "link/datagram.hpp"
#include "mesa/card/card_fault.hpp"
#include "mesa/card/emulated_card.hpp"

namespace hal::mesa {

class CardServer final : public datagram::Server {
public:
    /// `card` outlives it. [setup]
    explicit CardServer(EmulatedCard& card) : card_(card) {}
    /// Changed in setup, or while no request is served.
    std::vector<CardFault>& faults() noexcept { return faults_; }
    /// Datagrams lost at random in each direction, 0..1.
    void set_loss(double share) noexcept { loss_ = share; }
    /// Begins a fault that happens once. [realtime]
    void strike(CardFaultKind kind) noexcept;

    /// Lets the time of the card pass, and applies the faults that do not wait for a request.
    /// [realtime]
    void advance(std::int64_t now_ns) noexcept;
    void serve(std::span<const std::uint8_t> request, std::int64_t now_ns,
               datagram::Replies& replies) noexcept override;
    std::uint64_t lost() const noexcept { return lost_; }

private:
    using Buffer = std::array<std::uint8_t, datagram::max_size>;

    bool hits(CardFaultKind kind) noexcept;
    bool lasts(CardFaultKind kind) const noexcept;
    std::int64_t delay() noexcept;
    bool is_lost_at_random() noexcept;
    void reply(std::span<const std::uint8_t> bytes, datagram::Replies& replies) noexcept;

    EmulatedCard& card_;
    std::vector<CardFault> faults_;
    double loss_ = 0.0;
    std::uint64_t random_ = 0x9e3779b97f4a7c15;
    std::int64_t first_ns_ = datagram::unclocked;
    std::int64_t newest_ns_ = 0;
    std::uint64_t lost_ = 0;
    Buffer reply_{}, held_{};
    std::size_t held_size_ = 0;  ///< of a reply that waits for the next one
};

}  // namespace hal::mesa
