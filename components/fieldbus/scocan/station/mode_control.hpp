// SPDX-License-Identifier: MIT
// The mode of a node. For a change the SYNC node asks all nodes to prepare; when all are ready, the
// SYNCs announce the change, and all switch at one cycle.
#pragma once

#include <array>

#include "fieldbus/scocan/station/station_core.hpp"

namespace hal::scocan {

/// The mode. [realtime]
class ModeControl {
public:
    /// The core outlives it. [setup]
    explicit ModeControl(StationCore& core) noexcept : core_(core) {}
    void attach() noexcept { mode_ = 0; }  ///< [setup]
    /// Forgets what came from the bus.
    void forget() noexcept;
    /// Ends the request of a node that does not send the SYNC any more.
    void cancel() noexcept { change_ = {}; }

    // the node that sends the SYNC
    bool request(std::uint32_t mode) noexcept;
    bool changing() const noexcept { return change_.active; }
    /// Returns true when the SYNC of a cycle announces a change.
    bool announces(std::uint64_t cycle) const noexcept {
        return change_.agreed && cycle < change_.at;
    }
    /// Handles the answer of a node.
    void answered(const Answer&) noexcept;
    /// Continues a mode change, once a cycle.
    void continue_change() noexcept;

    // every node
    /// Prepares, or cancels, and answers.
    void prepare(const Request&) noexcept;
    /// Uses the mode in the SYNC of another node, and its announcement of a change.
    void confirm(const Sync&) noexcept;
    void follow(const Sync&) noexcept;
    /// Switches at the begin of the agreed cycle, or forgets a change that was not agreed.
    void switch_over() noexcept;

    std::uint32_t mode() const noexcept { return mode_; }
    /// Returns the mode of a cycle.
    std::uint32_t of(std::uint64_t cycle) const noexcept {
        return armed_.confirmed && cycle >= armed_.at ? armed_.mode : mode_;
    }
    /// Returns false while it is unknown whether the mode changes with that cycle: its SYNC shows
    /// it.
    bool settled(std::uint64_t cycle) const noexcept;
    /// Returns true when the SYNC has a mode that the table does not have.
    bool unknown() const noexcept { return unknown_; }

private:
    struct Change {  // requested by the node that sends the SYNC
        bool active = false;
        bool agreed = false;
        std::uint32_t mode = 0;
        std::uint64_t at = 0;  // cycle of the switch
        std::array<bool, max_nodes> ready{};
    };
    struct Armed {  // prepared in every node
        bool prepared = false;
        bool confirmed = false;
        std::uint32_t mode = 0;
        std::uint64_t at = 0;  // cycle of the switch
    };
    void enter(std::uint32_t mode) noexcept;
    void refuse(std::uint32_t who, Answer::Reason) noexcept;
    std::uint32_t first_missing() const noexcept;

    StationCore& core_;
    std::uint32_t mode_ = 0;
    bool unknown_ = false;
    Armed armed_;
    Change change_;
};

}  // namespace hal::scocan
