// SPDX-License-Identifier: MIT
// A device with SRDOs: eight safety inputs that SRDO 1 sends, eight safety outputs that SRDO 2 receives. It has the protocol of
// EN 50325-5, not its two channels: one processor forms both objects of each pair.
//
//     2300h:1 inputs    2301h:1 the same inverted       2310h:1 outputs    2311h:1 the same inverted
#pragma once

#include "canopen/device/program.hpp"

namespace hal::canopen {

struct SafeIoSettings {
    std::uint32_t serial = 1;
    std::uint16_t heartbeat_ms = 0;
    std::uint16_t refresh_ms = 25;     ///< of the inputs
    std::uint16_t sct_ms = 50;         ///< of the outputs
    std::uint8_t srvt_ms = 20;
    std::uint32_t inputs_cob = 0;      ///< odd; 0: the predefined one, not valid before a master says so
    std::uint32_t outputs_cob = 0;     ///< odd; 0: SRDO 2 is off
};

/// [setup]
Description safe_io_description(const SafeIoSettings&);

class SafeIo final : public Program, private SafetyEvents {
public:
    explicit SafeIo(const SafeIoSettings& settings = {}) : settings_(settings) {}  // [setup]

    // The terminals, counted from 0. An input that changes is sent at once. [realtime]
    void set_input(unsigned n, bool on) noexcept;
    /// False unless the last SRDO is believed.
    bool output(unsigned n) const noexcept { return n < 8 && (terminals_ >> n & 1) != 0; }
    /// The outputs are off because of this.
    SrdoFault fault() const noexcept { return fault_; }
    /// The outputs come back with the next good SRDO. [realtime]
    void acknowledge(Time now) noexcept;
    /// The global fail-safe command to all. [realtime]
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
    std::uint8_t inputs_ = 0, inverted_inputs_ = 0xff, outputs_ = 0, inverted_outputs_ = 0xff, terminals_ = 0;
    SrdoFault fault_ = SrdoFault::none;
    bool wants_acknowledge_ = false;
};

}  // namespace hal::canopen
