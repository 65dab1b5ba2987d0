// SPDX-License-Identifier: MIT
// Faults of a device on the bus, injected to test a master. A Node puts them between its device and
// the link. They are deterministic: the same frames at the same times meet the same faults.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>

#include "canopen/protocol/frames.hpp"
#include "canopen/protocol/numbers.hpp"

namespace hal::canopen {
/// Kinds of faults, in the order of fault_rows().

enum class Fault : std::uint8_t {
    mute,
    deaf,
    twice,
    late_sdo,
    late_pdo,
    no_boot_up,
    boot_storm,
    reboot,
    no_heartbeat,
    wrong_state,
    guard_toggle,
    no_sdo,
    abort,
    stale_abort,
    toggle,
    block_gap,
    block_crc,
    short_pdo,
    long_pdo,
    wrong_type,
    wrong_vendor,
    wrong_product,
    wrong_revision,
    wrong_serial,
    wrong_software,
    babble,
    emcy_storm,
    no_srdo,
    srdo_half,
    srdo_wrong,
    srdo_order,
    late_srdo,
};

/// Describes a kind of fault.
struct FaultRow {
    Fault fault;
    const char* name;  ///< name in `--fault` and `faults=`
    const char* what;  ///< the event that is affected, to read after "every n-th"
    Time time;  ///< default of `time` in ns; 0: the fault has no time
};
/// Returns all kinds of faults. [any]
std::span<const FaultRow> fault_rows() noexcept;
/// Returns the row of a name, or nullptr when it is unknown. [any]
const FaultRow* find_fault(std::string_view name) noexcept;

/// When a fault is active and how often it hits.
struct FaultSetting {
    std::uint32_t every = 0;  ///< 0: off; 1: every event; n: every n-th event
    Time time = 0;  ///< delay or period in ns; 0: the default of the row
    Time from = 0;
    Time until = INT64_MAX;  ///< active from..until in ns after the first turn
};

/// Parses `late-sdo`, `late-sdo:time=20ms`, `mute:from=5s:for=1s`, `twice:every=3`. Returns false
/// and sets `problem` to what is wrong and what to type. [setup]
bool parse_fault(std::string_view text, Fault& fault, FaultSetting& setting, std::string& problem);

/// Applies faults to the frames of one device. `node` is its node ID, `now` the time in ns.
class Faults {
public:
    /// Allocates space for `held` delayed frames. [setup]
    explicit Faults(std::size_t held = 512);

    /// Switches a fault on or off. [realtime]
    void set(Fault fault, const FaultSetting& setting) noexcept {
        settings_[index(fault)] = setting;
        find_any();
    }
    const FaultSetting& setting(Fault fault) const noexcept { return settings_[index(fault)]; }
    /// Returns how many events a fault has hit. [realtime]
    std::uint64_t hits(Fault fault) const noexcept { return hits_[index(fault)]; }
    /// Returns true when no fault is set and no frame is delayed, so frames need not pass here.
    /// [realtime]
    bool idle() const noexcept { return !any_ && held_count_ == 0; }

    /// Counts a received frame and returns true when the device must not see it. [realtime]
    bool swallows(const Frame&, std::uint8_t node, Time now) noexcept;
    /// Puts a frame sent by the device, altered or not at all, into `bus`, which needs space for 4
    /// frames. [realtime]
    void send(Frame, std::uint8_t node, FrameQueue& bus, Time now) noexcept;
    /// Puts delayed frames that are due, and frames the device never sent, into `bus`. Returns true
    /// when the device must restart. [realtime]
    bool poll(std::uint8_t node, FrameQueue& bus, Time now) noexcept;

private:
    static constexpr std::size_t kinds = static_cast<std::size_t>(Fault::late_srdo) + 1;
    static constexpr std::size_t index(Fault fault) noexcept {
        return static_cast<std::size_t>(fault);
    }
    struct Held {
        Frame frame;
        Time due = 0;
    };
    bool active(Fault) const noexcept;
    bool hit(Fault) noexcept;
    bool periodic(Fault) noexcept;
    Time time(Fault) const noexcept;
    void find_any() noexcept;
    void start(Time now) noexcept;
    void hold(const Frame&, Time due, FrameQueue& bus) noexcept;
    bool answer_in_block(Frame&) noexcept;
    bool answer(Frame&, FrameQueue& bus) noexcept;
    bool error_control(Frame&) noexcept;
    void process_data(Frame&) noexcept;
    void identity(Frame&) noexcept;
    bool safety(Frame&, Time& late, FrameQueue& bus) noexcept;

    std::array<FaultSetting, kinds> settings_{};
    std::array<std::uint64_t, kinds> seen_{}, hits_{};
    std::array<Time, kinds> next_{};
    std::unique_ptr<Held[]> held_;  // in order of arrival, not of due time
    const std::size_t held_capacity_;
    std::size_t held_count_ = 0;
    bool any_ = false;
    bool started_ = false;
    Time began_ = 0;
    /// Follows the SDO transfer by a frame of the client.
    void follow_transfer(const Frame& request) noexcept;

    Time now_ = 0;
    // The SDO transfer in progress, to distinguish frames that look alike.
    enum class Block : std::uint8_t { none, receiving, sending, ending } block_ = Block::none;
    std::uint8_t last_sequence_ = 0;
    std::array<std::uint8_t, 3> request_{}, previous_{};
    Frame first_of_srdo_{};  // sent after the second frame
    bool skips_srdo_ = false;
    bool swaps_srdo_ = false;
};

}  // namespace hal::canopen
