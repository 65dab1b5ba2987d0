// SPDX-License-Identifier: MIT
#include <algorithm>
#include <deque>
#include <memory>
#include <optional>
#include <utility>

#include "bus/component/bit_rate.hpp"
#include "bus/component/bus_component.hpp"
#include "canopen/master/config/master_config.hpp"
#include "canopen/master/cycle/master_reporter.hpp"
#include "canopen/master/cycle/node_pins.hpp"
#include "canopen/master/cycle/runner.hpp"
#include "canopen/master/cycle/safety_pins.hpp"
#include "canopen/master/cycle/shared_link.hpp"
#include "canopen/master/cycle/sync_follower.hpp"
#include "canopen_arguments.hpp"
#include "fault_messages.hpp"
#include "hal/path_delay.hpp"
#include "hal/setup_time.hpp"

namespace {

using namespace hal::canopen;

class Canopen : public hal::bus::BusComponent, private Events {
public:
    explicit Canopen(const hal_host* host) : BusComponent(host, "canopen.0") {
        std::string file;
        config_ = arguments_.read(file);
        if (by_index()) {
            update_.emplace(
                *this, "update", &Canopen::update,
                "receives, copies received objects to pins and pins to objects, and sends");
        } else {
            receive_.emplace(
                *this, "receive", &Canopen::receive,
                "receives frames, boots and monitors nodes, copies received objects to pins",
                hal::FunctionOptions{.required = true});
            transmit_.emplace(*this, "transmit", &Canopen::transmit,
                              "copies pins to objects, sends the SYNC and the PDOs of this cycle",
                              hal::FunctionOptions{.required = true});
        }
        runner_ = std::make_unique<Runner>(config_, static_cast<Events&>(*this));
        const hal::Function& shows = by_index() ? *update_ : *receive_;
        bus_.emplace(*this, shows);
        if (config_.flying.enabled) {
            flying_.emplace(*this, shows);
        }
        if (config_.sync == config::SyncMode::follow && config_.sync_clock) {
            follower_.emplace(*this, shows, config_);
        }
        objects_.emplace(shows, by_index() ? *update_ : *transmit_);
        for (const config::Node& n : config_.nodes) {
            nodes_.emplace_back(*this, shows, n.name);
        }
        for (std::size_t i = 0; i < runner_->slots().size(); ++i) {
            const Slot& s = runner_->slots()[i];
            objects_->declare(*this, by_index() ? "" : config_.nodes[s.node].name + ".", s.to_node,
                              *s.object, i);
        }
        const std::vector<Received>& received = runner_->own().received;
        messages_.emplace(config_, received);
        node_faults_.resize(nodes_.size());
        late_faults_.resize(received.size());
        short_faults_.resize(received.size());
        short_raised_.resize(received.size());
        srdo_faults_.resize(runner_->own().srdos.size());
        safety_.emplace(*this, shows, *runner_);
        reporter_ = std::make_unique<Reporter>(name_, config_, file);
    }

    void start() {
        setup_time_.start();
        hal::can::Options options;
        const hal::can::Description bus = hal::can::describe(config_.link);
        options.bit_rate = bus.in_memory && bus.has_bit_rate ? config_.bit_rate : 0;
        options.send_capacity = 4096;
        options.stamps = true;  // to follow a SYNC, and to count frames-lost
        std::string problem;
        auto opened = SharedLink::open(config_.link, options, problem);
        if (!opened) throw std::runtime_error(problem);
        hal::bus::check_bit_rate(opened->description(), config_.link, config_.bit_rate,
                                 "bitrate = ", " in [bus]");
        if (follower_) {
            follower_->start();
        }
        link_ = std::move(opened);
        period_ = 0;
        begin_cycles();
        reported_notes_.assign(nodes_.size(), 0);
        reporter_->start();
        runner_->attach(*link_);
        report_path_delays();
    }

    void stop() noexcept {
        runner_->detach();
        reporter_->stop();
        if (link_) {
            setup_time_.expect(link_->closing_ns(), hal::can::closing_text);
        }
        link_.reset();
    }

    void receive(hal::Cycle cycle) noexcept {
        const Time now = cycle.start_ns();
        if (period_ != cycle.period_ns()) {
            period_ = cycle.period_ns();
            if (config_.sync == config::SyncMode::cycle) {
                reporter_->cycle(period_);
            }
            end(period_fault_);
            if (config_.sync == config::SyncMode::timed && config_.sync_period % period_ != 0) {
                begin(period_fault_, messages_->of(BusEvent::sync_between_cycles));
            }
        }
        now_ = now;
        const hal::bus::Turn turn = receive_turn(cycle, !by_index());
        if (is_offline(turn)) {
            show_offline(cycle);
            return;
        }
        runner_->receive(now);
        if (follower_ && begins_anew(turn)) {
            follower_->restart();
        }
        if (follower_) {
            follow(now);
        }
        if (flying_) {
            flying_->show(*runner_);
        }
        bus_->show(*runner_, now);
        for (std::size_t n = 0; n < nodes_.size(); ++n) {
            nodes_[n].show(*runner_, n, now);
        }
        objects_->show(*runner_);
        safety_->show(*runner_, now);
        end_faults(now);
    }

    void transmit(hal::Cycle cycle) noexcept {
        if (!by_index() && !functions_.transmit(cycle)) {
            if (functions_.receive_is_missing()) {
                make_safe(cycle);
            }
            return;
        }
        record_invalid_inputs(objects_->transmit(*runner_));
        runner_->transmit(
            cycle.start_ns(), cycle.period_ns(),
            link_ && link_->leads(config_.node_id, cycle.start_ns(), cycle.period_ns()));
    }

    void update(hal::Cycle cycle) noexcept {
        receive(cycle);
        transmit(cycle);
    }

    void make_safe(hal::Cycle) noexcept {
        interrupt();
        runner_->make_safe();
    }

private:
    bool by_index() const { return arguments_.by_index(); }
    /// Sends the safe values, and shows the network as offline while nothing is sent. It is booted
    /// again when transmit() runs. [realtime]
    void show_offline(hal::Cycle cycle) noexcept {
        make_safe(cycle);
        bus_->show_offline();
        if (flying_) {
            flying_->show_offline();
        }
        for (NodePins& node : nodes_) {
            node.show_offline();
        }
        objects_->show_safe(*runner_);
        safety_->show_offline();
    }

    /// Reports the latency of each pin on a bus with a known schedule: that of the station named as
    /// the node, or the longest. [setup]
    void report_path_delays() {
        const std::vector<hal::can::DeliveryTime> delays = link_->delivery_times();
        if (delays.empty()) return;
        hal::can::DeliveryTime max = delays.front();
        for (const hal::can::DeliveryTime& d : delays) {
            max.there_ns = std::max(max.there_ns, d.there_ns);

            max.back_ns = std::max(max.back_ns, d.back_ns);
            max.there_cycles = std::max(max.there_cycles, d.there_cycles);
            max.back_cycles = std::max(max.back_cycles, d.back_cycles);
            max.round_trip = std::max(max.round_trip, d.round_trip);
        }
        for (const Slot& s : runner_->slots()) {
            const config::Node& node = config_.nodes[s.node];
            const auto own = std::find_if(delays.begin(), delays.end(),
                                          [&](const auto& d) { return d.station == node.name; });
            const auto& delay = own == delays.end() ? max : *own;
            const std::string far =
                "node " + std::to_string(node.setup.id) + " (" + node.name + ")";
            const auto report = [&](const std::string& pin) {
                const std::string full = (by_index() ? "" : node.name + ".") + pin;
                if (s.to_node) {
                    hal::report_path_delay(full.c_str(), far.c_str(), delay.there_cycles, 0,
                                           delay.there_ns);
                } else {
                    hal::report_path_delay(full.c_str(), far.c_str(), delay.back_cycles,
                                           delay.round_trip, delay.back_ns);
                }
            };
            if (s.object->bit_pins.empty()) {
                report(s.object->pin);
            }
            for (const config::BitPin& b : s.object->bit_pins) {
                report(b.name);
            }
        }
    }

    void follow(Time now) noexcept {
        switch (follower_->cycle(*runner_, now, period_)) {
        case SyncFollower::Notice::lost:
            begin(sync_fault_, messages_->of(BusEvent::sync_missing), follower_->silence(now));
            break;
        case SyncFollower::Notice::in_vain:
            begin(sync_fault_, messages_->of(BusEvent::sync_loop));
            break;
        case SyncFollower::Notice::unequal:
            begin(sync_fault_, messages_->of(BusEvent::sync_unequal));
            break;
        case SyncFollower::Notice::unlocked:
            begin(sync_fault_, messages_->of(BusEvent::sync_unlocked),
                  follower_->unlocked_for(now));
            break;
        case SyncFollower::Notice::nothing:
            if (sync_fault_.lasts() && follower_->locked()) {
                end(sync_fault_);
            }
            break;
        }
    }

    /// Ends faults that no event ends: what is received again, and what has not been repeated.
    /// [realtime]
    void end_faults(Time now) noexcept {
        constexpr Time repeated_within = 2 * second;
        if (foreign_fault_.lasts() && now - foreign_seen_ > repeated_within) {
            end(foreign_fault_);
        }
        if (own_id_fault_.lasts() && now - own_id_seen_ > repeated_within) {
            end(own_id_fault_);
        }
        for (std::size_t n = 0; n < late_faults_.size(); ++n) {
            if (late_faults_[n].lasts() && !runner_->late(n)) {
                end(late_faults_[n]);
            }
        }
        for (std::size_t n = 0; n < srdo_faults_.size(); ++n) {
            if (srdo_faults_[n].lasts() && runner_->srdo(n).valid) {
                end(srdo_faults_[n]);
            }
        }
    }

    // Events of the runner. [realtime]
    void on_step(std::size_t position, const NodeStatus& s) noexcept override {
        NodePins& pins = nodes_[position];
        const bool is_lost = s.losses != pins.losses;
        pins.losses = s.losses;
        if (is_lost) return on_lost(position, s);
        switch (s.step) {
        case Step::waiting:
        case Step::failed: return on_boot_failed(position, s);
        case Step::running: return on_running(position, s);
        default: return;
        }
    }
    void on_lost(std::size_t position, const NodeStatus& s) noexcept {
        nodes_[position].is_faulty = true;
        // A fault of a node lasts until it runs again.
        begin(node_faults_[position], messages_->lost(position, s), silence(s));
        reporter_->node(s);
    }
    /// Raises a fault for a node that did not boot or start, once until it runs.
    void on_boot_failed(std::size_t position, const NodeStatus& s) noexcept {
        const bool not_started = s.cause == Cause::not_started;
        const bool not_booted = s.result != BootResult::none && !booted(s.result);
        if (nodes_[position].is_faulty || !(not_started || not_booted)) return;
        if (!not_started && may_be_powering_up(position, s)) return;
        nodes_[position].is_faulty = true;
        begin(node_faults_[position], messages_->not_booted(position, s));
        reporter_->node(s);
    }
    /// Returns true for an absent node that need not be there yet.
    bool may_be_powering_up(std::size_t position, const NodeStatus& s) const noexcept {
        const NodeSetup& setup = config_.nodes[position].setup;
        const bool is_absent = s.result == BootResult::no_answer &&
                               (s.cause == Cause::no_response || s.cause == Cause::not_sent);
        return is_absent &&
               (!setup.mandatory || now_ - runner_->network().begun < setup.boot_limit);
    }
    void on_running(std::size_t position, const NodeStatus& s) noexcept {
        if (nodes_[position].is_faulty) {
            reporter_->node(s);
        }
        end(node_faults_[position]);
        tell_notes(position, s);
        for (std::size_t n = 0; n < short_faults_.size(); ++n) {
            if (runner_->own().received[n].node != position) continue;
            short_raised_[n] = false;
            end(short_faults_[n]);
        }
    }
    /// Returns the time since the last frame of the node, or since its boot began if it has sent
    /// none, in ns, whole milliseconds.
    Time silence(const NodeStatus& s) const noexcept {
        const Time since = s.last_heard != 0 ? s.last_heard : s.begun;
        return (now_ - since + millisecond / 2) / millisecond * millisecond;
    }
    using BusComponent::begin;
    /// Raises a fault with the value of its event; it lasts until end(). [realtime]
    void begin(hal::LastingFault& lasting, const FaultMessages::Fault& fault,
               std::int64_t value = 0) noexcept {
        begin(lasting, fault.text, fault.detail(value));
    }
    /// Reports each note about a node once, a suspected duplicate node ID after each boot.
    void tell_notes(std::size_t position, const NodeStatus& s) noexcept {
        const unsigned fresh = s.notes & ~unsigned{reported_notes_[position]};
        reported_notes_[position] =
            static_cast<std::uint8_t>((reported_notes_[position] & ~note_duplicate_id) | s.notes);
        for (unsigned bit = 1; bit <= note_updated; bit <<= 1) {
            if ((fresh & bit) != 0) {
                reporter_->note(s, static_cast<Note>(bit));
            }
        }
        if ((fresh & note_duplicate_id) != 0) {
            raise(messages_->of(NodeFault::suspected_id, position).text.c_str());
        }
    }
    void on_network(const NetworkStatus& n) noexcept override {
        static constexpr NodeStatus nobody{};
        const NodeStatus* about = &nobody;
        for (std::size_t i = 0; i < config_.nodes.size(); ++i) {
            if (config_.nodes[i].setup.id == n.node) {
                about = &runner_->status(i);
            }
        }
        reporter_->network(n, *about);
    }
    void on_emergency(std::size_t position, const Emergency& e) noexcept override {
        reporter_->emergency(runner_->status(position), e);
    }
    void on_late(std::size_t position, Time silence) noexcept override {
        nodes_[runner_->own().received[position].node].is_faulty = true;
        begin(late_faults_[position], messages_->of(PdoFault::late, position), silence);
    }
    void on_short(std::size_t position, unsigned bytes) noexcept override {
        if (short_raised_[position]) return;
        short_raised_[position] = true;
        begin(short_faults_[position], messages_->of(PdoFault::too_short, position), bytes);
    }
    void on_foreign(const Foreign& f) noexcept override {
        if (f.sync || f.rpdo) {
            foreign_seen_ = now_;
        }
        if (f.begins && f.sync) {
            begin(foreign_fault_, messages_->of(BusEvent::foreign_sync));
        }
        if (f.begins && f.rpdo) {
            begin(foreign_fault_, messages_->of(BusEvent::foreign_rpdo), f.id);
        }
        reporter_->foreign(f);
    }
    void on_own_id_collision() noexcept override {
        own_id_seen_ = now_;
        begin(own_id_fault_, messages_->of(BusEvent::own_id));
    }
    void on_srdo_fault(std::size_t position, SrdoFault fault) noexcept override {
        begin(srdo_faults_[position], safety_->words(position, fault));
    }
    void on_bus_state(hal::can::State state) noexcept override {
        const BusEvent event = bus_event(state, runner_->had_bus());
        switch (bus_event_rows[static_cast<std::size_t>(event)].effect) {
        case hal::bus::Effect::raises: begin(bus_fault_, messages_->of(event)); break;
        case hal::bus::Effect::ends: end(bus_fault_); break;
        case hal::bus::Effect::none: break;
        }
        reporter_->bus(event);
    }
    void on_rejected(const hal::can::Rejected& what) noexcept override {
        reporter_->rejected(what);
    }
    void on_flying() noexcept override { reporter_->flying(runner_->flying()); }
    void on_sync_overrun() noexcept override {
        if (!overran_) {
            overran_ = true;
            raise(messages_->of(BusEvent::sync_overrun).text.c_str());
        }
    }

    ConfigurationArguments arguments_{*this};
    config::MasterConfig config_;
    std::optional<hal::Function> receive_, transmit_, update_;
    hal::Emergency emergency_{
        *this, &Canopen::make_safe,
        "sets outputs to their safe values and takes nodes out of the operational state"};
    std::unique_ptr<Runner> runner_;
    std::optional<BusPins> bus_;
    std::optional<FlyingPins> flying_;
    std::optional<SyncFollower> follower_;
    std::deque<NodePins> nodes_;
    std::optional<FaultMessages> messages_;
    std::optional<ObjectPins> objects_;
    std::optional<SafetyPins> safety_;
    std::unique_ptr<Reporter> reporter_;
    std::unique_ptr<SharedLink> link_;
    hal::SetupTime setup_time_;
    // as nodes, received PDOs and SRDOs
    std::vector<hal::LastingFault> node_faults_, late_faults_, short_faults_, srdo_faults_;
    std::vector<std::uint8_t> short_raised_;  // since the node was booted; as received PDOs
    hal::LastingFault period_fault_, sync_fault_, bus_fault_, foreign_fault_, own_id_fault_;
    Time foreign_seen_ = 0;
    Time own_id_seen_ = 0;
    std::vector<std::uint8_t> reported_notes_;  // bits of NodeStatus::notes, by node
    Time period_ = 0;
    Time now_ = 0;
    bool overran_ = false;
};

}  // namespace

HAL_COMPONENT(Canopen, "canopen", "CANopen master: nodes of a CAN bus as pins", R"(
Boots the nodes of a network, monitors them, and exchanges process data with them in every cycle. A
configuration file beside the netlist, `axis.canopen`, lists the nodes of the bus, the objects that
become pins and the PDOs that carry them:

```
[bus]
link    = sim:axis        # can:can0 on a machine
bitrate = 1M
sync    = cycle
[node 1 x]
device  = cia402
tpdo1   = statusword, position-actual-value
rpdo1   = controlword, target-position
position-actual-value.scale = 10000
target-position.scale       = 10000
```

The netlist:

```
loadrt canopen config=axis.canopen
addf canopen.0.receive  servo-thread 1
addf canopen.0.transmit servo-thread -1
net x-status canopen.0.x.statusword => …
```

Every object that a PDO carries is a pin below the node's name, named as in the device description.
Objects the node sends are output pins, objects it receives are input pins. `receive`, at the
beginning of the cycle, updates the output pins with everything received since the last cycle;
`transmit`, at its end, sends the SYNC and the input pins of this cycle. While a node is not
operational, the master sends it safe values: quick stop in controlwords, 0 for speeds, torques and
digital outputs, the last value for everything else. On `stop`, `unload`, a fault of the thread or
the end of the process, the master sends the safe values at once and commands the nodes to leave the
operational state. When the thread runs again it boots the network; an axis needs another edge of
its `enable`.

With `sync = follow` all threads of the machine are synchronised to the SYNC of another node (see
`show thread`); with `flying-master = medium` several masters share a network and one of them is
active. docs/canopen-configuration.md is the reference.

The loss of a node raises a fault (`show fault`) and sets its pin `fault`. The master boots the node
again when it returns; the other nodes keep running.

A single node needs no file; its objects are given by index:

    loadrt canopen inputs=24831 outputs=24675,25600 slavenodeid=2 masternodeid=1
    addf canopen.0.update servo-thread

Pins are named by the indices as written. `inputs` are sent to the node, `outputs` are received from
it, and there is one function, `update`. Several such instances share a bus if they have the same
`link=`.
)")
