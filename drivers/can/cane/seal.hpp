// SPDX-License-Identifier: MIT
// Completes a packed frame when it is sent: sequence number, check sequence and, with a key,
// counter and tag. A frame dropped while waiting for its slot takes no number, so a gap at the
// receiver means a loss on the segment.
#pragma once

#include <atomic>
#include <memory>
#include <optional>

#include "cane_stations.hpp"

namespace hal::can::cane {

class Seal final : public ethernet::Finisher {
public:
    void leaves(std::span<std::uint8_t> frame) noexcept override;
    void stayed(std::span<const std::uint8_t> frame) noexcept override;

    /// Returns a seal for a link. It outlives the link, because frames may still be queued, and is
    /// reused for a later link. [setup]
    static std::shared_ptr<Seal> take(const std::optional<Key>& key, bool simulated);

private:
    Sequences& sequences_of(std::span<const std::uint8_t> frame) noexcept {
        return is_service(frame) ? service_ : process_;
    }

    Sequences process_, service_;  // frames of services only are sent later and counted separately
    std::optional<Key> key_;
    bool simulated_ = false;
};

}  // namespace hal::can::cane
