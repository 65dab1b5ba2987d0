// SPDX-License-Identifier: MIT
// Connects a line of emulated slaves to ports: on a `sim:` segment it answers frames while they
// arrive; a loop serves a real interface.
#pragma once

#include <atomic>
#include <cstdint>

#include "ethercat/esc/line.hpp"
#include "link/ethernet.hpp"
#include "link/segment.hpp"

namespace hal::ethercat::esc {

/// Lets a line answer on one or two segments in memory, until it is destroyed. Both segments must
/// be worked by the same thread.
class LineOnSegments {
public:
    /// `secondary` may be nullptr. Line and ports must outlive this object. [setup]
    LineOnSegments(Line& line, ethernet::Port& primary, ethernet::Port* secondary = nullptr);
    ~LineOnSegments();
    LineOnSegments(const LineOnSegments&) = delete;
    LineOnSegments& operator=(const LineOnSegments&) = delete;

    /// Returns false if a port is not on a segment in memory, or another device answers there.
    /// [setup]
    bool connected() const noexcept { return connected_; }

private:
    struct Side final : ethernet::Responder {
        LineOnSegments* owner = nullptr;
        End end = End::primary;
        void arrived(std::span<std::uint8_t> frame, std::int64_t first_bit_ns) noexcept override;
    };

    Line& line_;
    ethernet::Port* ports_[2];
    Side sides_[2];
    bool connected_ = false;
};

/// What changes a line while serve() works it.
struct ServeControl {
    virtual ~ServeControl() = default;
    /// Changes the line: power, cables, disturbances.
    virtual void work(Line&, std::int64_t now_ns) noexcept = 0;
};
/// Serves a line on one or two ports of any kind until `stop`. The ports should be promiscuous.
/// `control` runs between frames, about every millisecond; it may be nullptr. [realtime] in a
/// thread of its own; it waits for frames only
void serve(Line& line, ethernet::Port& primary, ethernet::Port* secondary,
           const std::atomic<bool>& stop, ServeControl* control = nullptr) noexcept;

}  // namespace hal::ethercat::esc
