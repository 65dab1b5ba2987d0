// SPDX-License-Identifier: MIT
// Sends the frames of a cycle and takes their answers: the prebuilt frames of the process image,
// then the datagrams of all channels packed into frames. An answer is matched by its index and what
// is in flight under it; everything else is counted and ignored.
//
// Once all slaves have started, the last frame with process data carries as many datagrams of
// channels as it has space for: a frame of their own would double what a cycle costs. With a backup
// port it carries none, since the halves of a ring are joined in another way there.
//
// With a backup port each frame leaves on both ports. On a closed ring the copy of the primary port
// passes every slave and arrives at the backup port, the other one arrives unprocessed; on a broken
// ring each returns where it left, having passed its half. Either way two copies arrive, one on
// each port, and their sum is the answer.
#pragma once

#include <array>
#include <atomic>
#include <cstdint>
#include <span>
#include <vector>

#include "ethercat/master/channel.hpp"
#include "ethercat/master/process_image.hpp"
#include "ethercat/master/status.hpp"
#include "link/ethernet.hpp"

namespace hal::ethercat::master {

/// See the top of this file. [realtime] unless marked, in the thread of the master's cycle.
class WireEngine {
public:
    /// Time of the reference clock as the newest frame carried it.
    struct ClockSample {
        bool fresh = false;  ///< came with the newest cycle
        std::uint64_t dc_ns = 0;  ///< when the frame passed the reference clock, its time
        std::int64_t sent_ns = 0;  ///< when the frame left, on the clock of the cycle
        /// between the start of that cycle and the sending of the frame
        std::int64_t sent_after_ns = 0;
    };

    WireEngine(ProcessImage& image, BusStatus& status, const Setup& setup)
        : image_(image), status_(status), setup_(setup) {}

    /// Sets the ports; they must outlive the engine. [setup]
    void attach(ethernet::Port& primary, ethernet::Port* backup);
    /// Adds a user; it must outlive the engine. [setup]
    void add(Channel& channel);
    /// Ends the setup: no add() after it. [setup]
    void ready();

    /// Takes the answers of the previous cycle, resumes the tasks that wait for them, and ends the
    /// sleep of others.
    void receive(std::int64_t now_ns) noexcept;
    /// Sends the process data that is due, then at most `acyclic_frames` frames of the channels.
    void transmit(std::int64_t now_ns, bool process_data, bool all_domains, unsigned acyclic_frames,
                  std::uint64_t dc_time_ns) noexcept;

    /// Sends a frame of the master at once and ignores its answer. Sends nothing while transmit()
    /// runs in another thread. [any], async-signal-safe
    void send_now(std::span<const std::uint8_t> frame) noexcept;

    const ClockSample& clock() const noexcept { return clock_; }
    bool redundant() const noexcept { return backup_ != nullptr; }
    /// Channels may use the backup port: false while positions are counted, true once slaves have
    /// station addresses.
    void use_backup(bool use) noexcept { use_backup_ = use; }
    /// Returns the start of the current cycle.
    std::int64_t now_ns() const noexcept { return now_ns_; }
    /// Returns the counter of the newest BRD 0130h copy that arrived at the primary port: 0 on a
    /// closed ring, whose slaves count in the copy that arrives at the backup port; -1: none
    /// arrived.
    int primary_wkc() const noexcept { return primary_wkc_; }
    /// Returns Channel::max_task_share() of the channel where it is largest.
    double max_task_share() const noexcept;
    /// Returns how often a task continued.
    std::uint64_t resumed() const noexcept { return resumed_; }
    bool idle() const noexcept;  ///< Returns whether no process data is in flight.

private:
    struct Item {
        Channel* channel = nullptr;
        std::uint32_t generation = 0;
        std::uint16_t offset = 0;
        std::uint16_t length = 0;
    };
    static constexpr std::size_t max_items = 64;
    static constexpr std::size_t max_acyclic = 8;
    static constexpr std::size_t indexes = 256;
    struct AcyclicFrame {
        std::array<std::uint8_t, max_frame_bytes> bytes{}, answer{};
        std::array<Item, max_items> items{};
        std::size_t count = 0;
        std::uint16_t size = 0;
        bool free = true;
    };
    struct Flight {
        /// complete: its data is taken, the second copy may still arrive
        enum class Kind : std::uint8_t {
            none,
            cyclic,
            complete,
            acyclic,
            expired
        } kind = Kind::none;
        std::uint8_t copies = 0;  ///< that left and have not arrived
        std::uint8_t arrivals = 0;  ///< bit mask of the ports at which one arrived
        bool merged = false;  ///< one copy arrived
        std::uint16_t place = 0;  ///< frame of the image, or of acyclic_
        /// with process data: the frame of acyclic_ that left in its place, with datagrams of
        /// channels behind it
        AcyclicFrame* carrier = nullptr;
        bool overdue = false;  ///< a carrier whose process data was given up
        std::int64_t sent_ns = 0;
    };
    /// What the channels may send in a cycle.
    struct Allowance {
        unsigned frames = 0;
        std::size_t bytes = 0;  ///< on the wire
        bool any = false;  ///< one datagram may be longer: none was sent yet
    };

    void receive_frames(ethernet::Port& port, unsigned number) noexcept;
    void arrived(std::span<const std::uint8_t> bytes, unsigned number) noexcept;
    bool answers(const Flight&, std::uint8_t index,
                 std::span<const std::uint8_t> bytes) const noexcept;
    static bool answers(const AcyclicFrame&, std::span<const std::uint8_t> bytes) noexcept;
    void arrived_cyclic(Flight&, std::span<const std::uint8_t> bytes) noexcept;
    void arrived_acyclic(Flight&, std::span<const std::uint8_t> bytes, unsigned number) noexcept;
    bool is_own(std::span<const std::uint8_t> bytes) const noexcept;
    void count_foreign(std::span<const std::uint8_t> bytes) noexcept;
    bool accept(Flight&, unsigned number) noexcept;
    void complete_cyclic(Flight&, const std::uint8_t* answer) noexcept;
    void complete_acyclic(Flight&) noexcept;
    void merge_acyclic(AcyclicFrame&, const std::uint8_t* second) noexcept;
    void note_reach(const AcyclicFrame&, const std::uint8_t* answer) noexcept;
    void deliver(AcyclicFrame&, const std::uint8_t* answer) noexcept;
    void lose(AcyclicFrame&) noexcept;
    void count_late() noexcept;
    void expire() noexcept;
    void expire(Flight&) noexcept;
    void give_up_process_data(Flight&) noexcept;
    void wake() noexcept;
    bool is_due(const ProcessImage::Frame&, bool all_domains) const noexcept;
    void send_process_data(bool all_domains, std::uint64_t dc_time_ns, Allowance&) noexcept;
    void send_process_data(Flight&) noexcept;
    void await_carried(Flight&) noexcept;
    void send_acyclic(Allowance) noexcept;
    bool any_waits() const noexcept;
    AcyclicFrame* free_frame() noexcept;
    AcyclicFrame* load(const ProcessImage::Frame&, std::uint8_t index, Allowance&) noexcept;
    bool pack(AcyclicFrame&, FrameWriter&, std::uint8_t index, bool& backup, Allowance) noexcept;
    bool may_use_backup(Command command) const noexcept;
    bool add_datagram(AcyclicFrame&, FrameWriter&, std::uint8_t index, Channel&) noexcept;
    std::uint8_t send(std::span<const std::uint8_t> frame, bool backup) noexcept;
    int take_index() noexcept;

    ProcessImage& image_;
    BusStatus& status_;
    const Setup& setup_;
    ethernet::Port* primary_ = nullptr;
    ethernet::Port* backup_ = nullptr;
    std::vector<Channel*> channels_;
    std::vector<std::uint8_t> active_;  ///< of each channel
    std::vector<AcyclicFrame> acyclic_;
    /// first copies of the cyclic frames, with a backup port only
    std::vector<std::array<std::uint8_t, max_frame_bytes>> halves_;
    std::array<Flight, indexes> flights_{};
    ClockSample clock_;
    std::int64_t now_ns_ = 0;
    std::int64_t cycle_start_ns_ = 0;
    std::int64_t sent_after_ns_ = 0;
    std::uint64_t cycle_ = 0;
    std::uint64_t resumed_ = 0;
    std::size_t next_channel_ = 0;
    unsigned in_flight_ = 0;
    // copies of expired frames that have not returned
    std::uint64_t missing_ = 0;
    std::atomic_flag sending_;  // held by the thread that sends
    // copies of frames of send_now() that have not returned
    std::atomic<std::uint32_t> unmatched_{0};
    int primary_wkc_ = -1;
    // that fit a cycle, with a reserve
    std::size_t wire_bytes_ = SIZE_MAX;
    std::uint8_t next_index_ = 0;
    bool use_backup_ = false;
};

}  // namespace hal::ethercat::master
