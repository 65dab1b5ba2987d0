// SPDX-License-Identifier: MIT
// A device with SRDOs: SRDO 1 sends eight safety inputs, SRDO 2 receives eight safety outputs. It
// implements the protocol of EN 50325-5 but not its two channels: one processor forms both objects
// of each pair.
//
//     2300h:1 inputs    2301h:1 the inputs inverted     2310h:1 outputs    2311h:1 the outputs inverted
#pragma once

#include "canopen/device/program.hpp"

namespace hal::canopen {

struct SafeIoSettings {
    std::uint32_t serial = 1;
    std::uint16_t heartbeat_ms = 0;
    std::uint16_t refresh_ms = 25;  ///< refresh time of the inputs
    std::uint16_t sct_ms = 50;  ///< safeguard cycle time (SCT) of the outputs
    std::uint8_t srvt_ms = 20;  ///< safety-related validation time (SRVT) of the outputs
    /// COB-ID, odd; 0: the predefined one, off until a master enables it
    std::uint32_t inputs_cob = 0;
    std::uint32_t outputs_cob = 0;  ///< COB-ID, odd; 0: SRDO 2 is off
};

/// Returns the objects of the device. [setup]
Description safe_io_description(const SafeIoSettings&);

/// The device. Outputs are off from any fault until it is acknowledged, or until the node is
/// started again.
class SafeIo final : public Program, private SafetyEvents {
public:
    explicit SafeIo(const SafeIoSettings& settings = {}) : settings_(settings) {}  // [setup]

    // Terminals, counted from 0; a changed input is sent at once. [realtime]
    void set_input(unsigned n, bool on) noexcept;
    /// Returns the state of an output; off unless the last SRDO is valid.
    bool output(unsigned n) const noexcept { return n < 8 && (terminals_ >> n & 1) != 0; }
    /// Returns the fault that keeps the outputs off.
    SrdoFault fault() const noexcept { return fault_; }
    /// Acknowledges the fault; the outputs follow the next valid SRDO. [realtime]
    void acknowledge(Time now) noexcept;
    /// Sends the global fail-safe command. Returns false when the transmit queue is full.
    /// [realtime]
    bool send_fail_safe() noexcept { return device_->srdos().send_fail_safe(); }

    Description description() const override { return safe_io_description(settings_); }
    void attach(Device&) override;
    void step(Time now) noexcept override;
    bool set(std::string_view name, double value) override;
    std::vector<std::string> settable() const override;
    std::string summary() const override;
    void on_state(NmtState) noexcept override;

private:
    void on_srdo(unsigned number, Time) noexcept override;
    void on_srdo_fault(unsigned number, SrdoFault, Time) noexcept override;

    const SafeIoSettings settings_;
    std::uint8_t inputs_ = 0;
    std::uint8_t inverted_inputs_ = 0xff;
    std::uint8_t outputs_ = 0;
    std::uint8_t inverted_outputs_ = 0xff;

    std::uint8_t terminals_ = 0;
    SrdoFault fault_ = SrdoFault::none;
    bool wants_acknowledge_ = false;
};

}  // namespace hal::canopen
