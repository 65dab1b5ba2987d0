// SPDX-License-Identifier: MIT
// EMCY: errors of this node told to all (1001h, 1003h, 1014h, 1015h), and those of others heard (1028h).
#pragma once

#include <array>
#include <cstdint>

#include "dictionary.hpp"
#include "events.hpp"
#include "frames.hpp"

namespace hal::canopen {

/// Bits of the error register 1001h.
enum ErrorRegister : std::uint8_t {
    error_generic = 0x01, error_current = 0x02, error_voltage = 0x04, error_temperature = 0x08, error_communication = 0x10,
    error_profile = 0x20, error_manufacturer = 0x80,
};
/// The error code in words: its class, or "error reset or no error". [any]
const char* emergency_text(std::uint16_t code) noexcept;

class Emcy final : public Handler {
public:
    using Bytes = std::array<std::uint8_t, 5>;

    Emcy(Dictionary&, FrameQueue& out);  // [setup]
    /// Communication was reset: reads 1014h and 1015h. `all`: no error is left. [realtime]
    void reset(bool all) noexcept;
    /// Pre-operational and operational nodes may send.
    void set_active(bool active) noexcept { active_ = active; }
    /// An error is there; as long as it is, saying so again does nothing. `source`: which of several parts that can have it, such as
    /// the axes of a drive. While 8140h is there nobody would hear: that and what follows is sent when it is cleared. [realtime]
    void raise(std::uint16_t code, std::uint8_t register_bits, const Bytes& manufacturer = {}, std::uint8_t source = 0) noexcept;
    /// It is gone. [realtime]
    void clear(std::uint16_t code, std::uint8_t source = 0) noexcept;
    bool active(std::uint16_t code, std::uint8_t source = 0) const noexcept;
    std::uint8_t error_register() const noexcept { return dictionary_.get<std::uint8_t>(0x1001, 0); }
    void poll(Time now) noexcept;
    std::uint64_t lost() const noexcept { return lost_; }  ///< found no room while the inhibit time ran

    Abort writing(Entry&, std::span<const std::uint8_t>) noexcept override;
    void written(Entry&) noexcept override;

private:
    struct Active {
        std::uint16_t code = 0;
        std::uint8_t bits = 0, source = 0;
    };
    void queue(std::uint16_t code, const Bytes&) noexcept;
    void update_register() noexcept;
    void read_parameters() noexcept;

    Dictionary& dictionary_;
    FrameQueue& out_;
    std::span<Entry> history_;
    std::array<Active, 64> errors_{};
    std::size_t errors_count_ = 0;
    std::array<Emergency, 16> waiting_{};
    std::size_t head_ = 0, count_ = 0;
    std::uint32_t cob_ = cob_invalid;
    Time inhibit_ = 0, sent_ = 0;
    bool sent_once_ = false, active_ = false;
    std::uint64_t lost_ = 0;
};

/// Hears the emergencies of the nodes in 1028h.
class EmcyConsumer final : public Handler {
public:
    explicit EmcyConsumer(Dictionary&);  // [setup]
    void reset() noexcept;
    bool handle(const Frame&, Time now, Events&) noexcept;
    void written(Entry&) noexcept override { reset(); }
    /// The emergency in a frame. [any]
    static Emergency read(const Frame&, Time now) noexcept;

private:
    Dictionary& dictionary_;
    std::array<std::uint32_t, 128> cobs_{};
    std::size_t highest_ = 0;
};

}  // namespace hal::canopen
