// SPDX-License-Identifier: MIT
#include <algorithm>
#include <array>
#include <deque>
#include <memory>
#include <optional>
#include <utility>

#include "canopen/master/config/bus_schedule.hpp"
#include "canopen/master/config/config_lines.hpp"
#include "canopen/master/config/master_config.hpp"
#include "canopen/master/cycle/master_reporter.hpp"
#include "canopen/master/cycle/node_pins.hpp"
#include "canopen/master/cycle/runner.hpp"
#include "canopen/master/cycle/safety_pins.hpp"
#include "canopen/master/cycle/shared_link.hpp"
#include "canopen/master/cycle/sync_follower.hpp"
#include "hal/component.hpp"
#include "hal/naming.hpp"
#include "hal/texts.hpp"
#include "hal/way.hpp"

namespace {

using namespace hal::canopen;

std::string seconds_text(Time t) {
    char text[40];
    std::snprintf(text, sizeof text, "%g", static_cast<double>(t) * 1e-9);
    return text;
}

/// A node's faults in words, made before the first cycle.
struct FaultWords {
    std::string                 silent, guarding, toggle, rebooted, reset, left, commanded, not_started, doubled, suspected;
    std::array<std::string, 16> boot;  // by the letter of CiA 302

    FaultWords(const config::Node& n) {
        const std::string who = "node " + std::to_string(n.setup.id) + (n.setup.name.empty() ? "" : " (" + n.setup.name + ")");
        const std::string safe = "; its outputs were set to their safe values";
        const Time        limit = n.setup.heartbeat_limit > 0 ? n.setup.heartbeat_limit : n.setup.heartbeat_ms * millisecond * 5 / 2;
        silent = who + " silent for {} s (limit " + seconds_text(limit) + " s)" + safe;
        guarding = who + " did not answer its guarding for {} s" + safe;
        toggle = who + " answers its guarding with a toggle bit that does not change" + safe;
        rebooted = who + " rebooted without a command from this master" + safe;
        reset = who + " rebooted after an NMT reset from another device" + safe;
        left = who + " left the operational state without a command from this master" + safe;
        commanded = who + " left the operational state after an NMT command from another device" + safe;
        not_started = who + " was started and did not become operational" + safe;
        doubled = who + " is there twice: two devices have this node-id" + safe;
        suspected = who + " sends more heartbeats than it should: two devices may have this node-id";
        for (char letter = 'A'; letter <= 'O'; ++letter)
            boot[static_cast<std::size_t>(letter - 'A')] =
                who + " cannot be booted: " + to_string(static_cast<BootResult>(letter)) + " (result " + letter + ")";
    }
};

/// Of a PDO that a node sends.
struct PdoWords {
    std::string late, cut;
    bool        cut_told = false;  // since the node was booted

    PdoWords(const config::Node& n, const config::Pdo& pdo) {
        const std::string number = "tpdo" + std::to_string(pdo.number);
        char              id[16];
        std::snprintf(id, sizeof id, "%03X", cob_id(pdo.cob));
        const std::string who = "node " + std::to_string(n.setup.id) + " (" + n.name + "): its " + number + " (" + id + ") ";
        late = who + "did not come for {} s";
        cut = who + "has length {} where its objects need " + std::to_string(pdo.bytes()) +
              "; its pins keep their values; what the node maps is said by: hal can pdo show";
    }
};

class Canopen : public hal::Component, private RunnerEvents {
public:
    explicit Canopen(const hal_host* host) : Component(host), name_(name_of(host)) {
        load();
        if (by_index()) {
            update_.emplace(*this, "update", &Canopen::update, "receives, copies received objects to pins and pins to objects, and sends");
        } else {
            receive_.emplace(*this, "receive", &Canopen::receive,
                             "takes what came, boots and watches nodes, copies received objects to pins");
            transmit_.emplace(*this, "transmit", &Canopen::transmit, "copies pins to objects, sends the SYNC and the PDOs of this cycle");
        }
        runner_ = std::make_unique<Runner>(config_, static_cast<RunnerEvents&>(*this));
        const hal::Function& shows = by_index() ? *update_ : *receive_;
        bus_.emplace(*this, shows);
        if (config_.flying.enabled) flying_.emplace(*this, shows);
        if (config_.sync == config::SyncMode::follow && config_.sync_clock) follower_.emplace(*this, shows, config_);
        objects_.emplace(shows, by_index() ? *update_ : *transmit_);
        for (const config::Node& n : config_.nodes) nodes_.emplace_back(*this, shows, n.name), words_.emplace_back(n);
        for (std::size_t i = 0; i < runner_->slots().size(); ++i) {
            const Slot& s = runner_->slots()[i];
            objects_->declare(*this, by_index() ? "" : config_.nodes[s.node].name + ".", s.to_node, *s.object, i);
        }
        for (const Received& r : runner_->own().received) pdo_words_.emplace_back(config_.nodes[r.node], *r.pdo);
        safety_.emplace(*this, shows, *runner_);
        own_id_words_ = "another device on the bus has the node-id of the master, " + std::to_string(config_.node_id) +
                        "; give one of the two another: node-id in [bus], or masternodeid=";
        reporter_ = std::make_unique<Reporter>(name_, config_, file_);
    }

    void start() {
        faults_ = hal::extension<hal_faults>("hal.faults/1");
        hal::can::Options options;
        const hal::can::Description bus = hal::can::describe(config_.link);
        options.bit_rate = bus.in_memory && bus.has_bit_rate ? config_.bit_rate : 0;
        options.send_capacity = 4096;
        options.stamps = true;  // for a SYNC that is followed, and for frames-lost
        std::string problem;
        auto        opened = SharedLink::open(config_.link, options, problem);
        if (!opened) throw std::runtime_error(problem);
        const auto& description = opened->description();
        if (description.bit_rate != 0 && description.bit_rate != config_.bit_rate && description.bit_rate != hal::can::unlimited) {
            const std::string wanted = std::to_string(config_.bit_rate), is = std::to_string(description.bit_rate);
            const std::string& interface = description.interface;
            throw std::runtime_error(config_.link + " runs at " + is + " bit/s, the configuration says " + wanted +
                                     "; change one of them: bitrate = " + is + " in [bus], or " +
                                     (interface.empty() ? "bitrate=" + wanted + " in the address"
                                                        : "sudo ip link set " + interface + " down && sudo ip link set " + interface +
                                                              " up type can bitrate " + wanted));
        }
        if (follower_) follower_->start();
        link_ = std::move(opened);
        period_ = 0;
        unsent_ = unheard_ = 0;
        notes_told_.assign(nodes_.size(), 0);
        reporter_->start();
        runner_->open(*link_);
        tell_ways();
    }

    void stop() noexcept {
        runner_->close();
        reporter_->stop();
        link_.reset();
    }

    void receive(hal::Cycle cycle) noexcept {
        const Time now = cycle.start_ns();
        if (period_ != cycle.period_ns()) {
            period_ = cycle.period_ns();
            if (config_.sync == config::SyncMode::cycle) reporter_->cycle(period_);
            if (config_.sync == config::SyncMode::timed && config_.sync_period % period_ != 0)
                raise("the SYNC period is no multiple of the thread's period; SYNCs come up to half a period early or late", not_a_number);
        }
        now_ = now;
        unheard_ = 0;
        unsent_ += period_;
        if (is_long_now(unsent_, period_)) reporter_->missing(true);
        runner_->receive(now);
        if (follower_) follow(now);
        if (flying_) flying_->show(*runner_);
        bus_->show(*runner_, now);
        for (std::size_t n = 0; n < nodes_.size(); ++n) nodes_[n].show(*runner_, n, now);
        objects_->show(*runner_);
        safety_->show(*runner_, now);
    }

    void transmit(hal::Cycle cycle) noexcept {
        unsent_ = 0;
        unheard_ += cycle.period_ns();
        if (is_long_now(unheard_, cycle.period_ns())) reporter_->missing(false);
        objects_->take(*runner_);
        runner_->transmit(cycle.start_ns(), cycle.period_ns(), link_ && link_->leads(config_.node_id, cycle.start_ns(), cycle.period_ns()));
    }

    void update(hal::Cycle cycle) noexcept {
        receive(cycle);
        transmit(cycle);
    }

    void make_safe(hal::Cycle) noexcept { runner_->make_safe(); }

private:
    static constexpr double not_a_number = std::numeric_limits<double>::quiet_NaN();

    static std::string name_of(const hal_host* host) {
        const auto* naming = hal::extension<hal_naming>(HAL_NAMING);
        return naming != nullptr ? naming->name(host) : "canopen.0";
    }
    bool by_index() const { return slave_ != 0; }
    /// `sum` comes to a second, or three cycles, with what was `added`.
    static bool is_long_now(Time sum, Time added) noexcept {
        const Time limit = std::max<Time>(second, 3 * added);
        return sum >= limit && sum - added < limit;
    }

    /// How long the values of the pins are on the wire, where its schedule is known: to the station called as the node, or at most. [setup]
    void tell_ways() {
        const std::vector<hal::can::DeliveryTime> ways = link_->delivery_times();
        if (ways.empty()) return;
        hal::can::DeliveryTime most = ways.front();
        for (const hal::can::DeliveryTime& w : ways) {
            most.there_ns = std::max(most.there_ns, w.there_ns), most.back_ns = std::max(most.back_ns, w.back_ns);
            most.there_cycles = std::max(most.there_cycles, w.there_cycles), most.back_cycles = std::max(most.back_cycles, w.back_cycles);
            most.round_trip = std::max(most.round_trip, w.round_trip);
        }
        for (const Slot& s : runner_->slots()) {
            const config::Node& node = config_.nodes[s.node];
            const auto          own = std::find_if(ways.begin(), ways.end(), [&](const auto& w) { return w.station == node.name; });
            const auto&         way = own == ways.end() ? most : *own;
            const std::string   far = "node " + std::to_string(node.setup.id) + " (" + node.name + ")";
            const auto          tell = [&](const std::string& pin) {
                hal::tell_way(((by_index() ? "" : node.name + ".") + pin).c_str(), far.c_str(),
                              s.to_node ? way.there_cycles : way.back_cycles, s.to_node ? 0 : way.round_trip,
                              s.to_node ? way.there_ns : way.back_ns);
            };
            if (s.object->bit_pins.empty()) tell(s.object->pin);
            for (const config::BitPin& b : s.object->bit_pins) tell(b.name);
        }
    }

    void load() {
        const hal::Texts texts(*this);
        config::Reading  reading;
        if (by_index() && file_argument_.get().empty()) {
            reading = config::read(config::ByIndex{inputs_.get(), outputs_.get(), eds_.get().empty() ? "" : texts.find(eds_.get()),
                                                   static_cast<unsigned>(slave_), static_cast<unsigned>(own_id_)});
            if (!reading.good()) refuse(reading);
            if (reading.config.nodes.size() == 1 && reading.config.nodes[0].pdos.empty())
                throw std::invalid_argument("no object is named; write inputs=24831 outputs=24675");
            if (const std::string& text = bit_rate_.get(); !text.empty()) {
                const auto bits = config::rate(text);
                if (!bits)
                    throw hal::ArgumentError("bitrate", "bitrate=" + text + ": '" + text + "' is no bit rate; write 1M, 500k or 125000");
                reading.config.bit_rate = *bits;
            }
        } else if (!file_argument_.get().empty()) {
            if (by_index())
                throw hal::ArgumentError("slavenodeid", "slavenodeid= and config= are both given; the configuration says which nodes there are");
            for (const auto& [argument, name] :
                 {std::pair{&inputs_, "inputs"}, {&outputs_, "outputs"}, {&eds_, "eds"}, {&bit_rate_, "bitrate"}})
                if (!argument->get().empty())
                    throw hal::ArgumentError(name, std::string(name) + "=" + argument->get() +
                                                ": the configuration says this; take the argument out, or config=");
            if (own_id_ != 127)
                throw hal::ArgumentError("masternodeid", "masternodeid=" + std::to_string(static_cast<unsigned>(own_id_)) +
                                            ": the configuration says this, node-id in [bus]; take the argument out, or config=");
            file_ = texts.find(file_argument_.get());
            std::string text;
            if (!config::read_from_disk(file_, text))
                throw hal::ArgumentError("config", "config=" + file_argument_.get() + ": the file '" + file_ + "' cannot be read: " + text);
            reading = config::read(text, file_);
            if (reading.good() && reading.config.sync != config::SyncMode::cycle) {
                auto more = config::load_messages(reading.config,
                                                  reading.config.sync_period != 0 ? reading.config.sync_period : millisecond, file_);
                std::move(more.begin(), more.end(), std::back_inserter(reading.messages));
            }
            if (!texts.offered() && !reading.good()) throw std::invalid_argument(config::to_string(reading, file_));
            texts.begin(file_, text);
            for (const config::Message& m : reading.messages)
                if (m.severity != config::Severity::note)  // those are for `hal canopen check`
                    texts.say(static_cast<hal_severity>(m.severity), config::code_of(m.topic), m.at.offset, m.at.offset + m.at.length,
                              m.sentence, m.label, m.help);
            if (!reading.good()) hal::Texts::refuse();
        } else if (texts.offered()) {
            throw std::invalid_argument(
                "it needs a configuration: loadrt canopen config=FILE.canopen; or a single node: loadrt canopen inputs=24831 outputs=24675 "
                "slavenodeid=2");
        }
        config_ = std::move(reading.config);
        if (!link_argument_.get().empty()) config_.link = link_argument_.get();
    }
    [[noreturn]] static void refuse(const config::Reading& reading) {
        const auto error = std::find_if(reading.messages.begin(), reading.messages.end(),
                                        [](const config::Message& m) { return m.severity == config::Severity::error; });
        const std::string text = error->sentence + (error->help.empty() ? "" : "; " + error->help);
        if (error->argument.empty()) throw std::invalid_argument(text);
        throw hal::ArgumentError(error->argument, text);
    }

    void follow(Time now) noexcept {
        switch (follower_->cycle(*runner_, now, period_)) {
        case SyncFollower::Said::lost:
            raise("the SYNC that is followed did not come for {} s; the threads run by their own clock until it comes",
                  follower_->silence(now));
            break;
        case SyncFollower::Said::in_vain:
            raise("the SYNC moves with the threads that follow it: they make it; write clock = own in the configuration",
                  not_a_number);
            break;
        case SyncFollower::Said::unequal:
            raise("the period of the SYNC is no multiple of the thread's: the threads do not follow it; choose another, or write clock = own",
                  not_a_number);
            break;
        case SyncFollower::Said::nothing: break;
        }
    }

    void raise(const char* reason, double detail) noexcept {
        if (faults_ != nullptr) faults_->raise(faults_, this, reason, detail);
    }

    // What the runner noticed. [realtime]
    void on_step(std::size_t place, const NodeStatus& s) noexcept override {
        NodePins&         pins = nodes_[place];
        const FaultWords& w = words_[place];
        const double      silence = s.last_heard == 0 ? not_a_number : static_cast<double>((now_ - s.last_heard + millisecond / 2) / millisecond) * 1e-3;
        if (s.losses != pins.losses) {
            pins.losses = s.losses;
            pins.is_faulty = true;
            switch (s.cause) {
            case Cause::guarding: raise(w.guarding.c_str(), silence); break;
            case Cause::guard_toggle: raise(w.toggle.c_str(), not_a_number); break;
            case Cause::boot_up: raise((s.foreign_command != 0 ? w.reset : w.rebooted).c_str(), not_a_number); break;
            case Cause::left_operational: raise((s.foreign_command != 0 ? w.commanded : w.left).c_str(), not_a_number); break;
            case Cause::not_started: raise(w.not_started.c_str(), not_a_number); break;
            case Cause::duplicate_id: raise(w.doubled.c_str(), not_a_number); break;
            default: raise(w.silent.c_str(), silence); break;
            }
            reporter_->node(s);
            return;
        }
        const bool given_up = s.step == Step::waiting || s.step == Step::failed;
        const bool failed = given_up && s.result != BootResult::none && !booted(s.result);
        if (given_up && s.cause == Cause::not_started && !pins.is_faulty) {
            pins.is_faulty = true;
            raise(w.not_started.c_str(), not_a_number);
            reporter_->node(s);
        } else if (failed && !pins.is_faulty) {
            const NodeSetup& setup = config_.nodes[place].setup;
            // One that is not there yet may still be powered up.
            const bool absent = s.result == BootResult::no_answer && (s.cause == Cause::no_response || s.cause == Cause::not_sent);
            if (absent && (!setup.mandatory || now_ - runner_->network().begun < setup.boot_limit)) return;
            pins.is_faulty = true;
            const std::string& why = s.cause == Cause::duplicate_id ? w.doubled : w.boot[(static_cast<std::size_t>(s.result) - 'A') & 15];
            raise(why.c_str(), not_a_number);
            reporter_->node(s);
        } else if (s.step == Step::running && pins.is_faulty) {
            reporter_->node(s);
        }
        if (s.step == Step::running) tell_notes(place, s);
        if (s.step == Step::running)
            for (std::size_t n = 0; n < pdo_words_.size(); ++n)
                if (runner_->own().received[n].node == place) pdo_words_[n].cut_told = false;
    }
    /// What should be known of a node, once; that it is there twice, after each boot.
    void tell_notes(std::size_t place, const NodeStatus& s) noexcept {
        const unsigned fresh = s.notes & ~unsigned{notes_told_[place]};
        notes_told_[place] = static_cast<std::uint8_t>((notes_told_[place] & ~note_duplicate_id) | s.notes);
        for (unsigned bit = 1; bit <= note_updated; bit <<= 1)
            if ((fresh & bit) != 0) reporter_->note(s, static_cast<Note>(bit));
        if ((fresh & note_duplicate_id) != 0) raise(words_[place].suspected.c_str(), not_a_number);
    }
    void on_network(const NetworkStatus& n) noexcept override {
        static constexpr NodeStatus nobody{};
        const NodeStatus*           about = &nobody;
        for (std::size_t i = 0; i < config_.nodes.size(); ++i)
            if (config_.nodes[i].setup.id == n.node) about = &runner_->status(i);
        reporter_->network(n, *about);
    }
    void on_emergency(std::size_t place, const Emergency& e) noexcept override { reporter_->emergency(runner_->status(place), e); }
    void on_late(std::size_t place) noexcept override {
        raise(pdo_words_[place].late.c_str(), static_cast<double>(runner_->own().received[place].pdo->limit) * 1e-9);
    }
    void on_short(std::size_t place, unsigned bytes) noexcept override {
        if (!std::exchange(pdo_words_[place].cut_told, true)) raise(pdo_words_[place].cut.c_str(), bytes);
    }
    void on_foreign(const Foreign& f) noexcept override {
        if (f.begins && f.sync) raise("another device produces SYNC, too; nodes act on both", not_a_number);
        if (f.begins && f.rpdo) raise("another device sends the RPDO {x} of a node of this master; the node obeys both", f.id);
        reporter_->foreign(f);
    }
    void on_own_id_collision() noexcept override { raise(own_id_words_.c_str(), not_a_number); }
    void on_srdo_fault(std::size_t place, SrdoFault fault) noexcept override { raise(safety_->words(place, fault), not_a_number); }
    void on_bus_state(hal::can::State state) noexcept override {
        if (state == hal::can::State::bus_off)
            raise("the controller is off the bus: too many errors; it is tried again by itself", not_a_number);
        if (state == hal::can::State::down && runner_->had_bus())
            raise("the bus is down: the interface is off or was taken away; it is tried again by itself", not_a_number);
        reporter_->bus(state, runner_->had_bus());
    }
    void on_rejected(const hal::can::Rejected& what) noexcept override { reporter_->rejected(what); }
    void on_flying() noexcept override { reporter_->flying(runner_->flying()); }
    void on_sync_overrun() noexcept override {
        if (!overran_) {
            overran_ = true;
            raise("the frames of a SYNC were not all sent when the next was due; hal canopen plan says what fits", not_a_number);
        }
    }

    const std::string name_;
    hal::TextArgument file_argument_{
        *this, "config", "", "the configuration file, NAME.canopen; several make an instance each", {.per_instance = true}};
    hal::TextArgument link_argument_{
        *this, "link", "", "the bus, instead of the configuration's: can:can0, sim:NAME, …", {.per_instance = true}};
    hal::TextArgument inputs_{*this, "inputs", "",
                              "without a configuration: objects the node receives, by index, decimal or 0x…, INDEX:SUB, INDEX/BITS"};
    hal::TextArgument outputs_{*this, "outputs", "", "objects the node sends"};
    hal::Argument     slave_{*this, "slavenodeid", 0, "the node's id", {.per_instance = true, .min = 0, .max = 127}};
    hal::Argument     own_id_{*this, "masternodeid", 127, "the master's id", {.min = 1, .max = 127}};
    hal::TextArgument bit_rate_{*this, "bitrate", "", "of the bus, bit/s; 1000000 if not given"};
    hal::TextArgument eds_{*this, "eds", "", "the node's device description"};

    std::string                  file_;
    config::MasterConfig         config_;
    std::optional<hal::Function> receive_, transmit_, update_;
    hal::Emergency               emergency_{*this, &Canopen::make_safe, "outputs to their safe values, nodes out of the operational state"};
    std::unique_ptr<Runner>      runner_;
    std::optional<BusPins>       bus_;
    std::optional<FlyingPins>    flying_;
    std::optional<SyncFollower>  follower_;
    std::deque<NodePins>         nodes_;
    std::deque<FaultWords>       words_;
    std::deque<PdoWords>         pdo_words_;  // by place in OwnNode::received
    std::string                  own_id_words_;
    std::optional<ObjectPins>    objects_;
    std::optional<SafetyPins>    safety_;
    std::unique_ptr<Reporter>    reporter_;
    std::unique_ptr<SharedLink>  link_;
    const hal_faults*            faults_ = nullptr;
    std::vector<std::uint8_t>    notes_told_;  // bits of NodeStatus::notes, by node
    Time                         period_ = 0, now_ = 0;
    Time                         unsent_ = 0, unheard_ = 0;  // how long one function ran without the other
    bool                         overran_ = false;
};

}  // namespace

HAL_COMPONENT(Canopen, "canopen", "CANopen master: nodes of a CAN bus as pins", R"(
Boots the nodes of a network, watches them, and exchanges process data with them in every cycle. What there is on the bus, which objects
become pins and by which PDO is said in a configuration file beside the netlist, `axis.canopen`:

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

and in the netlist:

```
loadrt canopen config=axis.canopen
addf canopen.0.receive  servo-thread 1
addf canopen.0.transmit servo-thread -1
net x-status canopen.0.x.statusword => …
```

Every object that a PDO carries is a pin below the node's name, called as the device description calls it: what the node sends is an
output, what it receives an input. `receive` at the beginning of the cycle shows what came since the last; `transmit` at its end sends
the SYNC and all outputs of this cycle. While a node is not operational its outputs are held at their safe values: controlwords at quick
stop, speeds, torques and digital outputs at 0, others at their last value. On `stop`, `unload`, a fault of the thread or the end of the
process the safe values are sent at once and the nodes are told to leave the operational state.

With `sync = follow` the SYNC of another node leads all threads of the machine (`show thread` says so); with `flying-master = medium`
several masters share a network, of which one is active. docs/canopen-configuration.md has all of it.

A node that is lost is a fault (`show fault`), sets its pin `fault`, and is booted again when it comes back, while the others run on.

Without a file, a single node by the indices of its objects:

    loadrt canopen inputs=24831 outputs=24675,25600 slavenodeid=2 masternodeid=1
    addf canopen.0.update servo-thread

The pins are called as the indices are written, inputs are sent to the node, outputs come from it, and there is one function. Several
such instances share a bus when they are given the same `link=`.
)")
