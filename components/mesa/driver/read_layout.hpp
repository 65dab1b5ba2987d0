// SPDX-License-Identifier: MIT
// What a cycle reads from the card.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "mesa/driver/setup_link.hpp"

namespace hal::mesa {

/// The reads of a cycle, in their order, and where their data is in the answer.
class ReadLayout {
public:
    /// Adds registers of HostMot2, 32 bits each. Returns the offset of their data in the answer.
    /// Throws CardError when an answer cannot have so much. [setup]
    std::size_t add(std::uint16_t address, std::size_t count = 1) {
        return add(Space::hostmot2, address, Unit::u32, count);
    }
    /// [setup]
    std::size_t add(Space space, std::uint16_t address, Unit unit, std::size_t count) {
        const auto offset = whole_.read(space, address, unit, count);
        if (!offset) {
            throw CardError(
                "the modules in use need more than the 1400 bytes of a datagram in each cycle; "
                "use fewer of them in config=");
        }
        return *offset;
    }
    /// Adds a register whose address may change while the card is in use; `address` outlives the
    /// layout. [setup]
    std::size_t add_at(const std::uint16_t& address) {
        const std::size_t offset = add(address);
        followers_.push_back({whole_.size() - sizeof address, &address});
        return offset;
    }
    /// Adds register `reg` of the instances 0..count-1 of a module. Returns the offset of the first;
    /// they follow one another. [setup]
    template <class Addresses>
    std::size_t add_instances(const Addresses& addresses, unsigned reg, std::size_t count) {
        if (addresses.instance_stride == 4) return add(addresses.at(reg), count);
        const std::size_t first = add(addresses.at(reg));
        for (unsigned n = 1; n < count; ++n) {
            add(addresses.at(reg, n));
        }
        return first;
    }

    /// Returns the reads of a cycle. [any]
    const Request& request() const noexcept { return whole_; }
    /// Stores the addresses that have changed in `request`, which begins with request(). [realtime]
    void follow_addresses(Request& request) const noexcept {
        for (const Follower& follower : followers_) {
            request.set(follower.offset, *follower.address);
        }
    }

private:
    struct Follower {
        std::size_t offset;  ///< of the address in the request
        const std::uint16_t* address;
    };
    std::vector<Follower> followers_;
    Request whole_;
};

/// The answer of a cycle. Valid until the next one.
class Reply {
public:
    explicit Reply(std::span<const std::uint8_t> bytes) noexcept : bytes_(bytes) {}

    /// Returns a number at an offset of the layout. [realtime]
    template <class T = std::uint32_t>
    T at(std::size_t offset) const noexcept {
        return offset + sizeof(T) <= bytes_.size() ? load<T>(bytes_.data() + offset) : T{};
    }
    /// Returns the register of instance `n` of a module. [realtime]
    std::uint32_t word(std::size_t offset, std::size_t n) const noexcept {
        return at(offset + n * 4);
    }

private:
    std::span<const std::uint8_t> bytes_;
};

}  // namespace hal::mesa
