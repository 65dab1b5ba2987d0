// SPDX-License-Identifier: MIT
// The ports of an emulated controller: which are open (loop control 0101h, DL status 0110h), and
// their error counters (0300h to 0313h).
#pragma once

#include <array>
#include <cstdint>

namespace hal::ethercat::esc {

/// What a port is made of, as 0007h codes it.
enum class PortKind : std::uint8_t { none = 0, unconfigured = 1, ebus = 2, mii = 3 };
inline constexpr unsigned ports = 4;

/// The ports. [realtime] unless marked.
class Ports {
public:
    /// `memory` is that of the controller. [setup]
    void connect(std::uint8_t* memory, const std::array<PortKind, ports>& kinds) noexcept {
        memory_ = memory;
        kinds_ = kinds;
    }
    /// Opens the ports that closed by themselves; update() is due.
    void open_lost() noexcept { lost_ = 0; }
    /// Handles a change of the link of a port; `powered`: the controller counts it. Returns whether
    /// update() is due.
    bool set_link(unsigned port, bool up, bool powered) noexcept;
    /// Opens a port that closed by itself and waits for a frame (loop control 1). Returns whether
    /// update() is due.
    bool frame_at_closed_port(unsigned port) noexcept;
    /// Opens and closes the ports as loop control and links demand. Returns whether DL status
    /// changed.
    bool update(bool eeprom_loaded) noexcept;
    std::uint8_t open() const noexcept { return open_; }  ///< Returns a bit for each open port.
    /// Returns whether frames leave at a port.
    bool is_open(unsigned port) const noexcept { return (open_ >> port & 1) != 0; }

    // Count a frame with a wrong check sequence: first seen here, marked by a controller before, in
    // the processing unit.
    void count_invalid(unsigned port) noexcept;
    void count_forwarded(unsigned port) noexcept;
    void count_unit_error() noexcept;
    /// Counts a symbol error of the physical layer.
    void count_symbol_error(unsigned port) noexcept;

private:
    bool has_link(unsigned port) const noexcept { return (link_ >> port & 1) != 0; }
    bool opens(unsigned port) const noexcept;

    std::uint8_t* memory_ = nullptr;
    std::array<PortKind, ports> kinds_{};
    // a bit for each port; lost_: closed by itself (loop control 1)
    std::uint8_t link_ = 0;
    std::uint8_t open_ = 0;
    std::uint8_t lost_ = 0;
};

}  // namespace hal::ethercat::esc
