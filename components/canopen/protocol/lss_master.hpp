// SPDX-License-Identifier: MIT
// The LSS master (CiA 305): finds unconfigured slaves and sets node IDs and bit rates. One job at a
// time:
//
//     LssMaster lss(queue);
//     lss.scan(now);                              // finds one slave without node ID and selects it
//     while (lss.busy()) ... lss.handle(frame, now), lss.poll(now);
//     if (lss.result().answered) lss.configure_node_id(5, now);
#pragma once

#include "frames.hpp"
#include "hal/task.hpp"
#include "lss.hpp"

namespace hal::canopen {

/// Timeouts of the LSS master.
struct LssMasterSettings {
    Time timeout = 100 * millisecond;  ///< response timeout
    /// response timeout during a scan, where no response is a result
    Time scan_timeout = 20 * millisecond;
    /// repetitions of a contradictory scan step, each with twice the timeout
    unsigned repeats = 1;
};

/// An LSS master: start a job, call handle() and poll() until it is no longer busy, then read the
/// result. All calls belong to one thread.
class LssMaster {
public:
    /// The result of a job.
    struct Result {
        /// a slave responded; scan: one was found and is in LSS configuration state
        bool answered = false;
        /// configure, store: 0 success, 1 out of range or not supported, 2 storage access failed,
        /// 255 specific
        std::uint8_t error = 0;
        std::uint8_t specific = 0;  ///< manufacturer-specific error code, if `error` is 255
        std::uint32_t value = 0;  ///< inquire: the value
        Identity identity{};  ///< scan: the identity found
        /// Returns true if a slave responded without error. [any]
        bool good() const noexcept { return answered && error == 0; }
    };
    /// Creates a master that sends through `out`, which outlives it. [setup]
    explicit LssMaster(FrameQueue& out, const LssMasterSettings& settings = {})
        : out_(out), settings_(settings) {}

    /// Returns the settings; changes apply from the next job on. [realtime]
    LssMasterSettings& settings() noexcept { return settings_; }
    /// Returns true while a job is in progress. [realtime]
    bool busy() const noexcept { return expecting_ || channel_.busy(); }
    /// Returns the result of the last job. [realtime]
    const Result& result() const noexcept { return result_; }
    /// Returns true for frames that handle() must get. [any]
    bool listens_to(const Frame& f) const noexcept {
        return f.id == lss_slave_to_master && !f.extended && !f.remote;
    }
    /// Processes a response. [realtime]
    void handle(const Frame&, Time now) noexcept;
    /// Continues a scan and checks timeouts; call it once per cycle. [realtime]
    void poll(Time now) noexcept;

    // Each of these starts a job. They return false if a job is in progress or the queue is full.
    // [realtime]

    /// Switches all slaves to LSS configuration or waiting state. No response; ends at once.
    bool switch_global(bool configuration) noexcept;
    /// Switches the slave with this identity to LSS configuration state.
    bool select(const Identity&, Time now) noexcept;
    /// Sets the node ID 1..127 (255: unconfigured) of the selected slave.
    bool configure_node_id(std::uint8_t, Time now) noexcept;
    /// Sets the bit rate by its index in table 0 of CiA 305; see lss_bit_rate_index().
    bool configure_bit_timing(std::uint8_t index, Time now) noexcept;
    /// Activates the new bit rate in all slaves after a pause of twice `delay_ms`. No response;
    /// ends at once.
    bool activate_bit_timing(std::uint16_t delay_ms) noexcept;
    /// Stores node ID and bit rate in the selected slave.
    bool store_configuration(Time now) noexcept;
    /// Reads a part of the identity (0..3: vendor, product, revision, serial number) or the node ID
    /// (4).
    bool inquire(unsigned part, Time now) noexcept;
    /// Asks for slaves whose revision and serial number lie within these bounds.
    bool identify(const Identity& low, const Identity& high, Time now) noexcept;
    /// Asks for slaves without node ID.
    bool identify_unconfigured(Time now) noexcept;
    /// Finds one slave without node ID by fastscan. The `known_bits` most significant bits of each
    /// part of `known` are taken as given.
    bool scan(Time now, const Identity& known = {},
              const std::array<std::uint8_t, 4>& known_bits = {}) noexcept;
    /// Ends the job without a result.
    void cancel() noexcept {
        expecting_ = false;
        channel_.stop();
    }

    /// Bytes for the tasks of a scan.
    static constexpr std::size_t task_bytes = 1024;
    /// Returns the largest use of them so far, in bytes. [realtime]
    std::size_t max_task_memory() const noexcept { return channel_.task_memory().max_used(); }

private:
    /// The tasks of a scan; each waits for the answers to one question.
    struct Channel : TaskChannel {
        Channel() : TaskChannel(task_bytes) {}
        using TaskChannel::resume;
        using TaskChannel::suspend;
    };
    struct Question {
        LssMaster& master;
        bool await_ready() const noexcept { return false; }
        void await_suspend(std::coroutine_handle<> task) const noexcept {
            master.channel_.suspend(task);
        }
        bool await_resume() const noexcept { return master.heard_; }
    };
    bool send(std::uint8_t command, std::uint32_t value = 0) noexcept;
    bool expect(std::uint8_t command, std::uint32_t value, Time now) noexcept;
    Task<> fastscan(Channel&) noexcept;
    Task<bool> scan_part(Channel&, std::uint8_t part, unsigned repeat) noexcept;
    Question ask(std::uint8_t bit_checked, std::uint8_t part, std::uint8_t next,
                 unsigned repeat) noexcept;
    void poll_scan(Time now) noexcept;

    FrameQueue& out_;
    LssMasterSettings settings_;
    bool expecting_ = false;  // the answer `expected_` to a single request
    std::uint8_t expected_ = 0;
    Result result_;
    Identity known_{};
    std::array<std::uint8_t, 4> known_bits_{};
    Channel channel_;
    // of the question of a scan
    Frame frame_;
    bool unsent_ = false;
    bool heard_ = false;
    Time wait_ = 0;
    Time asked_ = 0;
    Time now_ = 0;
};

}  // namespace hal::canopen
