// SPDX-License-Identifier: MIT
// The master as a HAL component; `Names` gives it the pins and functions of `ethercat` or of
// `lcec`.
#pragma once

#include <algorithm>
#include <array>
#include <cstdlib>
#include <ctime>
#include <deque>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include "bus/component/bus_component.hpp"
#include "ethercat/config/event_filter.hpp"
#include "ethercat/config/event_texts.hpp"
#include "ethercat/master/gateway.hpp"
#include "ethercat/master/master.hpp"
#include "ethercat/master/request_queue.hpp"
#include "ethercat/plugins/channels/make_channel.hpp"
#include "ethercat/plugins/data_copies.hpp"
#include "ethercat/plugins/emergencies.hpp"
#include "ethercat/plugins/entry_pins.hpp"
#include "ethercat/plugins/eoe_interfaces.hpp"
#include "ethercat/plugins/ethercat_arguments.hpp"
#include "ethercat/plugins/sample_time.hpp"
#include "ethercat/recorded/recorded_port.hpp"
#include "ethercat/wire/registers.hpp"
#include "hal/clock.hpp"
#include "hal/reporter.hpp"
#include "link/ethernet_capture.hpp"

namespace hal::ethercat {

/// The largest number of slaves on a bus, beyond those of the configuration, that are identified.
constexpr std::size_t spare_slaves = 64;

template <class Names>
class MasterComponent : public hal::bus::BusComponent, private master::Events {
    using Event = master::Event;
    using Master = master::Master;

public:
    explicit MasterComponent(const hal_host* host)
        : BusComponent(host, Names::own, Names::receive, Names::transmit, Names::function) {
        for (std::size_t s = 0; s < bus_.setup.slaves.size(); ++s) {
            const master::Slave& slave = bus_.setup.slaves[s];
            slaves_.emplace_back(*this, receive_, slave.name);
            for (std::size_t n = 0; n < slave.sync_managers.size(); ++n) {
                std::size_t at = 0;
                for (const master::Pdo& pdo : slave.sync_managers[n].pdos) {
                    for (const master::Entry& e : pdo.entries) {
                        entries_.declare(slave.name + ".", e,
                                         slave.sync_managers[n].output && !e.copied, places_.size(),
                                         at);
                        at += e.bits;
                    }
                }
                places_.push_back({s, n});
            }
            for (const config::Channel& channel : bus_.slaves[s].channels) {
                declare_channel(s, channel);
            }
        }
        areas_.resize(places_.size());
        if (has_eoe()) {
            eoe_dropped_.emplace(*this, receive_, "eoe-dropped",
                                 "Ethernet frames to slaves that were dropped: a queue was full, "
                                 "the slave did not take them, or the machine was stopped");
        }
        if constexpr (Names::shared) {
            read_.emplace(*this, "read", &MasterComponent::receive,
                          "read-all of this master alone");
            write_.emplace(*this, "write", &MasterComponent::transmit,
                           "write-all of this master alone");
            activate_.emplace(*this, "activate", &MasterComponent::activate,
                              "without effect: the master starts with the machine; for initf",
                              FunctionOptions{.shared = true});
        }
        period_text_ = "the period of the thread is {} us, the cycle of the configuration " +
                       std::to_string(bus_.setup.cycle_ns / 1000) + " us; change one of them: " +
                       (bus_.lcec ? "appTimePeriod of <master>" : "cycle in [bus]") +
                       "; nothing is exchanged";
    }

    void start() {
        if (!bus_.missing_link.empty()) {
            throw std::runtime_error(bus_.missing_link);
        }
        hal::ethernet::Options options;
        options.types = {ethertype};
        auto primary = open(bus_.link, options);
        decltype(primary) backup;
        if (!bus_.backup.empty()) {
            backup = open(bus_.backup, options);
        }
        if (bus_.setup.lead == master::ClockLead::reference && has_clocks()) {
            clock_.claim();
        }
        primary_ = std::move(primary);
        backup_ = std::move(backup);
        simulated_ = primary_->description().simulated;
        mailboxes_ = std::make_unique<master::Mailboxes>(bus_.setup.slaves.size() + spare_slaves);
        emergencies_ = std::make_unique<Emergencies>(bus_.setup.slaves.size(),
                                                     static_cast<master::Events&>(*this));
        for (std::size_t n = 0; n < mailboxes_->size(); ++n) {
            mailboxes_->at(n).set_sink(MailboxType::coe, emergencies_.get());
        }
        server_ = std::make_unique<master::RequestServer>(*mailboxes_, [this](std::uint16_t n) {
            return master_->status().scanned ? master_->numbered(n) : nullptr;
        }, 2);
        server_->set_poll_interval(emergencies_every_ns);
        channel_requests_ = &server_->open(channels_.size() + 1);
        for (const SlaveChannel& channel : channels_) {
            channel.channel->restart();
        }
        if (has_eoe()) {
            eoe_ = std::make_unique<EoeInterfaces>(name_, bus_, *mailboxes_);
            server_->set_switch(&eoe_->frames());
            eoe_->start();
        }
        master::Setup setup = bus_.setup;
        for (const auto* port : {primary_.get(), backup_.get()}) {
            if (port != nullptr) {
                setup.frame_bytes = std::min(setup.frame_bytes,
                                             hal::ethernet::header_bytes + port->statistics().mtu);
            }
        }
        master_ = std::make_unique<Master>(std::move(setup), primary_->address(),
                                           static_cast<master::Events&>(*this), server_->coe());
        for (std::size_t n = 0; n < server_->workers(); ++n) {
            master_->add(server_->channel(n));
        }
        for (std::size_t n = 0; n < places_.size(); ++n) {
            areas_[n] = master_->data(places_[n].slave, places_[n].sync_manager);
        }
        if (!simulated_) {
            master_->set_epoch(since_2000_ns() - hal::monotonic_ns());
        }
        period_reported_ = was_fresh_ = unknown_raised_ = false;
        failed_.assign(bus_.setup.slaves.size(), Event::slave_operational);
        slave_faults_.resize(bus_.setup.slaves.size());
        clock_faults_.resize(bus_.setup.slaves.size());
        data_faults_.resize(bus_.setup.slaves.size());
        filter_ = config::EventFilter(bus_.setup.slaves.size());
        begin_cycles();
        reporter_.start();
        if (!bus_.gateway.empty()) {
            open_gateway();
        }
        master_->attach(*primary_, backup_.get());
    }

    void stop() noexcept {
        if (primary_ && master_) {
            release_slaves();
        }
        if (server_) {
            server_->stop();
        }
        gateway_.reset();
        eoe_.reset();
        master_.reset();
        server_.reset();
        mailboxes_.reset();
        emergencies_.reset();
        reporter_.stop();
        primary_.reset();
        backup_.reset();
    }

    void receive(hal::Cycle cycle) noexcept {
        if (!master_) return;
        if (!fits(cycle)) {
            show_offline(cycle);
            return;
        }
        const hal::bus::Turn turn = receive_turn(cycle);
        if (is_offline(turn)) {
            show_offline(cycle);
            return;
        }
        now_ns_ = cycle.start_ns();
        master_->receive(cycle.start_ns());
        if (begins_anew(turn)) {
            resume();
        }
        end_faults();
        follow(cycle);
        bus_pins_.show(master_->status(), master_->cycles_incomplete());
        if (eoe_) {
            *eoe_dropped_ = eoe_->dropped();
        }
        for (std::size_t n = 0; n < slaves_.size(); ++n) {
            slaves_[n].show(master_->slave_status(n), emergencies_->of(n));
        }
        if (gateway_ && std::exchange(slaves_changed_, false)) {
            gateway_slaves_->set(
                master_->found(),
                [this](std::size_t n) -> const master::BusSlave& { return master_->found(n); });
        }
        entries_.show(areas_);
        sample_times_.show(*master_);
        each_channel(
            cycle, [](Channel& channel, const SlaveImage& image) noexcept { channel.read(image); });
    }

    void transmit(hal::Cycle cycle) noexcept {
        if (!master_ || !fits(cycle)) return;
        if (!functions_.transmit(cycle)) {
            if (functions_.receive_is_missing() && !interrupted()) {
                make_safe(cycle);
            }
            return;
        }
        // The thread was declared hung, but its cycle goes on.
        if (interrupted()) return;
        record_invalid_inputs(entries_.transmit(areas_));
        each_channel(cycle, [](Channel& channel, const SlaveImage& image) noexcept {
            channel.write(image);
        });
        copies_.run(areas_, *master_);
        if (eoe_) {
            eoe_->step(*master_);
        }
        server_->step(cycle.start_ns());
        master_->transmit(cycle.start_ns());
    }

    /// The function of LinuxCNC that starts the masters. [realtime]
    void activate(hal::Cycle) noexcept {}

    void make_safe(hal::Cycle) noexcept {
        interrupt();
        if (eoe_) {
            eoe_->interrupt();
        }
        if (master_) {
            master_->shut_down();
        }
    }

private:
    /// a mailbox whose state is not in the process data is looked at
    static constexpr std::int64_t emergencies_every_ns = 100'000'000;
    struct Place {
        std::size_t slave = 0;
        std::size_t sync_manager = 0;
    };

    /// A channel of a slave.
    struct SlaveChannel {
        std::size_t slave;
        std::unique_ptr<Channel> channel;
    };
    /// Calls `action` with each channel, in the order of the slaves. [realtime]
    template <class Action>
    void each_channel(hal::Cycle cycle, Action action) const noexcept {
        std::size_t slave = slaves_.size();
        SlaveImage image;
        for (const SlaveChannel& channel : channels_) {
            if (channel.slave != slave) {
                slave = channel.slave;
                image = image_of(slave, cycle);
            }
            action(*channel.channel, image);
        }
    }

    /// What find_field() searches.
    struct FieldSearch {
        const MasterComponent* master;
        std::size_t slave;
    };

    /// Declares the pins of a channel. [setup]
    void declare_channel(std::size_t slave, const config::Channel& channel) {
        const FieldSearch search{this, slave};
        const ChannelPlan plan(*this, receive_, transmit_, bus_.setup.slaves[slave].name, channel,
                               &MasterComponent::find_field, &search);
        channels_.push_back({slave, make_channel(plan)});
    }
    /// Returns where an object of a slave is in the process data; an absent field if it has no such
    /// object. [setup]
    static ImageField find_field(const void* context, const config::ChannelObject& object) {
        const auto& search = *static_cast<const FieldSearch*>(context);
        const MasterComponent& self = *search.master;
        for (std::size_t area = 0; area < self.places_.size(); ++area) {
            const Place& place = self.places_[area];
            if (place.slave != search.slave) continue;
            std::size_t at = 0;
            ImageField found;
            const auto& sm = self.bus_.setup.slaves[place.slave].sync_managers[place.sync_manager];
            for (const master::Pdo& pdo : sm.pdos) {
                for (const master::Entry& e : pdo.entries) {
                    const bool same = e.index == object.index && e.sub == object.sub;
                    if (found.present() && !(same && e.part)) break;
                    if (same) {
                        found.area = area;
                        found.at = found.present() ? found.at : at;
                        found.bits += e.bits;
                    }
                    at += e.bits;
                }
                if (found.present()) break;
            }
            if (!found.present()) continue;
            found.at += object.first_bit;
            found.bits = object.bits != 0 ? object.bits : found.bits;
            return found;
        }
        return {};
    }
    SlaveImage image_of(std::size_t slave, hal::Cycle cycle) const noexcept {
        const master::SlaveStatus status = master_->slave_status(slave);
        const bool reachable = status.online && status.state >= State::preop;
        return {areas_,
                status.operational,
                cycle.period_ns(),
                reachable,
                static_cast<std::uint16_t>(slave),
                channel_requests_};
    }

    static std::unique_ptr<hal::ethernet::Port> open(const std::string& address,
                                                     const hal::ethernet::Options& options) {
        if (hal::ethernet::describe(address).recorded) return open_recorded(address);
        auto opened = hal::ethernet::open(address, options);
        if (!opened) throw std::runtime_error(opened.problem);
        return std::move(opened.port);
    }

    /// Opens a capture: its slaves answer. [setup]
    static std::unique_ptr<hal::ethernet::Port> open_recorded(const std::string& address) {
        const std::string file = hal::ethernet::describe(address).interface;
        const hal::ethernet::Capture capture = hal::ethernet::read_capture(file);
        if (!capture.problem.empty()) throw std::runtime_error(capture.problem);
        auto port = std::make_unique<RecordedPort>(address, capture.frames);
        if (port->answers() != 0) return port;
        throw std::runtime_error(config::unanswered_words(file));
    }

    /// Lets other programs reach the mailboxes of the slaves. [setup]
    void open_gateway() {
        gateway_slaves_ =
            std::make_unique<master::GatewaySlaves>(bus_.setup.slaves.size() + spare_slaves);
        master::GatewaySetup setup;
        setup.address = bus_.gateway;
        setup.port = bus_.gateway_port;
        setup.slaves = [this] { return gateway_slaves_->all(); };
        std::string problem;
        gateway_ = std::make_unique<master::Gateway>(server_->open(), std::move(setup), problem);
        if (!problem.empty()) {
            server_->stop();
            gateway_.reset();
            throw std::runtime_error(problem);
        }
        slaves_changed_ = true;
    }

    bool has_eoe() const {
        for (const master::Slave& s : bus_.setup.slaves) {
            if (s.eoe) return true;
        }
        return false;
    }
    bool has_clocks() const {
        for (const master::Slave& s : bus_.setup.slaves) {
            if (s.dc) return true;
        }
        return false;
    }

    /// Returns whether the thread has the period of the configuration; otherwise nothing is
    /// exchanged. [realtime]
    bool fits(hal::Cycle cycle) noexcept {
        if (cycle.period_ns() == bus_.setup.cycle_ns) {
            end(period_fault_);
            period_reported_ = false;
            return true;
        }
        if (!std::exchange(period_reported_, true)) {
            begin(period_fault_, period_text_, static_cast<double>(cycle.period_ns()) * 1e-3);
        }
        return false;
    }
    /// Takes the slaves to SAFE-OP once, and shows them as offline while no process data is
    /// exchanged. They are started again by the next exchange. [realtime]
    void show_offline(hal::Cycle cycle) noexcept {
        if (!interrupted()) {
            make_safe(cycle);
            if (was_fresh_) {
                discipline_.lose();
            }
            was_fresh_ = false;
        }
        master::BusStatus network = master_->status();
        network.state = State::none;
        network.operational = false;
        network.responding = 0;
        network.wkc = 0;
        network.wkc_state = master::WkcState::none;
        network.dc_synchronised = false;
        bus_pins_.show(network, master_->cycles_incomplete());
        for (std::size_t n = 0; n < slaves_.size(); ++n) {
            master::SlaveStatus slave = master_->slave_status(n);
            slave.state = State::none;
            slave.online = false;
            slave.operational = false;
            slaves_[n].show(slave, emergencies_->of(n));
        }
    }
    /// Returns the time of the clocks of the slaves: ns since 2000-01-01. [setup]
    static std::int64_t since_2000_ns() noexcept {
        constexpr std::int64_t year_2000_s = 946'684'800;
        timespec now{};
        clock_gettime(CLOCK_REALTIME, &now);
        return (now.tv_sec - year_2000_s) * 1'000'000'000 + now.tv_nsec;
    }

    /// Begins anew after the thread was stopped. [realtime]
    void resume() noexcept {
        master_->restart();
        discipline_.lose();
        was_fresh_ = false;
    }

    /// Lets the threads follow the reference clock. [realtime]
    void follow(hal::Cycle cycle) noexcept {
        const Master::Phase phase = master_->dc_phase();
        if (!phase.fresh) {
            if (was_fresh_) {
                discipline_.lose();
            }
            was_fresh_ = false;
            return;
        }
        was_fresh_ = true;
        bus_pins_.phase = static_cast<std::int32_t>(phase.error_ns);
        if (clock_.claimed()) {
            follow_reference(-phase.error_ns, cycle.period_ns());
        }
    }

    /// Takes all slaves to INIT, where outputs are off. [setup]
    void release_slaves() noexcept {
        std::array<std::uint8_t, max_frame_bytes> buffer{};
        FrameWriter frame(buffer, primary_->address());
        if (std::uint8_t* data =
                frame.add(Command::bwr, 0, at_position(0, registers::al_control), 2)) {
            put<std::uint16_t>(data, static_cast<std::uint16_t>(State::init) | al_error);
        }
        primary_->send(frame.finish(), {},
                       simulated_ ? hal::ethernet::unclocked : hal::monotonic_ns());
    }

    using BusComponent::begin;
    /// Raises the fault of an event. [realtime]
    void begin(hal::LastingFault& fault, Event event, std::uint32_t slave = master::Events::bus,
               std::int64_t value = 0) noexcept {
        if (const auto* const text = fault_texts_.of(event, slave)) {
            begin(fault, text->text, text->detail(value));
        }
    }

    /// Raises and ends the faults of a slave, which last until it is operational. [realtime]
    void slave_event(Event event, std::uint32_t slave, std::int64_t first,
                     std::int64_t second) noexcept {
        if (event == Event::slave_lost) {
            begin(slave_faults_[slave], event, slave);
        }
        if (event == Event::fell_back) {
            begin(slave_faults_[slave], event, slave, second);
        }
        if (event == Event::dc_lost || event == Event::dc_far) {
            begin(clock_faults_[slave], event, slave, first);
        }
        if (event == Event::dc_jumped) {
            begin(clock_faults_[slave], event, slave, std::abs(first));
        }
        if (event == Event::data_stale) {
            begin(data_faults_[slave], event, slave);
        }
        if (event == Event::data_fresh) {
            end(data_faults_[slave]);
        }
        if (event == Event::dc_recovered || event == Event::dc_jump_ended) {
            end(clock_faults_[slave]);
        }
        if (prevents_start(event) && failed_[slave] != event) {  // not at each try
            begin(slave_faults_[slave], event, slave);
            failed_[slave] = event;
        }
        if (event == Event::slave_settled) {
            failed_[slave] = Event::slave_operational;
        }
        if (event != Event::slave_operational) return;
        failed_[slave] = event;
        end(slave_faults_[slave]);
        end(clock_faults_[slave]);
    }

    /// Raises and ends the faults of the bus. [realtime]
    void bus_event(Event event, std::int64_t first) noexcept {
        if (event == Event::unknown_slave && !std::exchange(unknown_raised_, true)) {
            begin(unknown_fault_, event);
        }
        if (event == Event::scanned) {
            unknown_raised_ = false;
        }
        if (event == Event::unknown_gone) {
            unknown_raised_ = false;
            end(unknown_fault_);
        }
        if (event == Event::dc_synchronised) {
            end(jump_fault_);
        }
        if (event == Event::no_slaves) {
            begin(nobody_fault_, event);
        }
        if (event == Event::scanned && first > 0) {
            end(nobody_fault_);
        }
        if (event == Event::link_lost && first == 0) {
            begin(link_fault_, event);
        }
        if (event == Event::link_restored && first == 0) {
            end(link_fault_);
        }
        if (event == Event::other_master) {
            begin(other_fault_, event);
            other_seen_ns_ = now_ns_;
        }
    }

    /// Ends faults that no event ends. [realtime]
    void end_faults() noexcept {
        constexpr std::int64_t repeated_within_ns = 3'000'000'000;
        if (other_fault_.lasts() && now_ns_ - other_seen_ns_ > repeated_within_ns) {
            end(other_fault_);
        }
    }

    /// Returns whether a slave is not started because of an event. [realtime]
    static bool prevents_start(Event event) noexcept {
        switch (event) {
        case Event::wrong_vendor:
        case Event::wrong_product:
        case Event::wrong_revision:
        case Event::wrong_serial:
        case Event::slave_missing:
        case Event::duplicate_alias:
        case Event::start_up_failed: return true;
        default: return false;
        }
    }

    // Events of the master. [realtime]
    void on_event(Event event, std::uint32_t slave, std::int64_t first,
                  std::int64_t second) noexcept override {
        if (filter_.is_new(event, slave, first, second)) {
            reporter_.tell({event, slave, first, second});
        }
        const bool named = slave < slaves_.size();
        if (event == Event::scanned || event == Event::topology_changed ||
            event == Event::slave_returned || event == Event::slave_lost) {
            slaves_changed_ = true;
        }
        if (named) {
            slave_event(event, slave, first, second);
        } else if (event == Event::dc_jumped) {
            begin(jump_fault_, event, master::Events::bus, std::abs(first));
        }
        bus_event(event, first);
    }

    EthercatArguments arguments_{*this, Names::file, Names::shared};
    config::Bus bus_ = arguments_.read();
    hal::Function receive_{
        *this,
        Names::receive,
        &MasterComponent::receive,
        "takes the inputs of the slaves; first in the thread, whose period is the cycle",
        {.shared = Names::shared, .required = true}};
    hal::Function transmit_{
        *this,
        Names::transmit,
        &MasterComponent::transmit,
        "sends the outputs of the slaves, starts and watches them; last in the thread",
        {.shared = Names::shared, .required = true}};
    hal::Emergency emergency_{
        *this, &MasterComponent::make_safe,
        "takes the slaves to SAFE-OP at once, where outputs are off; they are started again "
        "when the thread runs again"};
    std::optional<hal::Function> read_, write_, activate_;  // of lcec
    typename Names::BusPins bus_pins_{*this, receive_};
    std::deque<typename Names::SlavePins> slaves_;
    EntryPins entries_{*this, receive_, transmit_};
    SampleTimes sample_times_{*this, receive_, bus_.setup};
    std::vector<SlaveChannel> channels_;
    const DataCopies copies_{bus_};
    master::RequestPort* channel_requests_ = nullptr;  // of server_
    std::vector<Place> places_;  // of the process data, in the order of areas_
    std::vector<std::span<std::uint8_t>> areas_;
    std::vector<Event> failed_;  // why a slave is not started, or slave_operational
    std::string period_text_;
    const hal::bus::FaultTexts fault_texts_ = config::fault_texts(bus_.setup, bus_.link);
    config::EventFilter filter_{0};

    std::unique_ptr<hal::ethernet::Port> primary_, backup_;
    std::unique_ptr<master::Mailboxes> mailboxes_;
    std::unique_ptr<Emergencies> emergencies_;
    std::unique_ptr<master::RequestServer> server_;
    std::unique_ptr<Master> master_;
    std::unique_ptr<EoeInterfaces> eoe_;
    std::optional<hal::Out<std::uint32_t>> eoe_dropped_;  ///< with EoE only
    std::unique_ptr<master::GatewaySlaves> gateway_slaves_;
    std::unique_ptr<master::Gateway> gateway_;
    bool slaves_changed_ = false;
    hal::Reporter<config::EventRecord> reporter_{name_, [this](const config::EventRecord& h) {
        return config::event_text(h, bus_.setup, bus_.link, bus_.backup,
                                  bus_.lcec ? config::Format::lcec : config::Format::ethercat);
    }, 256, [](const config::EventRecord& h, const std::string&) { return config::subject(h); }};
    std::vector<hal::LastingFault> slave_faults_, clock_faults_, data_faults_;  // by slave
    hal::LastingFault period_fault_, unknown_fault_, nobody_fault_, link_fault_, other_fault_;
    hal::LastingFault jump_fault_;  // of a reference clock that the configuration does not name
    std::int64_t now_ns_ = 0;
    std::int64_t other_seen_ns_ = 0;
    bool unknown_raised_ = false;
    bool was_fresh_ = false;
    bool simulated_ = false;
    bool period_reported_ = false;
};

}  // namespace hal::ethercat
