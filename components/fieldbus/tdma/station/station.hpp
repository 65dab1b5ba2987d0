// SPDX-License-Identifier: MIT
// One station on a segment with TDMA discipline (RTnet, Documentation/TDMA): master, backup master
// or slave. It has no thread: receive() at the beginning of the caller's cycle processes the
// received frames and synchronises the clock, transmit() at its end passes every frame that is due
// before the same moment of the next cycle to the port. The caller's thread has the period of the
// TDMA cycle and is synchronised by error().
//
//     hal::tdma::Station station(setup, &events);   // [setup]
//     station.attach(port);                          // [setup] opened for the Ethertypes Station::types
//     each cycle: station.receive(now); … station.send(frame, slot, priority); … station.transmit(now);
//                 next deadline = now + cycle + a controller's correction for station.error()
//
// `now` is the deadline of the cycle on the port's clock, ns.
#pragma once

#include <pthread.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <deque>
#include <vector>

#include "babble_monitor.hpp"
#include "calibration.hpp"
#include "clock_estimate.hpp"
#include "discipline/discipline.hpp"
#include "followers.hpp"
#include "pings.hpp"
#include "roster.hpp"
#include "slots.hpp"

namespace hal::tdma {

/// Another protocol on the segment: RTcfg, the tunnel.
class Companion {
public:
    virtual ~Companion() = default;
    /// Receives a frame of Ethertype 0x9022, or a tunnelled one, which is valid during the call.
    /// [realtime]
    virtual void arrived(std::span<const std::uint8_t> frame, Time now) noexcept = 0;
    /// Is called before the slots are filled: it may send(). [realtime]
    virtual void before_slots(Time now) noexcept = 0;
    /// Notes a frame of any kind. [realtime]
    virtual void heard(const Address&, Time /*now*/) noexcept {}
};

class Station final : public ethernet::Discipline {
public:
    /// 0x9023 to detect frames in own slots
    static constexpr std::array<std::uint16_t, 3> types{rtmac_type, rtcfg_type, cane_type};

    /// Throws std::invalid_argument for an invalid setup. `events` must outlive it. [setup]
    explicit Station(const StationSetup& setup, Events* events = nullptr);

    /// Starts on a port, which must outlive the station or detach(). [setup]
    void attach(ethernet::Port& port);
    void detach() noexcept { port_ = nullptr; }  ///< [setup]
    /// Sets the receivers of RTcfg and tunnelled frames; nullptr: none. [setup]
    void accompany(Companion* rtcfg, Companion* tunnel) noexcept {
        rtcfg_ = rtcfg;
        tunnel_ = tunnel;
    }
    /// Changes the schedule and restarts, after RTcfg. Returns false when it has more slots than
    /// StationSetup::slot_capacity. [realtime]
    bool reconfigure(const StationSetup&) noexcept;

    void receive(Time now) noexcept;  ///< processes received frames. [realtime]
    void transmit(Time now) noexcept;  ///< sends; with the same `now`, after receive(). [realtime]
    void reset() noexcept;  ///< restarts a master that stepped down. [realtime]
    /// Starts anew after a time without cycles: the station listens first, as another one may send
    /// the syncs now, and its clock estimate is old. Drops queued frames. [realtime]
    void restart() noexcept;

    const Status& status() const noexcept { return status_; }
    const StationSetup& setup() const noexcept { return setup_; }
    /// Returns how much later (negative: earlier) this cycle should have begun, ns; 0 while
    /// unknown. [realtime]
    Time error() const noexcept { return status_.error; }
    Time global(Time local) const noexcept { return clock_.global(local); }  ///< ns. [realtime]
    Time local(Time global) const noexcept { return clock_.local(global); }  ///< [realtime]
    /// Returns the beginning (scheduled sync) of a cycle near this one, on the port's clock, ns.
    /// [realtime]
    Time cycle_start(std::uint32_t cycle) const noexcept { return clock_.local(start_of(cycle)); }
    std::size_t waiting(unsigned slot) const noexcept;  ///< frames queued for it. [realtime]

    /// Returns the state of the other stations, in the order of the setup. [realtime]
    const Roster& roster() const noexcept { return roster_; }

    /// Sends a ping to the other station with this index in the setup (after the last: the master,
    /// with asks_master), in the next slot with space; pings() has the result. [realtime]
    void ping(std::size_t other, std::uint32_t number) noexcept { pings_.ask(other, number); }
    const Pings& pings() const noexcept { return pings_; }  ///< [realtime]

    // hal::ethernet::Discipline
    ethernet::Sent send(std::span<const std::uint8_t> frame, unsigned slot, unsigned priority,
                        ethernet::Finisher* finisher = nullptr) noexcept override;
    Origin origin(const Address& from, std::int64_t arrived_ns,
                  std::size_t length) const noexcept override;
    std::size_t room(unsigned slot) const noexcept override;
    bool ready() const noexcept override { return ready_.load(std::memory_order_relaxed); }
    const Address& address() const noexcept override { return address_; }

private:
    static constexpr std::size_t most_pending = 64;  // as RTnet's master
    static constexpr std::uint32_t rows = 3;  // consecutive observations that confirm something
    static constexpr std::uint32_t silence_after = 1000;  // cycles until the same event is repeated
    // ns; after more a master listens before it sends
    static constexpr Time max_absence = 100'000'000;
    // ns without frames: a second master, or a station that sends, is lost
    static constexpr Time gone_after = 1'000'000'000;
    struct Pending {
        Address to{};
        Time stamp = 0;
        Time received = 0;
        Time offset = 0;
        std::uint32_t cycle = 0;
        bool used = false;
    };

    /// A sender of syncs of another schedule, and that schedule.
    struct Claimant {
        Address who{};
        std::uint32_t cycle = 0;
        std::uint32_t row = 0;  // row: consecutive consistent syncs
        Time scheduled = 0;
        Time every = 0;
    };

    void begin() noexcept;
    const Slot* find(unsigned id) const noexcept;
    void become(State, Time now) noexcept;
    void report(Event event, const Address& who = {}, Time value = 0) noexcept {
        if (events_ != nullptr) {
            events_->on_event(event, who, value);
        }
    }

    // station_receive.cpp, station_others.cpp
    void take(const ethernet::Arrival&, Time now) noexcept;
    void take_sync(const Decoded&, Time arrived, Time now) noexcept;
    void take_foreign_sync(const Decoded&, Time now) noexcept;
    bool is_allowed(const Address& master) noexcept;
    void check_carrier(Time now) noexcept;
    std::size_t other_of(const Address& from, Time arrived, std::size_t length) const noexcept;
    void note(const Decoded&, Time arrived, std::size_t length, Time now) noexcept;
    bool is_in_slot(const Other&, Time at, std::uint32_t cycle) const noexcept;
    void listen_to(const Decoded&, Time arrived, Time now) noexcept;
    const Claimant& claim(const Decoded&) noexcept;
    void withdraw(Event why, const Address& who) noexcept;
    void take_request(const Decoded&, Time arrived) noexcept;
    void take_reply(const Decoded&, Time arrived, Time now) noexcept;
    void take_echo(const Decoded&, Time arrived) noexcept;
    void check_slot(std::span<const std::uint8_t> frame, const Address& from,
                    Time arrived) noexcept;
    void check_duplicate(const Address& from, Time arrived, std::size_t length) noexcept;
    void advance(Time now) noexcept;
    void count_silence(Time now) noexcept;
    void start_leading(Time now) noexcept;
    bool may_lead() const noexcept;

    // station_transmit.cpp
    void send_sync(std::uint32_t cycle, Time global_at) noexcept;
    void send_replies() noexcept;
    void send_slot(std::size_t index, std::uint32_t cycle) noexcept;
    void send_pings(const Slot&, Time local_at, std::size_t used) noexcept;
    bool send_request(const Slot&, std::uint32_t cycle, Time local_at) noexcept;
    bool launch(std::span<const std::uint8_t> frame, const ethernet::Launch&) noexcept;

    /// Returns true for the lateness of a master's sync, false for a backup's.
    bool is_from_master(Time lateness) const noexcept {
        const Time limit = setup_.backup_from != 0 ? setup_.backup_from / 2 : setup_.guard;
        return lateness <= limit && lateness >= -limit;
    }
    /// Returns how far ahead transmit() sends: slightly more than a cycle, because the next sync is
    /// one cycle ahead and the thread is never exactly in phase; not more, because a port without a
    /// pacer sends a slot right after the thread when it is due, not a cycle before.
    Time reach() const noexcept {
        return setup_.lead + setup_.cycle + std::min<Time>(setup_.cycle / 32, 31'250);
    }
    Time start_of(std::uint32_t cycle) const noexcept {  // global; cycle numbers wrap
        return start_ +
               static_cast<Time>(static_cast<std::int32_t>(cycle - number_)) * setup_.cycle;
    }
    /// Returns the offset in its cycle at which a received frame left its sender, if that is as far
    /// away as the master; sets `cycle`.
    Time left_at(Time arrived, std::size_t length, std::uint32_t& cycle) const noexcept {
        const Time longer = 2 * (wire(length) - wire(0));  // stored and forwarded once
        const Time into = clock_.global(arrived) - status_.delay - longer - start_;
        const Time cycles =
            into >= 0 ? into / setup_.cycle : -((-into + setup_.cycle - 1) / setup_.cycle);
        cycle = number_ + static_cast<std::uint32_t>(cycles);
        return into - cycles * setup_.cycle;
    }
    Time wire(std::size_t length) const noexcept { return wire_time(ethernet::wire_bytes(length)); }
    Time wire_time(std::size_t wire_bytes) const noexcept {
        return static_cast<Time>(wire_bytes) * 8000 /
               static_cast<Time>(setup_.speed == 0 ? 100 : setup_.speed);
    }

    StationSetup setup_;
    // in the order of the setup: calibration uses the first
    std::deque<Slot> slots_;
    Events* events_;
    ethernet::Port* port_ = nullptr;
    Companion *rtcfg_ = nullptr, *tunnel_ = nullptr;
    Address address_{};
    ClockEstimate clock_;
    Calibration calibration_;
    BabbleMonitor babble_monitor_;
    Followers followers_;
    Roster roster_;
    Pings pings_;
    Status status_;
    std::atomic<bool> ready_{false};
    /// that send() rejected, in any thread; transmit() counts them
    std::atomic<std::uint64_t> rejected_{0};
    std::atomic<pthread_t> thread_{};  ///< that of receive()
    std::array<Pending, most_pending> pending_{};

    bool based_ = false;  // number_ and start_ are known
    std::uint32_t number_ = 0;  // of a cycle …
    Time start_ = 0;  // … and its scheduled sync, global
    bool heard_ = false;  // a sync of this schedule in the last receive()
    std::uint32_t heard_cycle_ = 0;  // cycle number of the last one
    bool heard_ever_ = false;
    Time last_sync_ = 0;  // local
    Time began_ = 0;  // local; 0: before the first cycle
    Time last_cycle_ = 0;  // local, of the last receive()
    Time sent_until_ = 0;  // global; slots up to here are done
    bool sent_any_ = false;
    std::uint32_t lead_wait_ = 0;  // cycles before a returning master leads again
    // this master was the first: its clock is the global time
    bool own_schedule_ = false;
    std::uint32_t good_row_ = 0;  // consecutive syncs of one schedule
    // syncs of another schedule since the last of this one
    std::uint32_t foreign_row_ = 0;
    std::uint32_t intruder_row_ = 0;
    Address duplicate_{};  // the last sender in the slots of another station
    std::uint32_t duplicate_row_ = 0;
    std::uint32_t duplicate_gap_ = 0;
    // cycles until the event is repeated
    std::uint32_t foreign_gap_ = 0;
    std::uint32_t intruder_gap_ = 0;
    std::uint32_t babble_gap_ = 0;
    // requests in every n-th cycle only, besides frames; 0: in every cycle
    std::uint32_t recalibration_ = 0;
    Address measured_{};  // the calibrated master …
    std::uint32_t measured_heard_ = 0;  // … and the cycle of its last sync
    bool uncalibrated_reported_ = false;
    std::array<Claimant, 4> claimants_{};
    std::size_t next_claimant_ = 0;
    Address newcomer_{};
    std::uint32_t newcomer_row_ = 0;  // its syncs while another station is the master
    Time unfit_sync_ = 0;  // last one while listening, local; 0: none
    Address other_{};  // the reported second master
    Time other_heard_ = 0;  // its last sync, local; 0: none, or lost
    bool other_reported_ = false;
    // there were followers when the second master was first heard
    bool established_ = false;
    Time no_carrier_ = 0;  // since when, local; 0: carrier present
    std::uint32_t unknown_gap_ = 0;
    Address master_{};  // sender of the last sync of a master
    std::uint32_t master_row_ = 0;  // its consecutive syncs
    std::uint32_t out_of_step_ = 0;  // cycles in state synchronising
    bool schedule_reported_ = false;
    bool unheard_reported_ = false;  // since attach()
    std::uint32_t limit_ = 32;  // frames of one station in a cycle
};

}  // namespace hal::tdma
