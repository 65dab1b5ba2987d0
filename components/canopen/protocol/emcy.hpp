// SPDX-License-Identifier: MIT
// The emergency service (CiA 301): sends the errors of this node (1001h, 1003h, 1014h, 1015h) and
// receives those of other nodes (1028h).
#pragma once

#include <array>
#include <cstdint>

#include "cia301/error_register.hpp"
#include "dictionary.hpp"
#include "events.hpp"
#include "frames.hpp"

namespace hal::canopen {

using cia301::error_communication;
using cia301::error_current;
using cia301::error_generic;
using cia301::error_manufacturer;
using cia301::error_profile;
using cia301::error_temperature;
using cia301::error_voltage;
using cia301::ErrorRegister;

/// Returns the description of the class of the error code (CiA 301); "error reset or no error" for
/// 0. [any]
const char* emergency_text(std::uint16_t code) noexcept;

/// The EMCY producer of a node.
class Emcy final : public Handler {
public:
    using Bytes = std::array<std::uint8_t, 5>;  ///< manufacturer-specific bytes 3 to 7

    /// Creates the service; both arguments outlive it. [setup]
    Emcy(Dictionary&, FrameQueue& out);
    /// Reads 1014h and 1015h after a communication reset; `all`: also clears all errors. [realtime]
    void reset(bool all) noexcept;
    /// Enables transmission, in the NMT states pre-operational and operational. [realtime]
    void set_active(bool active) noexcept { active_ = active; }
    /// Reports an error; repeated calls have no effect until clear(). `register_bits` is set in
    /// 1001h. `source` distinguishes the parts of a node that can have the same error, such as the
    /// axes of a drive. While 8140h (bus-off) is active, transmission waits until it is cleared.
    /// [realtime]
    void raise(std::uint16_t code, std::uint8_t register_bits, const Bytes& manufacturer = {},
               std::uint8_t source = 0) noexcept;
    /// Reports that an error is over; sends "error reset" when it was active. [realtime]
    void clear(std::uint16_t code, std::uint8_t source = 0) noexcept;
    /// Returns true while the error is active. [realtime]
    bool active(std::uint16_t code, std::uint8_t source = 0) const noexcept;
    /// Returns object 1001h. [realtime]
    std::uint8_t error_register() const noexcept {
        return dictionary_.get<std::uint8_t>(0x1001, 0);
    }
    /// Sends pending emergencies after the inhibit time. [realtime]
    void poll(Time now) noexcept;
    /// Returns the number of emergencies discarded because too many were pending. [any]
    std::uint64_t lost() const noexcept { return lost_; }

    Abort writing(Entry&, std::span<const std::uint8_t>) noexcept override;
    void written(Entry&) noexcept override;

private:
    struct Active {
        std::uint16_t code = 0;
        std::uint8_t bits = 0;
        std::uint8_t source = 0;
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
    std::size_t head_ = 0;
    std::size_t count_ = 0;
    std::uint32_t cob_ = cob_invalid;
    Time inhibit_ = 0;
    Time sent_ = 0;
    bool sent_once_ = false;
    bool active_ = false;
    std::uint64_t lost_ = 0;
};

/// Receives the emergencies of the nodes in 1028h.
class EmcyConsumer final : public Handler {
public:
    /// Creates the service; the dictionary outlives it. [setup]
    explicit EmcyConsumer(Dictionary&);
    /// Reads 1028h. [realtime]
    void reset() noexcept;
    /// Processes a frame; returns true if it is an emergency of a node in 1028h. [realtime]
    bool handle(const Frame&, Time now, DeviceEvents&) noexcept;
    void written(Entry&) noexcept override { reset(); }
    /// Decodes an EMCY frame. [any]
    static Emergency read(const Frame&, Time now) noexcept;

private:
    Dictionary& dictionary_;
    std::array<std::uint32_t, 128> cobs_{};
    std::size_t highest_ = 0;
};

}  // namespace hal::canopen
