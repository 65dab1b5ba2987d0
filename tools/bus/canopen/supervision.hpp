// SPDX-License-Identifier: MIT
// Stops a drive when this program is gone: the drive monitors our heartbeat (1016h), or life
// guarding (100Ch, 100Dh).
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "bus/canopen/node_client.hpp"

namespace hal::tools {

struct SupervisionSettings {
    /// timeout after which the drive reacts; 0: no supervision
    std::int64_t limit_ns = 500'000'000;
    std::uint8_t own_node = 0;            ///< node ID of our heartbeat; 0: a free one
};

/// Set up before the first motion and removed at the end. Heartbeats are sent by
/// NodeClient::turn(), so a program that hangs loses its drive as well as a killed one.
class Supervision {
public:
    Supervision(const Options&, NodeClient&, std::uint8_t node, const SupervisionSettings&);

    /// Makes the drive stop this axis when our heartbeat ends; reports on stderr what it cannot.
    /// False: the bus failed, and it was reported.
    bool arm(unsigned axis);
    /// Restores what arm() changed. Returns true also when there was nothing to restore.
    bool release();
    bool active() const { return way_ != Way::none; }
    /// Returns true when another device sends heartbeats with our node ID, so supervision is
    /// ineffective.
    bool collided() const { return collided_; }
    std::uint8_t own_node() const { return own_; }

private:
    enum class Way : std::uint8_t { none, heartbeat, guarding };
    enum class Read : std::uint8_t { value, missing, failed };
    struct Changed {
        std::uint16_t index;
        std::uint8_t sub;
        unsigned bytes;
        std::uint32_t was;
    };

    Read read(std::uint16_t index, std::uint8_t sub, std::uint32_t& value);
    /// Returns false when the drive rejected the write, or the bus failed and `failed` is set.
    bool write(std::uint16_t index, std::uint8_t sub, unsigned bytes, std::uint32_t value,
               bool& failed);
    bool change(std::uint16_t index, std::uint8_t sub, unsigned bytes, std::uint32_t was,
                std::uint32_t value, bool& failed);
    bool set_up();
    static unsigned node_in(std::uint32_t entry);
    bool read_consumer(std::vector<std::uint32_t>& entries);
    std::uint8_t free_node_id() const;
    bool is_left_over(std::uint32_t entry) const;
    std::optional<std::size_t> choose_entry(std::vector<std::uint32_t>& entries);
    bool by_heartbeat(std::string& why_not);
    bool by_guarding(std::string& why_not);
    bool set_reaction(unsigned axis);
    void send_heartbeat(std::int64_t now);
    void warn(const std::string& sentence) const;

    const Options& options_;
    NodeClient& station_;
    const std::uint8_t node_;
    const SupervisionSettings settings_;
    const std::int64_t began_;
    std::array<bool, 128> heartbeat_seen_{};  // heartbeats of others
    Way way_ = Way::none;
    bool tried_ = false;
    bool collided_ = false;
    std::uint8_t own_ = 0;
    std::uint8_t axes_done_ = 0;  // a bit per axis
    std::int64_t next_heartbeat_ = 0;
    std::vector<Changed> changed_;
};

}  // namespace hal::tools
