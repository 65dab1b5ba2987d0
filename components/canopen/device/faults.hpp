// SPDX-License-Identifier: MIT
// What a device can do wrong on the wire, on purpose, so that a master can be tested. A Node puts it between its device and the link.
// Everything repeats: the same frames at the same times meet the same faults.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>

#include "canopen/protocol/frames.hpp"
#include "canopen/protocol/numbers.hpp"

namespace hal::canopen {

enum class Fault : std::uint8_t {
    mute, deaf, twice, late_sdo, late_pdo, no_boot_up, boot_storm, reboot, no_heartbeat, wrong_state, guard_toggle, no_sdo, abort,
    stale_abort, toggle, block_gap, block_crc, short_pdo, long_pdo, wrong_type, wrong_vendor, wrong_product, wrong_revision, wrong_serial,
    wrong_software, babble, emcy_storm, no_srdo, srdo_half, srdo_wrong, srdo_order, late_srdo,
};

/// The one list of them.
struct FaultRow {
    Fault fault;
    const char* name;  ///< as it is typed
    const char* what;  ///< "every n-th …" of these is hit
    Time time;         ///< what `time` is when nobody says; 0: it has none
};
std::span<const FaultRow> fault_rows() noexcept;
/// nullptr when there is none of that name. [any]
const FaultRow* find_fault(std::string_view name) noexcept;

struct FaultSetting {
    std::uint32_t every = 0;  ///< 0: off; 1: each; n: every n-th of those it is about
    Time time = 0;            ///< how late, how often; 0: the row's
    Time from = 0, until = INT64_MAX;  ///< counted from the first turn
};

/// Reads `late-sdo`, `late-sdo:time=20ms`, `mute:from=5s:for=1s`, `twice:every=3`. False, and `problem`: what to type. [setup]
bool parse_fault(std::string_view text, Fault& fault, FaultSetting& setting, std::string& problem);

class Faults {
public:
    explicit Faults(std::size_t held = 512);  // [setup]

    void set(Fault fault, const FaultSetting& setting) noexcept { settings_[index(fault)] = setting, find_any(); }
    const FaultSetting& setting(Fault fault) const noexcept { return settings_[index(fault)]; }
    std::uint64_t hits(Fault fault) const noexcept { return hits_[index(fault)]; }
    /// Nothing is set and nothing is held back: frames may pass by. [realtime]
    bool idle() const noexcept { return !any_ && held_count_ == 0; }

    /// A frame came; true: the device shall not see it. [realtime]
    bool swallows(const Frame&, std::uint8_t node, Time now) noexcept;
    /// A frame of the device goes out; what becomes of it is put into `bus`, which has room for 4. [realtime]
    void send(Frame, std::uint8_t node, FrameQueue& bus, Time now) noexcept;
    /// Frames held back that are due, and frames that no device sends. True: the device shall restart now. [realtime]
    bool poll(std::uint8_t node, FrameQueue& bus, Time now) noexcept;

private:
    static constexpr std::size_t kinds = static_cast<std::size_t>(Fault::late_srdo) + 1;
    static constexpr std::size_t index(Fault fault) noexcept { return static_cast<std::size_t>(fault); }
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
    bool answer(Frame&, FrameQueue& bus) noexcept;
    void identity(Frame&) noexcept;
    bool safety(Frame&, Time& late, FrameQueue& bus) noexcept;

    std::array<FaultSetting, kinds> settings_{};
    std::array<std::uint64_t, kinds> seen_{}, hits_{};
    std::array<Time, kinds> next_{};
    std::unique_ptr<Held[]> held_;  // in order of their coming, not of when they are due
    const std::size_t held_room_;
    std::size_t held_count_ = 0;
    bool any_ = false, started_ = false;
    Time began_ = 0, now_ = 0;
    // The transfer under way, as far as its frames cannot be told apart without.
    enum class Block : std::uint8_t { none, receiving, sending, ending } block_ = Block::none;
    std::uint8_t last_sequence_ = 0;
    std::array<std::uint8_t, 3> request_{}, previous_{};
    Frame first_of_srdo_{};  // waits until its second frame went
    bool skips_srdo_ = false, swaps_srdo_ = false;
};

}  // namespace hal::canopen
