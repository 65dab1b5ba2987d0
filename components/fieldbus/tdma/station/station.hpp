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

#include <array>
#include <atomic>
#include <optional>

#include "babble_monitor.hpp"
#include "calibration.hpp"
#include "followers.hpp"
#include "other_masters.hpp"
#include "parallel_master.hpp"
#include "pings.hpp"
#include "slot_monitor.hpp"
#include "transmitter.hpp"

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
    void detach() noexcept { core_.port = nullptr; }  ///< [setup]
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

    const Status& status() const noexcept { return core_.status; }
    const StationSetup& setup() const noexcept { return core_.setup; }
    /// Returns how much later (negative: earlier) this cycle should have begun, ns; 0 while
    /// unknown. [realtime]
    Time error() const noexcept { return core_.status.error; }
    Time global(Time local) const noexcept {
        return core_.clock.global(local);
    }  ///< ns. [realtime]
    Time local(Time global) const noexcept { return core_.clock.local(global); }  ///< [realtime]
    /// Returns the beginning (scheduled sync) of a cycle near this one, on the port's clock, ns.
    /// [realtime]
    Time cycle_start(std::uint32_t cycle) const noexcept {
        return core_.clock.local(core_.start_of(cycle));
    }
    /// Returns the own frames since attach() that did not leave, except late ones: rejected by
    /// send(), queued when the station stopped sending, dropped by the port. [realtime]
    std::uint64_t dropped(const ethernet::Statistics& port) const noexcept;
    std::size_t waiting(unsigned slot) const noexcept;  ///< frames queued for it. [realtime]

    /// Returns the state of the other stations, in the order of the setup. [realtime]
    const Roster& roster() const noexcept { return slot_monitor_.roster(); }

    /// Sends a ping to the other station with this index in the setup (after the last: the master,
    /// with asks_master), in the next slot with space; pings() has the result. [realtime]
    void ping(std::size_t other, std::uint32_t number) noexcept { pings_.ask(other, number); }
    const Pings& pings() const noexcept { return pings_; }  ///< [realtime]

    // hal::ethernet::Discipline
    ethernet::Sent send(std::span<const std::uint8_t> frame, unsigned slot, unsigned priority,
                        ethernet::Finisher* finisher = nullptr) noexcept override;
    Origin origin(const Address& from, std::int64_t arrived_ns,
                  std::size_t length) const noexcept override {
        return slot_monitor_.origin(from, arrived_ns, length);
    }
    std::size_t capacity(unsigned slot) const noexcept override;
    void count_dropped() noexcept override { rejected_.fetch_add(1, std::memory_order_relaxed); }
    /// Returns true while the syncs of a second master are received. [realtime]
    bool hears_second_master() const noexcept { return other_masters_.present(); }
    bool ready() const noexcept override;
    const Address& address() const noexcept override { return core_.address; }

private:
    /// The last sync of this schedule.
    struct LastSync {
        bool ever = false;  // since the start
        bool received = false;  // in the last receive()
        std::uint32_t cycle = 0;
        Time at = 0;  // local
    };

    void begin() noexcept;
    void begin_at(Time now) noexcept;
    void stop_sending() noexcept;
    void open_queues() noexcept;
    void become(State) noexcept;
    void report(Event event, const Address& who = {}, Time value = 0) noexcept {
        core_.report(event, who, value);
    }

    // received frames
    void accept(const ethernet::Arrival&, Time now) noexcept;
    void accept_addressed(const Decoded&, Time arrived) noexcept;
    void accept_rtcfg(std::span<const std::uint8_t> frame, Time now) noexcept;
    void accept_request(const Decoded&, Time arrived) noexcept;
    void accept_reply(const Decoded&, Time arrived) noexcept;
    void accept_echo(const Decoded&, Time arrived) noexcept;
    void check_carrier(Time now) noexcept;
    void check_babble() noexcept;

    // syncs
    void accept_sync(const Decoded&, Time arrived, Time now) noexcept;
    bool is_plausible(const Sync&) const noexcept;
    bool is_outdated(const Sync&) const noexcept;
    bool finds_master(const Decoded&) noexcept;
    bool is_beside_master(const Decoded&, Time now) noexcept;
    void listen_to(const Decoded&, Time arrived, Time now) noexcept;
    void accept_foreign_sync(const Decoded&, Time arrived, Time now) noexcept;
    bool gives_way(bool to_master, Time now) const noexcept;
    bool is_new_sender(const Address&) noexcept;
    void count_lost(const Sync&) noexcept;
    void note_sync(const Sync&, Time arrived) noexcept;
    bool yields_to(const Decoded&, Time arrived, Time now) noexcept;
    void change_master(const Decoded&) noexcept;
    void follow(const Decoded&, Time arrived) noexcept;
    void withdraw(Event why, const Address& who) noexcept;

    // once a cycle
    void advance(Time now) noexcept;
    void update_state(Time now) noexcept;
    void listen(Time now) noexcept;
    bool may_lead_after_listening(Time now) const noexcept;
    void synchronise() noexcept;
    void watch_calibration() noexcept;
    void run(Time now) noexcept;
    void count_silence() noexcept;
    void check_loss(Time now) noexcept;
    void start_leading(Time now) noexcept;
    bool may_lead() const noexcept;

    StationCore core_;
    Companion *rtcfg_ = nullptr, *tunnel_ = nullptr;
    Calibration calibration_;
    BabbleMonitor babble_monitor_;
    EventGate babble_gate_;
    std::uint32_t babble_limit_ = 32;  // frames of one station in a cycle
    Followers followers_;
    OtherMasters other_masters_{core_};
    ParallelMaster parallel_master_;
    SlotMonitor slot_monitor_{core_};
    Pings pings_;
    Transmitter transmitter_{core_, calibration_, pings_, slot_monitor_.roster()};
    std::atomic<bool> ready_{false};
    bool may_queue_ = false;  // what ready_ becomes
    /// frames that send() rejected, or its caller dropped, in any thread
    std::atomic<std::uint64_t> rejected_{0};

    LastSync sync_;
    Time began_ = 0;  // local; 0: before the first cycle
    Time last_cycle_ = 0;  // local, of the last receive()
    Time no_carrier_ = 0;  // since when, local; 0: carrier present
    Time unfit_sync_ = 0;  // last one while listening, local; 0: none
    std::uint32_t good_row_ = 0;  // consecutive syncs of one schedule
    // syncs of another schedule since the last of this one
    std::uint32_t foreign_row_ = 0;
    std::optional<Address> newcomer_;  // sent a sync while another station is the master
    Address master_{};  // sender of the last sync of a master
    std::uint32_t master_row_ = 0;  // its consecutive syncs
    Address measured_{};  // the calibrated master …
    std::uint32_t measured_heard_ = 0;  // … and the cycle of its last sync
    std::uint32_t lead_wait_ = 0;  // cycles before a returning master leads again
    std::uint32_t out_of_step_ = 0;  // cycles in state synchronising
    bool schedule_reported_ = false;
    bool uncalibrated_reported_ = false;
    bool unheard_reported_ = false;  // since attach()
};

}  // namespace hal::tdma
