// SPDX-License-Identifier: MIT
// Emulated slaves on a line. It has no thread and no clock. Not real time.
#pragma once

#include <cstdint>
#include <deque>
#include <vector>

#include "link/disturbances.hpp"
#include "link/line.hpp"
#include "modbus/device/slave.hpp"
#include "modbus/device/slave_fault.hpp"
#include "modbus/wire/frame.hpp"

namespace hal::modbus {

class SlaveBus {
public:
    /// `bus` outlives it.
    explicit SlaveBus(const Bus& bus);
    void attach(line::Line& line);
    /// How long a slave thinks before it answers.
    void set_thinking(std::int64_t ns) { thinking_ns_ = ns; }
    /// Does what is due. Returns when there will be something to do, if no byte arrives before.
    std::int64_t work(std::int64_t now_ns);
    EmulatedSlave* find(std::uint8_t unit);
    std::deque<EmulatedSlave>& slaves() { return slaves_; }
    std::vector<SlaveFault>& faults() { return faults_; }
    std::uint64_t requests() const { return requests_; }

private:
    void serve(const Found& found, std::int64_t now_ns);
    bool hits(SlaveFault& fault, std::uint8_t unit, std::int64_t now_ns) const;
    bool is_in_time(const SlaveFault& fault, std::int64_t now_ns) const;
    void disturb(std::span<std::uint8_t> bytes, std::int64_t now_ns);
    bool dialect(std::uint8_t unit);

    struct Pending {
        std::int64_t at_ns;
        Frame frame;
    };

    const Bus& bus_;
    std::deque<EmulatedSlave> slaves_;
    std::vector<SlaveFault> faults_;
    line::Line* line_ = nullptr;
    Framing framing_ = Framing::rtu;
    std::int64_t silence_ns_ = 0;
    std::int64_t thinking_ns_ = 1'000'000;
    std::int64_t begin_ns_ = 0;
    std::int64_t last_byte_ns_ = 0;
    std::uint64_t requests_ = 0;
    link::Random random_;  // of the noise
    ReceiveBuffer buffer_;
    std::vector<Pending> pending_;
};

}  // namespace hal::modbus
