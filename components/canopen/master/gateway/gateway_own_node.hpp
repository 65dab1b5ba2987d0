// SPDX-License-Identifier: MIT
// The gateway's own node: a few objects that its clients read and write, and the bus does not
// reach, and its heartbeat.
#pragma once

#include <cstdint>
#include <string>

#include "canopen/protocol/dictionary.hpp"
#include "canopen/protocol/frames.hpp"
#include "gateway_command.hpp"

namespace hal::canopen::gateway {

/// Returns the response to an SDO abort: `ERROR:0x06020000 #object does not exist …`.
std::string abort_text(Abort);
/// Returns the response to a read: the value in a format, or its bytes without one.
std::string value_text(std::span<const std::uint8_t> value, const Format*);

/// The identity of a gateway in `info version`, and in its own node as 1018h, 1008h (product name)
/// and 2000h (the three names).
struct Identity {
    static constexpr std::size_t max_name = 200;  ///< bytes of a name
    /// as registered with CiA; 0: none. revision: major << 16 | minor
    std::uint32_t vendor = 0;
    std::uint32_t product = 0;
    std::uint32_t revision = 0;
    std::uint32_t serial = 0;
    std::string vendor_name = "Halcyon";
    std::string product_name = "Halcyon CiA 309-3 gateway";

    std::string order_code = "";
};
/// Returns the objects of the own node of a gateway.
Description own_objects(const Identity&);

/// See the top of this file. All functions [setup].
class OwnNode {
public:
    explicit OwnNode(const Identity& identity) : dictionary_(own_objects(identity)) {}

    std::uint8_t id() const { return id_; }  ///< 0: none
    void set_id(std::uint8_t id) { id_ = id; }
    Time heartbeat() const { return heartbeat_; }  ///< period; 0: off
    void set_heartbeat(Time period, Time now) {
        heartbeat_ = period;
        next_heartbeat_ = now;
    }
    /// Executes `read` or `write`; returns the response.
    std::string transfer(const Command&, Time now);
    /// Sends the heartbeat when it is due.
    void poll(FrameQueue& out, Time now);

private:
    Dictionary dictionary_;
    std::uint8_t id_ = 0;
    Time heartbeat_ = 0;
    Time next_heartbeat_ = 0;
};

}  // namespace hal::canopen::gateway
