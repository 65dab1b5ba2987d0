// SPDX-License-Identifier: MIT
#include <algorithm>
#include <array>
#include <atomic>
#include <deque>
#include <limits>
#include <memory>
#include <optional>

#include "fieldbus/tdma/config/schedule.hpp"
#include "fieldbus/tdma/config/schedule_plan.hpp"
#include "fieldbus/tdma/config/segment_reporter.hpp"
#include "fieldbus/tdma/plugins/other_pins.hpp"
#include "fieldbus/tdma/rtcfg/rtcfg_applicant.hpp"
#include "fieldbus/tdma/rtcfg/rtcfg_service.hpp"
#include "fieldbus/tdma/station/station.hpp"
#include "fieldbus/tdma/tunnel/tap.hpp"
#include "hal/background.hpp"
#include "hal/component.hpp"
#include "hal/discipline.hpp"
#include "hal/naming.hpp"
#include "hal/texts.hpp"
#include "discipline/discipline.hpp"

namespace {

using namespace hal::tdma;
namespace ethernet = hal::ethernet;

/// The first instance of the process disciplines its threads' clock; the others, if there are any, share these threads.
std::atomic<const void*> leading_instance{nullptr};  // written in start and stop

class Tdma : public hal::Component, private Events {
public:
    explicit Tdma(const hal_host* host) : Component(host) {
        load();
        station_ = std::make_unique<Station>(setup_, static_cast<Events*>(this));
        own_words_ = std::make_unique<FaultWords>(setup_);
        join_rtcfg();
        waiting_.emplace(*this, transmit_, "slot-#.waiting", static_cast<std::int64_t>(setup_.slots.size()),
                         "frames that wait for the #th slot of the configuration");
        if (entry_)
            for (const config::StationEntry& other : schedule_.stations)
                if (other.name != entry_->name) others_.emplace_back(*this, receive_, other);
        if (setup_.asks_master) {  // the only other station that one without a schedule knows
            config::StationEntry master;
            master.name = "master";
            others_.emplace_back(*this, receive_, master);
        }
        reporter_ = std::make_unique<Reporter>(name_, schedule_, own_ip_ ? config::to_string(*own_ip_) : std::string());
    }

    void start() {
        faults_ = hal::extension<hal_faults>("hal.faults/1");
        ethernet::Options options;
        options.types.assign(Station::types.begin(), Station::types.end());
        const ethernet::Description line = ethernet::describe(link_.get());
        options.pacer = line.paced;
        const auto wanted = entry_ ? entry_->mac : own_mac_;
        if (wanted && line.in_memory) options.address = *wanted;
        auto opened = ethernet::open(link_.get(), options);
        if (!opened) throw std::runtime_error(opened.problem);
        if (own_mac_ && opened.port->address() != *own_mac_)
            throw std::runtime_error(link_.get() + " has the address " + ethernet::to_string(opened.port->address()) +
                                     ", not that of station=" + station_argument_.get() + "; write station=auto");
        if (entry_ && entry_->mac && opened.port->address() != *entry_->mac)
            throw std::runtime_error(link_.get() + " has the address " + ethernet::to_string(opened.port->address()) +
                                     ", the configuration gives " + entry_->name + " " + ethernet::to_string(*entry_->mac) +
                                     "; mend the line 'mac' of its block");
        OpenedTap tap = open_tunnel(*opened.port);
        if (!ethernet::offer_discipline(*opened.port, station_.get(), delivery_times()))
            throw std::runtime_error(opened.port->description().address +
                                     " has a station of this process already; give this one a line of its own, as in sim:NAME/STATION");
        const void* nobody = nullptr;
        leads_ = leading_instance.compare_exchange_strong(nobody, this);
        try {
            if (leads_) clock_.claim();
        } catch (...) {
            ethernet::withdraw_discipline(station_.get());
            if (leads_) leading_instance.store(nullptr);
            throw;
        }
        port_ = std::move(opened.port);
        tap_ = std::move(tap.tap);
        const std::string& remark = port_->description().remark;
        if (!remark.empty()) hal::MessageLog(name_).print(remark);
        beat_.lose();
        told_period_ = was_reset_ = false, had_carrier_ = true;
        words_ = own_words_.get();
        if (service_) service_->begin();
        if (applicant_) applicant_->begin(), background_->start();
        reporter_->start();
        station_->accompany(companion(), tunnel_.get());
        station_->attach(*port_);
        if (applicant_) reporter_->event(Event::unconfigured, port_->address(), 0);
    }

    void stop() noexcept {
        ethernet::withdraw_discipline(station_.get());
        station_->detach();
        if (leads_) leading_instance.store(nullptr);
        leads_ = false;
        if (background_) background_->stop();
        if (applicant_) applicant_->finish();  // what came by now is still written
        reporter_->stop();
        tap_.reset();
        port_.reset();
    }

    void receive(hal::Cycle cycle) noexcept {
        if (applicant_ && applicant_->cycle()) take_over(*applicant_->accepted());
        const bool fits = turns_in(cycle);
        if (!fits && !told_period_) {
            told_period_ = true;
            fault = true;
            raise(words_->period, static_cast<double>(cycle.period_ns()) * 1e-3);
            reporter_->event(Event::wrong_period, {}, cycle.period_ns());
        }
        if (fits) {
            if (reset && !was_reset_) {
                station_->reset();
                fault = false;
            }
            was_reset_ = reset;
            for (std::size_t n = 0; n < others_.size(); ++n) others_[n].ask(*station_, n);
            station_->receive(cycle.start_ns());
            follow(cycle.period_ns());
        }
        show();
    }

    void transmit(hal::Cycle cycle) noexcept {
        if (turns_in(cycle)) station_->transmit(cycle.start_ns());
        for (std::size_t i = 0; i < waiting_->size(); ++i)
            (*waiting_)[i] = static_cast<std::uint32_t>(station_->waiting(setup_.slots[i].id));
    }

private:
    /// How long values take by way of this station's slots. [setup]
    ethernet::SlotTimes delivery_times() const {
        ethernet::SlotTimes times;
        const auto          which = entry_ ? config::find(schedule_, entry_->name) : std::nullopt;
        if (!which) return times;
        for (std::size_t n = 0; n < entry_->slots.size(); ++n)
            for (const plan::Way& w : plan::ways_of(schedule_, *which, n))
                times[entry_->slots[n].setup.id].push_back(
                    {schedule_.stations[w.other].name, w.there, w.back, w.there_cycles, w.back_cycles, w.round_trip});
        return times;
    }

    /// A schedule that RTcfg brought. [realtime]
    void take_over(const rtcfg::Accepted& accepted) noexcept {
        words_ = &accepted.words, told_period_ = false;
        if (tap_) tap_->scheduled(accepted.schedule.stations.front().ip, tunnel_mtu(accepted.setup));
    }

    bool turns_in(hal::Cycle cycle) const noexcept { return !station_->setup().configured || cycle.period_ns() == station_->setup().cycle; }
    Companion* companion() const noexcept {
        return service_ ? static_cast<Companion*>(&service_->server()) : applicant_ ? &applicant_->client() : nullptr;
    }

    static constexpr double not_a_number = std::numeric_limits<double>::quiet_NaN();

    void load() {
        const hal::Texts texts(*this);
        std::string      file = "schedule=", text = inline_argument_.get();
        if (is_by_rtcfg()) {
            if (link_.get().empty()) throw std::invalid_argument("on which segment? write link=eth:enp3s0");
            return look_at_tunnel();
        }
        if (!stage_2_argument_.get().empty())
            throw hal::ArgumentError("stage2", "stage2= is of a station that gets its schedule from the master: station=auto");
        if (file_argument_.get().empty() && text.empty()) {
            if (!texts.offered()) return;
            throw std::invalid_argument(
                "it needs a schedule: loadrt tdma link=eth:enp3s0 config=FILE.tdma station=NAME; or, with station=auto, "
                "the master sends it one");
        }
        if (!file_argument_.get().empty() && !text.empty())
            throw hal::ArgumentError("config", "config= and schedule= are both given; one of them says who sends when");
        std::replace(text.begin(), text.end(), ';', '\n');  // of one that stands in the netlist; in a file it may be in a comment
        if (text.empty()) {
            file = texts.find(file_argument_.get());
            if (!config::read_from_disk(file, text))
                throw hal::ArgumentError("config", "config=" + file_argument_.get() + ": the file '" + file + "' cannot be read: " + text);
        }
        config::Reading reading = config::read(text);
        if (!texts.offered() && !reading.good()) throw std::invalid_argument(config::to_string(reading, file));
        texts.begin(file, text);
        for (const config::Message& m : reading.messages)
            texts.say(static_cast<hal_severity>(m.severity), config::code_of(m.topic), m.at.offset, m.at.offset + m.at.length, m.sentence,
                      m.label, m.help);
        if (!reading.good()) hal::Texts::refuse();
        schedule_ = std::move(reading.schedule);
        if (station_argument_.get().empty())
            throw std::invalid_argument("which station is this? write station=NAME; " + file + " has " + config::names(schedule_));
        const auto which = config::find(schedule_, station_argument_.get());
        if (!which)
            throw std::invalid_argument("there is no station '" + station_argument_.get() + "' in " + file + "; it has " +
                                        config::names(schedule_));
        if (link_.get().empty())
            throw std::invalid_argument("on which segment? write link=eth:enp3s0 or link=sim:NAME/" + station_argument_.get());
        entry_ = schedule_.stations[*which];
        setup_ = config::setup_of(schedule_, *which);
        look_at_tunnel();
        look_for_tunnel_slot(file);
    }

    /// The station has no schedule, but only its address: by its MAC address, or by `station=10.0.0.3`.
    bool is_by_rtcfg() {
        const std::string& which = station_argument_.get();
        if (which != "auto") {
            if (!file_argument_.get().empty() || !inline_argument_.get().empty()) return false;
            own_ip_ = config::parse_ip(which);
            own_mac_ = ethernet::parse_address(which);
            if (!own_ip_ && !own_mac_) return false;
        }
        setup_.configured = false;
        setup_.asks_master = true;
        setup_.room_for_slots = most_slots;
        return true;
    }

    /// The master gives stations their schedule, a station without one takes it. [setup]
    void join_rtcfg() {
        if (!setup_.configured) {
            rtcfg::Logical own;
            if (own_ip_) own = {true, *own_ip_};
            applicant_ = std::make_unique<rtcfg::Applicant>(name_, *station_, own, stage_2_argument_.get(), static_cast<Events&>(*this));
            background_ = std::make_unique<hal::Background>([this](std::int64_t now, bool may_wait) {
                applicant_->work(now);
                if (may_wait) std::this_thread::sleep_for(std::chrono::milliseconds(20));
            });
        } else if (entry_ && entry_->role != Role::slave) {
            const hal::Texts texts(*this);
            const auto read = [&](const std::string& file, std::string& bytes) { return config::read_from_disk(texts.find(file), bytes); };
            service_ = std::make_unique<rtcfg::Service>(*station_, schedule_, config::find(schedule_, entry_->name).value(), read,
                                                        static_cast<Events&>(*this));
        }
    }

    void look_at_tunnel() const {
        if (tunnel_argument_.get().empty()) return;
        if (auto problem = wrong_name(tunnel_argument_.get()); !problem.empty()) throw hal::ArgumentError("tunnel", "tunnel=" + problem);
        if (!parse_prefix(netmask_argument_.get()))
            throw hal::ArgumentError("netmask", "netmask=" + netmask_argument_.get() + " is none; write 24 or 255.255.255.0");
    }

    /// What `tunnel=` asks of the schedule.
    void look_for_tunnel_slot(const std::string& file) const {
        if (tunnel_argument_.get().empty()) return;
        const auto is_tunnels = [](const SlotSetup& s) { return s.id == tunnel_slot; };
        if (std::none_of(setup_.slots.begin(), setup_.slots.end(), is_tunnels))
            throw hal::ArgumentError("tunnel", "tunnel=" + tunnel_argument_.get() + ": ordinary packets leave in slot 1, and " + entry_->name +
                                        " has none; write slot 1 OFFSET into its block of " + file +
                                        "; `hal tdma plan` shows what is free");
    }

    /// The interface for ordinary packets, when there is to be one. [setup]
    OpenedTap open_tunnel(const ethernet::Port& port) {
        if (tunnel_argument_.get().empty()) return {};
        tunnel_ = std::make_unique<Tunnel>(*station_);
        const auto ip = entry_ ? entry_->ip : own_ip_;
        OpenedTap opened =
            open_tap(*tunnel_, {tunnel_argument_.get(), port.address(), ip, parse_prefix(netmask_argument_.get()).value_or(24)}, name_);
        if (!opened.tap) throw std::runtime_error("tunnel: " + opened.problem);
        if (!entry_) return opened;  // it is said when there is a schedule
        hal::MessageLog(name_).print("ordinary packets pass by " + opened.tap->name() + ", MTU " + std::to_string(tunnel_->mtu()) +
                                     (entry_->ip ? ", IP " + config::to_string(*entry_->ip) : ""));
        return opened;
    }

    /// The threads of this process come to the schedule. [realtime]
    void follow(std::int64_t period) noexcept {
        const Status& s = station_->status();
        if (!leads_) return;
        const bool beat = s.state != State::listening && s.state != State::withdrawn && s.state != State::unconfigured;
        if (!beat) {
            if (was_beat_) beat_.lose();
        } else {
            clock_.step(beat_.follow(s.error, period, clock_.limit_ns()));
        }
        was_beat_ = beat;
    }

    void show() noexcept {
        const Status&              s = station_->status();
        const ethernet::Statistics port = port_ ? port_->statistics() : ethernet::Statistics{};
        state = static_cast<std::int32_t>(s.state);
        synchronous = s.synchronous;
        calibrated = s.calibrated;
        running = station_->ready();
        leading = s.leading;
        master_active = s.master_active;
        link_up = port.up;
        if (port.up != had_carrier_) {
            had_carrier_ = port.up;
            on_event(port.up ? Event::carrier : Event::no_carrier, {}, 0);
        }
        cycle_number = s.cycle;
        global_time = s.global;
        offset = s.offset;
        drift = s.drift * 1e6;
        delay = static_cast<double>(s.delay) * 1e-3;
        jitter = s.jitter * 1e-3;
        error = static_cast<double>(s.error) * 1e-3;
        syncs = s.count.syncs + s.count.syncs_sent;
        syncs_lost = s.count.syncs_lost;
        sent = s.count.sent;
        dropped = s.count.dropped;
        late = s.count.late + port.late;
        foreign = s.count.foreign + (service_ ? service_->server().foreign() : applicant_ ? applicant_->foreign() : 0);
        configured = station_->setup().configured;
        if (service_) stations = service_->server().ready(), stations_dead = service_->dead();
        if (applicant_) stage_2_bytes = applicant_->file_bytes();
        intruders = s.count.intruders;
        losses = s.count.losses;
        const Time now = s.global - s.offset;
        const std::size_t known = station_->roster().size();
        for (std::size_t n = 0; n < others_.size() && n < station_->pings().size(); ++n)
            others_[n].show(n < known ? station_->roster()[n] : heard_of_master(s, now), station_->pings()[n], now, station_->setup().cycle);
        if (!tunnel_) return;
        tunnel_open = tunnel_->open();
        tunnel_sent = tunnel_->sent();
        tunnel_received = tunnel_->received();
        tunnel_dropped = tunnel_->dropped();
        tunnel_refused = tunnel_->refused();
    }

    /// Of a station without a schedule: what the syncs tell.
    const Heard& heard_of_master(const Status& s, Time now) noexcept {
        if (heard_.alive != s.master_active) heard_.alive = s.master_active, heard_.since = now;
        heard_.frames = s.count.syncs;
        return heard_;
    }

    void raise(const std::string& reason, double detail) noexcept {
        if (faults_ != nullptr) faults_->raise(faults_, this, reason.c_str(), detail);
    }

    // What the station noticed. [realtime]
    void on_event(Event e, const Address& who, Time value) noexcept override {
        switch (e) {
        case Event::sync_lost:
            fault = true;
            raise(words_->sync_lost, static_cast<double>(value) * 1e-9);
            break;
        case Event::other_master:
            fault = true;
            raise(words_->other_master, not_a_number);
            break;
        case Event::other_master_gone:
            if (station_->ready()) fault = false;
            break;
        case Event::master_there:
            fault = withdrawn_ = true;
            raise(words_->master_there, not_a_number);
            break;
        case Event::other_schedule:
            fault = true;
            raise(words_->other_schedule, static_cast<double>(value) * 1e-3);
            break;
        case Event::out_of_step:
            fault = true;
            raise(words_->out_of_step, static_cast<double>(value) * 1e-3);
            break;
        case Event::withdrew:
            fault = withdrawn_ = true;
            raise(words_->withdrew, not_a_number);
            break;
        case Event::foreign_frame:
            fault = true;
            for (const auto& [id, words] : words_->foreign)
                if (static_cast<Time>(id) == value) raise(words, not_a_number);
            break;
        case Event::babbling:
            fault = true;
            raise(words_->babbling, static_cast<double>(value));
            break;
        case Event::uncalibrated:
            fault = true;
            raise(words_->uncalibrated, static_cast<double>(value));
            break;
        case Event::no_carrier:
            fault = true;
            raise(words_->no_carrier, not_a_number);
            break;
        case Event::carrier:
            if (station_->ready()) fault = false;
            break;
        case Event::running:
            if (station_->status().count.losses + station_->status().count.unanswered == 0 && !withdrawn_) break;
            withdrawn_ = false;
            fault = false;  // it recovered by itself
            break;
        default: break;
        }
        reporter_->event(e, who, value);
    }

    const std::string name_ = hal::own_name("tdma.0");
    hal::TextArgument link_{*this, "link", "", "the segment: eth:enp3s0, or in memory sim:NAME/STATION", {.per_instance = true}};
    hal::TextArgument file_argument_{*this, "config", "", "the schedule of the segment: RTnet's tdma.conf and a few keys more"};
    hal::TextArgument inline_argument_{*this, "schedule", "", "the same as a text, with ; at the ends of its lines"};
    hal::TextArgument station_argument_{*this,
                                        "station",
                                        "",
                                        "which block of it this is: by name, ip or mac; auto, or an ip or mac without config=: the master "
                                        "sends the block (RTcfg)",
                                        {.per_instance = true}};
    hal::TextArgument stage_2_argument_{*this,
                                        "stage2",
                                        "",
                                        "with station=auto: where the file is written that the master has for this station (its `stage2`)",
                                        {.per_instance = true}};

    hal::TextArgument tunnel_argument_{*this,
                                       "tunnel",
                                       "",
                                       "an interface for ordinary packets, in slot 1: hal0, or hal%d for the first that is free",
                                       {.per_instance = true}};
    hal::TextArgument netmask_argument_{*this, "netmask", "24", "of the tunnel, as 24 or 255.255.255.0; its address is the block's ip"};

    hal::Function receive_{*this, "receive", &Tdma::receive,
                           "takes what came, keeps the clock; first in the thread, whose period is the cycle"};
    hal::Function transmit_{*this, "transmit", &Tdma::transmit,
                            "sends what waits for the slots of this cycle, and the master's sync; last in the thread"};

    hal::In<bool>           reset{*this, receive_, "reset", "rising edge: a master that stepped down begins anew; acknowledges fault"};
    hal::Out<std::int32_t>  state{*this, receive_, "state",
                                 "0 listening, 1 synchronising, 2 calibrating, 3 running, 4 withdrawn, 5 unconfigured"};
    hal::Out<bool>          synchronous{*this, receive_, "synchronous", "the sync is there, or was a few cycles ago", {.safe = false}};
    hal::Out<bool>          calibrated{*this, receive_, "calibrated", "the way to the master is measured"};
    hal::Out<bool>          running{*this, receive_, "running", "the slots may be used", {.safe = false}};
    hal::Out<bool>          leading{*this, receive_, "leading", "this station sends the syncs"};
    hal::Out<bool>          master_active{*this, receive_, "master-active", "somebody sends them"};
    hal::Out<bool>          configured{*this, receive_, "configured", "it has a schedule: its own, or the master's by RTcfg"};
    hal::Out<std::uint32_t> stations{*this, receive_, "stations",
                                    "of the station that sends the syncs: those that got their schedule from it and are alive"};
    hal::Out<std::uint32_t> stations_dead{*this, receive_, "stations-dead", "such that are silent now"};
    hal::Out<std::uint32_t> stage_2_bytes{*this, receive_, "stage2-bytes", "of the file that came from the master and is written"};
    hal::Out<bool>          link_up{*this, receive_, "link-up", "the line has a carrier"};
    hal::Out<bool>          fault{*this, receive_, "fault", "see show fault; ends when it recovered by itself, or by reset"};
    hal::Out<std::uint32_t> cycle_number{*this, receive_, "cycle", "number of this cycle, the same in all stations"};
    hal::Out<std::int64_t>  global_time{
        *this, receive_, "global-time", "at the beginning of this cycle, the same in all stations", {.unit = "ns"}};
    hal::Out<std::int64_t>  offset{*this, receive_, "offset", "global time less this machine's clock", {.unit = "ns"}};
    hal::Out<double>        drift{*this, receive_, "drift", "the master's clock gains that much on this machine's", {.unit = "ppm"}};
    hal::Out<double>        delay{*this, receive_, "delay", "of a frame from or to the master", {.unit = "us"}};
    hal::Out<double>        jitter{*this, receive_, "jitter", "of the syncs as they were received, rms", {.unit = "us"}};
    hal::Out<double>        error{*this, receive_, "error", "how much later this cycle should have begun", {.unit = "us"}};
    hal::Out<std::uint64_t> syncs{*this, receive_, "syncs", "sent or received"};
    hal::Out<std::uint64_t> syncs_lost{*this, receive_, "syncs-lost", "cycles in which none came"};
    hal::Out<std::uint64_t> sent{*this, receive_, "frames-sent", "in slots"};
    hal::Out<std::uint64_t> dropped{*this, receive_, "frames-dropped", "longer than their slot, or there was no link"};
    hal::Out<std::uint64_t> late{*this, receive_, "frames-late", "not sent, as their slot had passed"};
    hal::Out<std::uint64_t> foreign{*this, receive_, "frames-foreign", "cut, of another version, syncs of another schedule: not acted on"};
    hal::Out<std::uint64_t> intruders{*this, receive_, "frames-intruding", "of other stations in slots of this one"};
    hal::Out<std::uint64_t> losses{*this, receive_, "losses", "times the sync was lost"};
    hal::Out<bool>          tunnel_open{*this, receive_, "tunnel-open", "ordinary packets may pass", {.safe = false}};
    hal::Out<std::uint64_t> tunnel_sent{*this, receive_, "tunnel-sent", "ordinary packets handed to slot 1"};
    hal::Out<std::uint64_t> tunnel_received{*this, receive_, "tunnel-received", "ordinary packets that came for this station"};
    hal::Out<std::uint64_t> tunnel_dropped{*this, receive_, "tunnel-dropped", "ordinary packets, either way, without room or sync"};
    hal::Out<std::uint64_t> tunnel_refused{*this, receive_, "tunnel-refused",
                                           "tunnelled frames that are for others, or cut, or of the segment's own types: not acted on"};

    std::deque<OtherPins>                   others_;  // as the setup's `others`, then the master of one without a schedule
    Heard                                   heard_;   // of that
    config::Schedule                        schedule_;
    std::optional<config::StationEntry>     entry_;
    StationSetup                            setup_;
    std::optional<hal::Outs<std::uint32_t>> waiting_;
    std::unique_ptr<FaultWords>             own_words_;
    const FaultWords*                       words_ = nullptr;  // or those of the schedule that came
    std::optional<config::Ip>               own_ip_;           // of a station without a schedule
    std::optional<Address>                  own_mac_;
    std::unique_ptr<Station>                station_;
    std::unique_ptr<rtcfg::Service>         service_;     // of the master
    std::unique_ptr<rtcfg::Applicant>       applicant_;   // of a station without a schedule
    std::unique_ptr<hal::Background>        background_;  // the applicant's helper
    std::unique_ptr<Reporter>               reporter_;
    std::unique_ptr<ethernet::Port>         port_;
    std::unique_ptr<Tunnel>                 tunnel_;  // before tap_, which uses it
    std::unique_ptr<Tap>                    tap_;
    hal::DisciplinedClock                   clock_;
    hal::Discipline                         beat_;
    const hal_faults*                       faults_ = nullptr;
    bool                                    leads_ = false, told_period_ = false, was_reset_ = false, was_beat_ = false, withdrawn_ = false;
    bool                                    had_carrier_ = true;
};

}  // namespace

HAL_COMPONENT(Tdma, "tdma", "Station of an Ethernet segment with time slots (RTnet's TDMA)", R"(
Shares an Ethernet segment by time: a master sends a sync at the beginning of each cycle, every station sends in its own slots only, so that
no frame ever waits for another. The frames are RTnet's (RTmac 2.0, TDMA 2.1a). Who sends when is said in a file that all stations have,
`cell.tdma`, RTnet's `tdma.conf`:

```
master:
cycle 1000             # microseconds
slot 0 100

slave:
name x
slot 0 200
```

and in the netlist:

```
loadrt threads name1=servo-thread period1=1000000
loadrt tdma link=sim:cell/master,sim:cell/x config=cell.tdma station=master,x
addf tdma.0.receive  servo-thread 1
addf tdma.1.receive  servo-thread 2
addf tdma.0.transmit servo-thread -1
addf tdma.1.transmit servo-thread -1
```

A short schedule may stand in the netlist itself. This is a whole cell in memory, on the virtual clock too:

    loadrt tdma link=sim:cell/master,sim:cell/x station=master,x schedule="master:; cycle 1000; slot 0 100; slave:; name x; slot 0 200"
    addf tdma.0.receive  servo-thread
    addf tdma.1.receive  servo-thread
    addf tdma.0.transmit servo-thread
    addf tdma.1.transmit servo-thread

On a machine there is one station, `loadrt tdma link=eth:enp3s0 config=cell.tdma station=master`. The thread's period must be the cycle.
`receive` stands first in the thread, `transmit` last; between them other components hand their frames to the station: a CANopen master
with `link = cane:enp3s0?slot=2` sends in slot 2. Where the station is not the master, all threads of the process follow the sync.

When no sync comes for as many cycles as `lost` says, the station is silent, `synchronous` and `running` become false and a fault is
recorded. It returns by itself when there is a sync again. A master that finds another when it begins does not send until that one is gone.
A second master that comes later is named and ignored; only a master that no station follows gives way to it, when its address is smaller.

With `tunnel=hal0` the component makes an interface hal0, through which `ping`, `ssh` and all that speaks IP cross the segment in slot 1 and
never in a real-time slot. It has the block's `ip`, the port's MAC address and an MTU of the slot's size less 4, and needs CAP_NET_ADMIN.

A station may start without the file: `station=auto` gets its block from the master, whose file has its `mac` or `ip`, and into
`stage2=FILE` the file that the master has for it (RTcfg).

Pins with a station's name in front show what is heard of that station. Another number in `x.ping` asks station x for an answer: question
and answer leave in their senders' slots, in room that real-time frames leave. `hal tdma ping x` does so and prints what comes of it.

`hal tdma plan cell.tdma` shows what a schedule comes to; docs/tdma.md is the whole story.
)")
