// SPDX-License-Identifier: MIT
// The mailboxes of slaves behind the mailbox gateway (ETG.8200) of a running master: ours, or
// another one. Everything here is [setup].
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "ethercat/master/bus_slave.hpp"
#include "ethercat/master/channel.hpp"

namespace hal::tools {

/// Answers the datagrams of mailbox clients as the slaves would, with messages through the gateway.
class GatewayLine {
public:
    GatewayLine() = default;
    ~GatewayLine();
    GatewayLine(const GatewayLine&) = delete;
    GatewayLine& operator=(const GatewayLine&) = delete;

    /// Returns whether an address is that of a gateway: gateway:127.0.0.1, gateway:127.0.0.1:34980.
    static bool is_gateway(const std::string& address) { return address.starts_with("gateway:"); }
    /// Connects and reads the list of slaves. Returns why not; empty: connected.
    std::string open(const std::string& address);
    bool is_open() const { return fd_ >= 0; }
    /// Returns whether the other side ended the connection.
    bool is_closed() const { return closed_; }

    std::size_t size() const { return slaves_.size(); }
    ethercat::master::BusSlave& slave(std::size_t position) { return slaves_[position]; }
    /// Takes what the gateway sent; waits up to a millisecond for it.
    void receive();
    /// Answers the datagram of a channel, if one is under way, or ends its sleep.
    void serve(ethercat::master::Channel&, std::int64_t now_ns);

private:
    struct Reply {
        std::uint16_t station = 0;
        std::vector<std::uint8_t> message;
    };
    bool send(std::uint16_t station, std::span<std::uint8_t> message);
    std::optional<std::uint32_t> master_value(std::uint16_t index, std::uint8_t sub);
    std::vector<Reply>::iterator reply_of(std::uint16_t station);
    void read(int timeout_ms);

    int fd_ = -1;
    std::vector<ethercat::master::BusSlave> slaves_;
    std::vector<std::uint8_t> received_;
    std::vector<Reply> replies_;
    bool closed_ = false;
};

}  // namespace hal::tools
