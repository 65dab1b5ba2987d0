// SPDX-License-Identifier: MIT
// Emulated slaves on a line. It has no thread and no clock. Not real time.
#pragma once

#include <cstdint>
#include <deque>
#include <string>
#include <string_view>
#include <vector>

#include "link/disturbances.hpp"
#include "link/line.hpp"
#include "modbus/device/slave.hpp"
#include "modbus/wire/frame.hpp"

namespace hal::modbus {

/// What a slave does wrong.
enum class FaultKind : std::uint8_t {
    silence,     ///< does not answer
    late,        ///< answers after `late_ns`
    corrupt,     ///< a byte of the answer is changed
    wrong_unit,  ///< answers with another address
    exception,   ///< answers with exception 4
    half,        ///< sends the first half of the answer
    noise,       ///< bytes on the line are changed, of requests and of answers
};
inline constexpr const char* fault_names[] = {"silence",   "late", "corrupt", "wrong-unit",
                                              "exception", "half", "noise"};
inline constexpr std::size_t fault_kinds = 7;

struct SlaveFault {
    FaultKind kind = FaultKind::silence;
    std::uint8_t unit = 0;    ///< 0: all
    std::uint32_t every = 1;  ///< each n-th answer
    std::int64_t from_ns = 0;
    std::int64_t until_ns = INT64_MAX;  ///< since the first work()
    std::int64_t late_ns = 200'000'000;
    double share = 0.1;  ///< of the bytes, of noise
    std::uint64_t matches = 0;  ///< answers so far
    bool is_active = true;
};
/// Parses `late:unit=2:every=50:late=120ms:from=1s:for=2s` or `noise:share=0.1`. Returns the problem, or "".
std::string parse_fault(std::string_view text, SlaveFault& fault);

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
