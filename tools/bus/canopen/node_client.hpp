// SPDX-License-Identifier: MIT
// A client of the nodes on a bus, for commands: blocking requests in this thread.
#pragma once

#include <functional>
#include <string>

#include "bus/can/bus.hpp"
#include "canopen/master/network.hpp"

namespace hal::tools {

class NodeClient final : private canopen::DeviceEvents {
public:
    /// `timeout_ns`: of one response; 0: the default.
    explicit NodeClient(const Options&, std::int64_t timeout_ns);

    /// Opens the bus. Returns false after printing the reason.
    bool open(const std::string& address);
    /// Sends and receives what is pending, and waits at most `wait_ns` when nothing is. Returns
    /// false after a signal.
    bool turn(std::int64_t wait_ns = 1'000'000);
    /// Turns until `done` or for `for_ns` (negative: no limit). Returns the last result of `done`.
    bool until(const std::function<bool()>& done, std::int64_t for_ns = -1);
    /// Runs one SDO transfer. Returns false when there is no value; fail_transfer() prints the
    /// reason.
    bool transfer(std::uint8_t node, canopen::SdoRequest&);
    int fail_transfer(std::uint8_t node, const canopen::SdoRequest&,
                      const std::string& object) const;

    /// Called with every received frame, after the nodes.
    std::function<void(const can::Frame&)> on_frame;
    /// Called before each turn, to send periodic frames.
    std::function<void(std::int64_t now_ns)> on_turn;
    /// A signal does not end turn(): the owner of the flag has to act on the bus first.
    bool outlasts_stop = false;
    Bus bus;
    canopen::FrameQueue out{1024};
    canopen::Network network;
    canopen::LssMaster lss;

private:
    const Options& options_;
    std::int64_t timeout_ns_;
    std::vector<can::Frame> frames_;
};

/// Parses `5` or `0x05`. Returns false for an invalid node ID.
bool parse_node(const std::string& text, std::uint8_t& node);
/// The same, printing the problem on stderr.
bool node_of(const Options&, const std::string& text, std::uint8_t& node);

}  // namespace hal::tools
