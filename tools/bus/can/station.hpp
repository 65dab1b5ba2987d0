// SPDX-License-Identifier: MIT
// The master's side of a bus, by hand: nodes are asked and this thread waits for the answers.
#pragma once

#include <functional>
#include <string>

#include "bus/can/bus.hpp"
#include "canopen/master/network.hpp"

namespace hal::tools {

class Station final : private canopen::Events {
public:
    /// `timeout_ns`: of one answer; 0: the usual one.
    explicit Station(const Options&, std::int64_t timeout_ns);

    /// False after saying why.
    bool open(const std::string& address);
    /// Sends and takes what there is, and waits at most `wait_ns` when there is nothing. False: somebody ended it.
    bool turn(std::int64_t wait_ns = 1'000'000);
    /// Turns until `done`, or for so long; what `done` says then. Negative: no limit.
    bool until(const std::function<bool()>& done, std::int64_t for_ns = -1);
    /// One SDO transfer to its end. False when there is no value; `fail_transfer` says why.
    bool transfer(std::uint8_t node, canopen::SdoRequest&);
    int fail_transfer(std::uint8_t node, const canopen::SdoRequest&, const std::string& object) const;

    /// Every frame of others, after the nodes have seen it.
    std::function<void(const can::Frame&)> on_frame;
    /// Before each look at the bus: for what is sent periodically.
    std::function<void(std::int64_t now_ns)> on_turn;
    /// A signal does not end turn(): whoever asks for the end here has something to do on the bus first.
    bool outlasts_stop = false;
    Bus bus;
    canopen::FrameQueue out{1024};
    canopen::Network network;
    canopen::LssMaster lss;

private:
    const Options& options_;
    std::int64_t timeout_ns_;
    std::vector<can::Frame> room_;
};

/// `5` or `0x05`; false when it is no node id.
bool parse_node(const std::string& text, std::uint8_t& node);
/// Says so on stderr when it is none.
bool node_of(const Options&, const std::string& text, std::uint8_t& node);

}  // namespace hal::tools
