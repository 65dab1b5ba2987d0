// SPDX-License-Identifier: MIT
// What a packed frame gets when it leaves: its number, its check sequence, and, with a key, its counter and its tag. So a frame that waited
// for its slot and was dropped takes no number, and whoever finds a gap knows that the wire lost something.
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

    /// One for a link. Frames may still wait for their time when the link is gone, so that it stays, and serves another link later. [setup]
    static std::shared_ptr<Seal> take(const std::optional<Key>& key, bool simulated);

private:
    Sequences& sequences_of(std::span<const std::uint8_t> frame) noexcept { return is_service(frame) ? service_ : process_; }

    Sequences process_, service_;  // frames of services alone leave later, and are counted apart
    std::optional<Key> key_;
    bool simulated_ = false;
};

}  // namespace hal::can::cane
