// SPDX-License-Identifier: MIT
#include <algorithm>
#include <array>
#include <atomic>
#include <deque>
#include <memory>
#include <optional>

#include "bus/component/bus_component.hpp"
#include "discipline/discipline.hpp"
#include "fieldbus/tdma/config/schedule.hpp"
#include "fieldbus/tdma/config/schedule_plan.hpp"
#include "fieldbus/tdma/config/segment_reporter.hpp"
#include "fieldbus/tdma/plugins/other_pins.hpp"
#include "fieldbus/tdma/plugins/station_arguments.hpp"
#include "fieldbus/tdma/plugins/station_pins.hpp"
#include "fieldbus/tdma/rtcfg/rtcfg_applicant.hpp"
#include "fieldbus/tdma/rtcfg/rtcfg_service.hpp"
#include "fieldbus/tdma/station/station.hpp"
#include "fieldbus/tdma/tunnel/tap.hpp"
#include "hal/background.hpp"
#include "hal/texts.hpp"

namespace {

using namespace hal::tdma;
namespace ethernet = hal::ethernet;

/// The first instance of the process disciplines its threads' clock; the others, if there are any,
/// share these threads.
std::atomic<const void*> leading_instance{nullptr};  // written in start and stop

class Tdma : public hal::bus::BusComponent, private Events {
public:
    explicit Tdma(const hal_host* host) : BusComponent(host, "tdma.0") {
        arguments_.load();
        station_ = std::make_unique<Station>(arguments_.setup, static_cast<Events*>(this));
        own_faults_ = std::make_unique<SegmentFaults>(arguments_.schedule, arguments_.setup);
        join_rtcfg();
        waiting_.emplace(*this, transmit_, "slot-#.waiting",
                         static_cast<std::int64_t>(arguments_.setup.slots.size()),
                         "frames queued for this slot of the schedule");
        if (arguments_.entry) {
            for (const config::StationEntry& other : arguments_.schedule.stations) {
                if (other.name != arguments_.entry->name) {
                    others_.emplace_back(*this, receive_, other);
                }
            }
        }
        if (arguments_.setup.asks_master) {  // a station without a schedule knows no other
            config::StationEntry master;
            master.name = "master";
            others_.emplace_back(*this, receive_, master);
        }
        const auto& ip = arguments_.own_ip;
        reporter_ = std::make_unique<Reporter>(name_, arguments_.schedule,
                                               ip ? config::to_string(*ip) : std::string());
    }

    /// Opens the port, offers the slots to other links, and claims the clock of the threads. Throws
    /// the reason when one of them fails; then nothing is kept. [setup]
    void start() {
        std::unique_ptr<ethernet::Port> port = open_port();
        OpenedTap tap = open_tunnel(*port);
        if (!ethernet::offer_discipline(*port, station_.get(), delivery_times())) {
            throw std::runtime_error(port->description().address +
                                     " already has a station of this process; give this one its "
                                     "own port, for example sim:NAME/STATION");
        }
        claim_clock();
        port_ = std::move(port);
        tap_ = std::move(tap.tap);
        const std::string& remark = port_->description().remark;
        if (!remark.empty()) {
            hal::MessageLog(name_).print(remark);
        }
        begin_cycles();
        period_reported_ = was_reset_ = false;
        had_carrier_ = true;
        segment_faults_ = own_faults_.get();
        if (service_) {
            service_->begin();
        }
        if (applicant_) {
            applicant_->begin();
            background_->start();
        }
        reporter_->start();
        station_->accompany(companion(), tunnel_.get());
        station_->attach(*port_);
        if (applicant_) {
            reporter_->event(Event::unconfigured, port_->address(), 0);
        }
    }

    void stop() noexcept {
        ethernet::withdraw_discipline(station_.get());
        station_->detach();
        if (leads_) {
            leading_instance.store(nullptr);
        }
        leads_ = false;
        if (background_) {
            background_->stop();
        }
        if (applicant_) {
            applicant_->finish();  // writes what was received so far
        }
        reporter_->stop();
        tap_.reset();
        port_.reset();
    }

    void receive(hal::Cycle cycle) noexcept {
        if (applicant_ && applicant_->cycle()) {
            use_schedule(*applicant_->accepted());
        }
        check_period(cycle);
        const hal::bus::Turn turn = receive_turn(cycle);
        const bool changes_presence =
            turn == hal::bus::Turn::leaves || turn == hal::bus::Turn::returns;
        if (changes_presence) {
            end(second_master_fault_);
            pins_.fault = is_offline(turn) || fault_.lasts();
        }
        if (changes_presence || (turn == hal::bus::Turn::restarts && is_cycle(cycle))) {
            station_->restart();  // it listens before it sends
        }
        if (is_offline(turn)) {
            follow(cycle.period_ns());
        } else if (is_cycle(cycle)) {
            exchange(cycle);
        }
        show();
    }

    void transmit(hal::Cycle cycle) noexcept {
        const bool receives = functions_.transmit(cycle);
        if (functions_.receive_is_missing()) {
            interrupt();
        }
        if (receives && is_cycle(cycle)) {
            station_->transmit(cycle.start_ns());
        }
        for (std::size_t i = 0; i < waiting_->size(); ++i) {
            (*waiting_)[i] =
                static_cast<std::uint32_t>(station_->waiting(arguments_.setup.slots[i].id));
        }
    }

    void make_safe(hal::Cycle) noexcept { interrupt(); }

private:
    /// Opens the port for a station's frames. Throws when it cannot be opened, or has another
    /// address than the configuration gives this station. [setup]
    std::unique_ptr<ethernet::Port> open_port() const {
        const std::string& link = arguments_.link.get();
        ethernet::Options options;
        options.types.assign(Station::types.begin(), Station::types.end());
        const ethernet::Description line = ethernet::describe(link);
        options.pacer = line.paced;
        const auto wanted = arguments_.entry ? arguments_.entry->mac : arguments_.own_mac;
        if (wanted && line.in_memory) {
            options.address = *wanted;
        }
        auto opened = ethernet::open(link, options);
        if (!opened) throw std::runtime_error(opened.problem);
        const ethernet::Address& actual = opened.port->address();
        const std::string has_address = link + " has the address " + ethernet::to_string(actual);
        if (arguments_.own_mac && actual != *arguments_.own_mac) {
            throw std::runtime_error(has_address + ", not that of station=" +
                                     arguments_.station.get() + "; write station=auto");
        }
        if (arguments_.entry && arguments_.entry->mac && actual != *arguments_.entry->mac) {
            throw std::runtime_error(has_address + ", the configuration gives " +
                                     arguments_.entry->name + " " +
                                     ethernet::to_string(*arguments_.entry->mac) +
                                     "; correct the line 'mac' of its block");
        }
        return std::move(opened.port);
    }
    /// Claims the clock of the threads for the first station of this process. In start() behind
    /// what can fail: a claim is not given back. [setup]
    void claim_clock() {
        const void* none = nullptr;
        leads_ = leading_instance.compare_exchange_strong(none, this);
        if (!leads_) return;
        try {
            clock_.claim();
        } catch (...) {
            ethernet::withdraw_discipline(station_.get());
            leading_instance.store(nullptr);
            throw;
        }
    }
    /// Returns the latency of values that pass through this station's slots. [setup]
    ethernet::SlotTimes delivery_times() const {
        ethernet::SlotTimes times;
        const auto which = arguments_.entry
                               ? config::find(arguments_.schedule, arguments_.entry->name)
                               : std::nullopt;
        if (!which) return times;
        for (std::size_t n = 0; n < arguments_.entry->slots.size(); ++n) {
            for (const plan::Way& w : plan::ways_of(arguments_.schedule, *which, n)) {
                times[arguments_.entry->slots[n].setup.id].push_back(
                    {arguments_.schedule.stations[w.other].name, w.there, w.back, w.there_cycles,
                     w.back_cycles, w.round_trip});
            }
        }
        return times;
    }

    /// Uses a schedule received by RTcfg. [realtime]
    void use_schedule(const rtcfg::Accepted& accepted) noexcept {
        segment_faults_ = &accepted.faults;
        period_reported_ = false;
        if (tap_) {
            tap_->scheduled(accepted.schedule.stations.front().ip, tunnel_mtu(accepted.setup));
        }
    }

    /// Returns whether the thread has the period of the schedule; the station only works then.
    bool is_cycle(hal::Cycle cycle) const noexcept {
        return !station_->setup().configured || cycle.period_ns() == station_->setup().cycle;
    }
    /// Reports a thread of another period, once. [realtime]
    void check_period(hal::Cycle cycle) noexcept {
        if (is_cycle(cycle) || period_reported_) return;
        period_reported_ = true;
        on_event(Event::wrong_period, {}, cycle.period_ns());
    }

    /// Receives the frames of a cycle. [realtime]
    void exchange(hal::Cycle cycle) noexcept {
        reset_on_rising_edge();
        for (std::size_t n = 0; n < others_.size(); ++n) {
            others_[n].ask(*station_, n);
        }
        station_->receive(cycle.start_ns());
        watch_second_master();
        follow(cycle.period_ns());
    }

    /// Resets the station when the pin `reset` becomes TRUE. [realtime]
    void reset_on_rising_edge() noexcept {
        const bool rises = pins_.reset && !was_reset_;
        was_reset_ = pins_.reset;
        if (!rises) return;
        station_->reset();
        if (had_carrier_) {
            recover();
        }
    }

    Companion* companion() const noexcept {
        if (service_) return static_cast<Companion*>(&service_->server());
        if (applicant_) return &applicant_->client();
        return nullptr;
    }

    /// Creates the RTcfg service of a master, or the applicant of a station without a schedule.
    /// [setup]
    void join_rtcfg() {
        if (!arguments_.setup.configured) {
            rtcfg::Logical own;
            if (arguments_.own_ip) {
                own = {true, *arguments_.own_ip};
            }
            applicant_ = std::make_unique<rtcfg::Applicant>(
                name_, *station_, own, arguments_.stage_2.get(), static_cast<Events&>(*this));
            background_ =
                std::make_unique<hal::Background>([this](std::int64_t now, bool may_wait) {
                applicant_->work(now);
                if (may_wait) {
                    std::this_thread::sleep_for(std::chrono::milliseconds(20));
                }
            });
        } else if (arguments_.entry && arguments_.entry->role != Role::slave) {
            const hal::Texts texts(*this);
            const auto own = config::find(arguments_.schedule, arguments_.entry->name).value();
            const auto read = [&](const std::string& file, std::string& bytes) {
                return config::read_from_disk(texts.find(file), bytes);
            };
            service_ = std::make_unique<rtcfg::Service>(*station_, arguments_.schedule, own, read,
                                                        static_cast<Events&>(*this));
        }
    }

    /// Creates the network interface for ordinary packets, if any. [setup]
    OpenedTap open_tunnel(const ethernet::Port& port) {
        if (arguments_.tunnel.get().empty()) {
            return {};
        }
        tunnel_ = std::make_unique<Tunnel>(*station_);
        const auto ip = arguments_.entry ? arguments_.entry->ip : arguments_.own_ip;
        OpenedTap opened = open_tap(*tunnel_,
                                    {arguments_.tunnel.get(), port.address(), ip,
                                     parse_prefix(arguments_.netmask.get()).value_or(24)},
                                    name_);
        if (!opened.tap) throw std::runtime_error("tunnel: " + opened.problem);
        if (!arguments_.entry) {
            return opened;  // reported once there is a schedule
        }
        hal::MessageLog(name_).print(
            "tunnel open for ordinary packets: " + opened.tap->name() + ", MTU " +
            std::to_string(tunnel_->mtu()) +
            (arguments_.entry->ip ? ", IP " + config::to_string(*arguments_.entry->ip) : ""));
        return opened;
    }

    /// Synchronises the threads of this process to the schedule. [realtime]
    void follow(std::int64_t period) noexcept {
        const Status& s = station_->status();
        if (!leads_) return;
        const bool synchronised = s.state != State::listening && s.state != State::withdrawn &&
                                  s.state != State::unconfigured;
        if (!synchronised) {
            if (was_synchronised_) {
                discipline_.lose();
            }
        } else {
            follow_reference(s.error, period);
        }
        was_synchronised_ = synchronised;
    }

    void show() noexcept {
        const ethernet::Statistics port = port_ ? port_->statistics() : ethernet::Statistics{};
        pins_.show(*station_, port, tunnel_.get());
        const Status& s = station_->status();
        if (port.up != had_carrier_) {
            had_carrier_ = port.up;
            on_event(port.up ? Event::carrier : Event::no_carrier, {}, 0);
        }
        std::uint64_t foreign = s.count.foreign;
        if (service_) {
            foreign += service_->server().foreign();
        } else if (applicant_) {
            foreign += applicant_->foreign();
        }
        pins_.foreign = foreign;
        if (service_) {
            pins_.stations = service_->server().ready();
            pins_.stations_dead = service_->dead();
        }
        if (applicant_) {
            pins_.stage_2_bytes = applicant_->file_bytes();
        }
        const Time now = s.global - s.offset;
        const std::size_t known = station_->roster().size();
        for (std::size_t n = 0; n < others_.size() && n < station_->pings().size(); ++n) {
            others_[n].show(n < known ? station_->roster()[n] : heard_of_master(s, now),
                            station_->pings()[n], now, station_->setup().cycle);
        }
    }

    /// Returns what a station without a schedule knows of the master, from its syncs. [realtime]
    const Heard& heard_of_master(const Status& s, Time now) noexcept {
        if (heard_.alive != s.master_active) {
            heard_.alive = s.master_active;
            heard_.since = now;
        }
        heard_.frames = s.count.syncs;
        return heard_;
    }

    /// The fault is over. [realtime]
    void recover() noexcept {
        end(fault_);
        pins_.fault = second_master_fault_.lasts();
    }
    /// The fault of a second master lasts while both are received, whatever else happens.
    /// [realtime]
    void watch_second_master() noexcept {
        const bool are_two = station_->hears_second_master() && !withdrawn_;
        if (are_two || !second_master_fault_.lasts()) return;
        end(second_master_fault_);
        pins_.fault = fault_.lasts();
    }

    /// Returns whether an event of a row that ends the fault does so now: `running` after a loss,
    /// the carrier its own fault, the others while the slots may be used. [realtime]
    bool ends(Event e) const noexcept {
        if (e == Event::carrier && is_carrier_fault_) return true;
        if (e != Event::running) return station_->ready();
        return withdrawn_ ||
               station_->status().count.losses + station_->status().count.unanswered != 0;
    }

    // Events of the station. [realtime]
    void on_event(Event e, const Address& who, Time value) noexcept override {
        if (e == Event::master_there || e == Event::withdrew || e == Event::yielded) {
            withdrawn_ = true;
        }
        if (event_rows[static_cast<std::size_t>(e)].effect == hal::bus::Effect::ends && ends(e)) {
            withdrawn_ = withdrawn_ && e != Event::running;
            recover();
        }
        if (const auto* const fault = segment_faults_->of(e, who)) {
            pins_.fault = true;
            hal::LastingFault& of = e == Event::other_master ? second_master_fault_ : fault_;
            if (&of == &fault_) {
                is_carrier_fault_ = e == Event::no_carrier;
            }
            begin(of, fault->text, fault->detail(value));
        }
        reporter_->event(e, who, value);
    }

    StationArguments arguments_{*this};

    hal::Function receive_{*this,
                           "receive",
                           &Tdma::receive,
                           "receives frames and synchronises the clock; first in the thread, whose "
                           "period is the cycle",
                           {.required = true}};
    hal::Function transmit_{*this,
                            "transmit",
                            &Tdma::transmit,
                            "sends the frames queued for the slots of this cycle, and the master's "
                            "sync; last in the thread",
                            {.required = true}};

    hal::Emergency interruption_{*this, &Tdma::make_safe,
                                 "when the thread runs again, the station listens before it sends"};

    StationPins pins_{*this, receive_};

    // in the order of the setup's `others`, then the master of a station without a schedule
    std::deque<OtherPins> others_;
    Heard heard_;  // of the master
    std::optional<hal::Outs<std::uint32_t>> waiting_;
    std::unique_ptr<SegmentFaults> own_faults_;
    const SegmentFaults* segment_faults_ = nullptr;  // or those of the received schedule
    std::unique_ptr<Station> station_;
    std::unique_ptr<rtcfg::Service> service_;  // of the master
    std::unique_ptr<rtcfg::Applicant> applicant_;  // of a station without a schedule
    std::unique_ptr<hal::Background> background_;  // the applicant's helper
    std::unique_ptr<Reporter> reporter_;
    std::unique_ptr<ethernet::Port> port_;
    std::unique_ptr<Tunnel> tunnel_;  // before tap_, which uses it
    std::unique_ptr<Tap> tap_;
    hal::LastingFault fault_;
    hal::LastingFault second_master_fault_;  // beside fault_, which later faults replace
    bool leads_ = false;
    bool period_reported_ = false;
    bool was_reset_ = false;
    bool was_synchronised_ = false;
    bool withdrawn_ = false;
    bool had_carrier_ = true;
    bool is_carrier_fault_ = false;  // fault_ is of a carrier that was lost
};

}  // namespace

HAL_COMPONENT(Tdma, "tdma", "Station of an Ethernet segment with time slots (RTnet's TDMA)", R"(
Divides an Ethernet segment into time slots: a master sends a sync at the beginning of each cycle,
and every station sends in its own slots only, so that no frame waits for another. The frames are
RTnet's (RTmac 2.0, TDMA 2.1a). A file that all stations have, `cell.tdma` in the format of RTnet's
`tdma.conf`, defines the slots:

```
master:
cycle 1000             # microseconds
slot 0 100

slave:
name x
slot 0 200
```

and the netlist loads the stations:

```
loadrt threads name1=servo-thread period1=1000000
loadrt tdma link=sim:cell/master,sim:cell/x config=cell.tdma station=master,x
addf tdma.0.receive  servo-thread 1
addf tdma.1.receive  servo-thread 2
addf tdma.0.transmit servo-thread -1
addf tdma.1.transmit servo-thread -1
```

A short schedule can be part of the netlist. This is a complete segment in memory, also on the
virtual clock:

    loadrt tdma link=sim:cell/master,sim:cell/x station=master,x schedule="master:; cycle 1000; slot 0 100; slave:; name x; slot 0 200"
    addf tdma.0.receive  servo-thread
    addf tdma.1.receive  servo-thread
    addf tdma.0.transmit servo-thread
    addf tdma.1.transmit servo-thread

A machine has one station, `loadrt tdma link=eth:enp3s0 config=cell.tdma station=master`. The period
of the thread must be the cycle. `receive` is first in the thread, `transmit` last; between them
other components queue frames for the station: a CANopen master with `link = cane:enp3s0?slot=2`
sends in slot 2. Unless the station is the master, all threads of the process are synchronised to
the sync.

Without a sync for `lost` cycles the station stops sending, `synchronous` and `running` become
false, and a fault is recorded. It recovers by itself with the next syncs. A master that finds
another one at its start does not send until that one is lost. A second master that appears later is
reported and ignored; only a master without followers yields to it, if the address of the second one
is smaller. After a `stop`, or a fault that stopped the thread, a station listens before it sends,
and returns by itself.

With `tunnel=hal0` the component creates a network interface hal0, through which `ping`, `ssh` and
other IP traffic crosses the segment in slot 1, never in a real-time slot. It has the `ip` of the
block, the MAC address of the port and an MTU of the slot size minus 4; creating it needs
CAP_NET_ADMIN.

A station can start without the file: with `station=auto` the master, whose file contains the
station's `mac` or `ip`, sends its block, and with `stage2=FILE` also a file (RTcfg).

Pins with the name of a station as prefix show its state. A new number in `x.ping` sends a ping to
station x: request and answer use the time that real-time frames leave in their senders' slots.
`hal tdma ping x` does this and prints the result.

`hal tdma plan cell.tdma` prints the timing of a schedule; docs/tdma.md describes everything in
detail.
)")
