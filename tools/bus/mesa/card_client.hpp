// SPDX-License-Identifier: MIT
// Requests to a card, one at a time.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "link/datagram.hpp"
#include "mesa/lbp16/packet.hpp"

namespace hal::tools {

class CardClient {
public:
    static constexpr int tries = 3;

    /// Opens HOST, HOST:PORT or an address with a driver, as eth:HOST. Returns the problem, or "".
    std::string open(const std::string& host, std::int64_t timeout_ns);
    /// Sends a request and waits for a reply of its length, up to `count` times. Returns nothing if
    /// there is none. A request without reads is only sent.
    std::optional<std::vector<std::uint8_t>> ask(const mesa::Request& request, int count = tries);
    /// Reads `count` units, in several requests where they do not fit one.
    std::optional<std::vector<std::uint8_t>> read(mesa::Space space, std::uint16_t address,
                                                  mesa::Unit unit, std::size_t count);
    bool send(const mesa::Request& request);
    /// Returns the next datagram that arrives before a time of the monotonic clock.
    std::optional<std::vector<std::uint8_t>> receive(std::int64_t limit_ns);
    /// Why a card does not answer, as a sentence.
    std::string silence() const;
    const std::string& host() const { return host_; }

private:
    void discard();

    std::string host_;
    std::int64_t timeout_ns_ = 0;
    std::unique_ptr<datagram::Port> port_;
};

}  // namespace hal::tools
