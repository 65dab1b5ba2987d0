// SPDX-License-Identifier: MIT
#pragma once

#include "frames.hpp"
#include "lss.hpp"

namespace hal::canopen {

struct LssMasterSettings {
    Time timeout = 100 * millisecond;      ///< an answer that comes, comes by then
    Time scan_timeout = 20 * millisecond;  ///< the same while scanning, where silence is an answer
    unsigned repeats = 1;                  ///< a step of the scan that ends in a contradiction is done again, and waits twice as long
};

/// The master's side, one job at a time: start it, poll and handle until it is no longer busy, look at the result.
class LssMaster {
public:
    struct Result {
        bool answered = false;      ///< a slave said something; scan: one was found, and is in configuration now
        std::uint8_t error = 0;     ///< of configure and store: 0 good, 1 out of range or not supported, 2 no access to the memory, 255 own
        std::uint8_t specific = 0;  ///< with error 255
        std::uint32_t value = 0;    ///< of inquire
        Identity identity{};        ///< of scan
        bool good() const noexcept { return answered && error == 0; }
    };
    explicit LssMaster(FrameQueue& out, const LssMasterSettings& settings = {}) : out_(out), settings_(settings) {}

    LssMasterSettings& settings() noexcept { return settings_; }
    bool busy() const noexcept { return job_ != Job::none; }
    const Result& result() const noexcept { return result_; }
    bool listens_to(const Frame& f) const noexcept { return f.id == lss_slave_to_master && !f.extended && !f.remote; }
    void handle(const Frame&, Time now) noexcept;
    void poll(Time now) noexcept;

    // Each is false, and nothing done, while busy or without room. [realtime]
    bool switch_global(bool configuration) noexcept;  // no answer: done at once
    bool select(const Identity&, Time now) noexcept;
    bool configure_node_id(std::uint8_t, Time now) noexcept;
    bool configure_bit_timing(std::uint8_t index, Time now) noexcept;
    bool activate_bit_timing(std::uint16_t delay_ms) noexcept;  // no answer: done at once
    bool store_configuration(Time now) noexcept;
    /// `part` 0–3: that part of the identity; 4: the node id.
    bool inquire(unsigned part, Time now) noexcept;
    /// Is there a slave with revision and serial number within these bounds?
    bool identify(const Identity& low, const Identity& high, Time now) noexcept;
    bool identify_unconfigured(Time now) noexcept;
    /// Finds one slave without node id. The bits of `known` from 31 down to its count of bits are taken as given.
    bool scan(Time now, const Identity& known = {}, const std::array<std::uint8_t, 4>& known_bits = {}) noexcept;
    void cancel() noexcept { job_ = Job::none; }

private:
    enum class Job : std::uint8_t { none, expect, scan_reset, scan_bit, scan_confirm };
    bool send(std::uint8_t command, std::uint32_t value = 0) noexcept;
    bool expect(std::uint8_t command, std::uint32_t value, Time now) noexcept;
    void send_scan(std::uint8_t bit, std::uint8_t next) noexcept;
    void scan_part() noexcept;
    void scan_answer(bool yes) noexcept;
    Time scan_wait() const noexcept;

    FrameQueue& out_;
    LssMasterSettings settings_;
    Job job_ = Job::none;
    std::uint8_t expected_ = 0;
    Result result_;
    Identity known_{};
    std::array<std::uint8_t, 4> known_bits_{};
    std::uint8_t part_ = 0, bit_ = 0;
    unsigned repeats_left_ = 0;
    bool unsent_ = false, heard_ = false;
    Frame frame_;
    Time asked_ = 0, now_ = 0;
};

}  // namespace hal::canopen
