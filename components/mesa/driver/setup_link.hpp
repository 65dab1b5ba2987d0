// SPDX-License-Identifier: MIT
// Requests to a card outside of the cycle. All functions are [setup].
#pragma once

#include <cstdint>
#include <span>
#include <stdexcept>
#include <string>

#include "link/datagram.hpp"
#include "mesa/lbp16/packet.hpp"

namespace hal::mesa {

/// Why a card cannot be used, as one sentence without a final full stop.
class CardError : public std::runtime_error {
public:
    using std::runtime_error::runtime_error;
};

/// Sends requests and waits for their answers, three times 20 ms each. Requests are repeated, so
/// they must have the same effect when they are executed twice.
class SetupLink {
public:
    static constexpr int tries = 3;
    static constexpr std::int64_t timeout_ns = 20'000'000;

    /// The port outlives it.
    explicit SetupLink(datagram::Port& port) noexcept : port_(port) {}

    /// Sends the request and returns its answer, valid until the next call. A request that reads
    /// nothing is completed by a read, so that its arrival is known. Throws CardError without an
    /// answer.
    std::span<const std::uint8_t> exchange(Request request);

    std::uint32_t read32(std::uint16_t address);
    void write32(std::uint16_t address, std::uint32_t value);
    /// Reads units of 16 bits of a space as bytes.
    std::span<const std::uint8_t> read16(Space space, std::uint16_t address, std::size_t count);

    const std::string& address() const noexcept { return port_.description().address; }
    bool in_memory() const noexcept { return port_.description().in_memory; }
    /// Returns how many datagrams were sent.
    std::uint32_t sent() const noexcept { return sent_; }

private:
    bool receive(std::size_t size);

    datagram::Port& port_;
    std::uint32_t sent_ = 0;
    unsigned sequence_ = 0;
    std::array<std::uint8_t, datagram::max_size> buffer_{};
};

}  // namespace hal::mesa
