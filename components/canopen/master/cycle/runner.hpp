// SPDX-License-Identifier: MIT
// A master on a link, a cycle at a time:
//
//     Runner runner(config);                  // [setup]
//     runner.attach(*link);
//     each cycle:
//         runner.receive(now);                // what came is in the objects
//         for (auto& slot : runner.slots()) … // objects to pins, pins to slot.wish
//         runner.transmit(now, period);       // SYNC and PDOs are on their way
#pragma once

#include <array>
#include <atomic>
#include <memory>
#include <span>
#include <vector>

#include "canopen/master/boot/flying_master.hpp"
#include "canopen/master/boot/master_objects.hpp"
#include "canopen/master/boot/nmt_master.hpp"
#include "canopen/protocol/device.hpp"
#include "foreign_senders.hpp"
#include "link/can.hpp"
#include "master_node.hpp"
#include "pdo_watch.hpp"

namespace hal::canopen {

/// An object at work. The value is the object's: of a real its bits, of a number all 64.
struct Slot {
    Entry* entry = nullptr;
    std::uint16_t node = 0;
    bool to_node = false;
    bool has_safe = false;
    std::uint64_t safe = 0;
    /// to_node: what is to be sent while the node is operational
    std::uint64_t output = 0;
    const config::Object* object = nullptr;
};

/// The value in an object: of a real its bits, of a number all 64. [realtime]
inline std::uint64_t number_in(const Entry& e) noexcept {
    const auto raw = Dictionary::value<std::uint64_t>(e);
    if (!is_signed(e.type) || e.size == 0 || e.size >= 8) return raw;
    const unsigned bits = 8 * e.size;
    return (raw >> (bits - 1) & 1) != 0 ? raw | ~std::uint64_t{0} << bits : raw;
}

/// What the runner noticed. [realtime]
class Events {
public:
    virtual ~Events() = default;
    virtual void on_step(std::size_t node, const NodeStatus&) noexcept { (void)node; }
    virtual void on_network(const NetworkStatus&) noexcept {}
    virtual void on_emergency(std::size_t node, const Emergency&) noexcept { (void)node; }
    /// A PDO of a node did not come for `silence`, its timeout, in ns. `position` is its
    /// index in OwnNode::received.
    virtual void on_late(std::size_t position, Time silence) noexcept {
        (void)position, (void)silence;
    }
    /// It came with fewer bytes than its objects have; they keep their values. `position` is its
    /// index in OwnNode::received.
    virtual void on_short(std::size_t position, unsigned bytes) noexcept {
        (void)position, (void)bytes;
    }
    /// Another device sends what only this master may send.
    using Foreign = ForeignFrames;
    virtual void on_foreign(const Foreign&) noexcept {}
    /// Another device has the master's own node-id.
    virtual void on_own_id_collision() noexcept {}
    /// The data of an SRDO is invalid; its objects have their safe values. `position` is its
    /// index in OwnNode::srdos.
    virtual void on_srdo_fault(std::size_t position, SrdoFault) noexcept { (void)position; }
    virtual void on_bus_state(can::State) noexcept {}
    /// The link did not pass on what its sender may not send.
    virtual void on_rejected(const can::Rejected&) noexcept {}
    /// Another of the flying masters' states; Runner::flying() has it.
    virtual void on_flying() noexcept {}
    /// What belongs to one SYNC was not all sent when the next was due.
    virtual void on_sync_overrun() noexcept {}
};

class Runner final : private MasterEvents, private SafetyEvents {
public:
    Runner(const config::MasterConfig&, Events&);  // [setup] the configuration outlives it

    /// The next receive() boots the network. [setup]
    void attach(can::Link& link) noexcept;
    /// Nothing is received or sent any more. [setup]
    void detach() noexcept { link_ = nullptr; }

    /// [realtime]
    void receive(Time now) noexcept;
    /// `leads`: the SYNC and the heartbeat are ours; another master on the same bus makes them
    /// otherwise. [realtime]
    void transmit(Time now, Time period, bool leads = true) noexcept;
    /// Sets all outputs to their safe values and takes nodes out of the operational state as
    /// configured. The network boots anew when cycles go on. Sends nothing while a cycle of another
    /// thread uses the link: call it again at the end of that cycle. Async-signal-safe.
    void make_safe() noexcept;

    std::span<Slot> slots() noexcept { return slots_; }
    /// The node is operational, and none of its TPDOs is late.
    bool operational(std::size_t node) const noexcept {
        return statuses_[node]->operational && late_pdos_[node] == 0;
    }
    /// A TPDO is late. `position` is its index in OwnNode::received.
    /// [realtime]
    bool late(std::size_t position) const noexcept { return watches_[position].late(); }
    /// A TPDO of a mandatory node is late. [realtime]
    bool any_late() const noexcept;
    const NodeStatus& status(std::size_t node) const noexcept { return *statuses_[node]; }
    const NetworkStatus& network() const noexcept { return master_.status(); }
    const can::Statistics& link_statistics() const noexcept { return statistics_; }
    /// Returns the number of process data frames and SYNCs withheld because the bus accepted none;
    /// they would be stale. [any]
    std::uint64_t withheld() const noexcept { return withheld_; }
    std::uint64_t syncs() const noexcept { return syncs_; }
    std::uint64_t sync_overruns() const noexcept { return overruns_; }
    // The newest SYNC of another node.
    std::uint64_t syncs_heard() const noexcept { return syncs_heard_; }
    Time sync_came() const noexcept { return sync_came_; }
    /// it was made by another master of this process
    bool sync_is_ours() const noexcept { return sync_ours_; }
    const FlyingMaster& flying() const noexcept { return flying_; }
    /// It is the NMT master: the only one, or the active one of several.
    bool active() const noexcept { return !config_.flying.enabled || flying_.active(); }
    /// The bus was in order, now or earlier: before that it is only waited for.
    bool had_bus() const noexcept { return had_bus_; }
    const OwnNode& own() const noexcept { return own_; }
    Master& master() noexcept { return master_; }
    Device& device() noexcept { return device_; }
    const config::MasterConfig& config() const noexcept { return config_; }
    /// [realtime]
    void restart_node(std::size_t node, Time now) noexcept {
        master_.restart(config_.nodes[node].setup.id, now);
    }
    void restart(Time now) noexcept {
        if (active()) {
            boot(now);
        }
    }
    Srdos::Status srdo(std::size_t position) const noexcept {
        return device_.srdos().status(own_.srdos[position].number);
    }
    /// Acknowledges the fault of an SRDO; its data is valid from the next valid SRDO on. [realtime]
    void acknowledge_srdo(std::size_t position, Time now) noexcept {
        device_.srdos().acknowledge(own_.srdos[position].number, now);
    }
    /// The global fail-safe command goes out with the next transmit(). [realtime]
    bool send_fail_safe() noexcept { return device_.srdos().send_fail_safe(); }

private:
    /// A PDO for when things go wrong.
    struct Output {
        const Sent* sent;
        can::Frame frame;
        bool open = false;  // for a node that is configured
    };
    /// An object that goes alone, by a multiplexed PDO, whenever its value is another.
    struct Multiplexed {
        unsigned number = 0;  // of our TPDO
        std::size_t slot = 0;
        Time inhibit = 0;
        std::uint32_t announced = 0;
        bool sent = false;  // since the node is operational
    };
    void add_nodes();
    void add_slots();
    void add_outputs();
    void add_own_identifiers();
    void begin(Time now) noexcept;
    void drop_backlog(Time now) noexcept;
    bool send_safe_values() noexcept;
    static std::uint64_t safe_value(const Slot&) noexcept;
    std::uint64_t safe_image(const Sent&) const noexcept;
    std::uint64_t safe_image(const OwnSrdo&) const noexcept;
    void boot(Time now) noexcept;
    void note_bus_state(Time now) noexcept;
    std::size_t receive_frames(Time now) noexcept;
    void take(const can::Frame&, Time now) noexcept;
    void open_and_close() noexcept;
    bool mandatory_are_configured() const noexcept;
    void serve_boot(Time now, Time period) noexcept;
    void fly(Time now) noexcept;
    void note_sync(const can::Frame&, Time now) noexcept;
    void send(Time now) noexcept;
    bool is_stuck(Time now) noexcept;
    bool is_process_data(const can::Frame&) const noexcept;
    void produce_sync(Time now, Time period) noexcept;
    void produce_time(Time now) noexcept;
    void send_all_to(std::size_t node) noexcept;
    void forget_inputs_of(std::size_t node) noexcept;
    void accept_outputs() noexcept;
    void send_multiplexed(Time now) noexcept;
    void ask(Time now) noexcept;
    void send_held_values() noexcept;
    bool make_multiplexed_safe(const Output&) noexcept;
    void watch_pdos(Time now) noexcept;
    void watch_srdos(Time now) noexcept;

    void on_step(const NodeStatus&) noexcept override;
    void on_network(const NetworkStatus&) noexcept override;
    void on_emergency(std::uint8_t node, const Emergency&) noexcept override;
    void on_rpdo_short(unsigned number, unsigned bytes, Time) noexcept override {
        events_.on_short(number - 1, bytes);
    }
    void on_id_collision(Time) noexcept override { events_.on_own_id_collision(); }
    void on_srdo_fault(unsigned number, SrdoFault fault, Time) noexcept override {
        events_.on_srdo_fault(number - 1, fault);
    }

    const config::MasterConfig& config_;
    Events& events_;
    const OwnNode own_;
    Device device_;
    Master master_;
    MasterObjects master_objects_;
    FlyingMaster flying_;
    can::Link* link_ = nullptr;
    std::vector<Slot> slots_;
    std::vector<const NodeStatus*> statuses_;
    std::array<std::uint8_t, 128> position_{};  // node-id to place in the configuration; 255: none
    std::vector<std::uint8_t> open_;  // by node: it is configured, so PDOs go to and fro
    bool steps_changed_ = true;
    bool sync_open_ = false;
    ForeignSenders foreign_;
    unsigned unanswered_waits_ = 0;  // of serve_boot(), in a row
    std::vector<PdoWatch> watches_;  // in the order of OwnNode::received
    std::vector<std::uint8_t> late_pdos_;  // by node
    // by node; started: without regard to late TPDOs; ever: since the network was booted
    std::vector<std::uint8_t> was_operational_, was_started_, ever_operational_;
    std::vector<Output> outputs_;
    /// A PDO of a node that is asked for.
    struct Asked {
        unsigned number = 0;  // of our RPDO
        std::size_t node = 0;
        Time every = 0;
        Time next = 0;
    };
    std::vector<Asked> asked_;
    std::vector<Multiplexed> multiplexed_;
    std::size_t next_multiplexed_ = 0;
    std::vector<can::Frame> stop_commands_;  // NMT commands for make_safe()
    can::Frame sync_frame_;
    can::Statistics statistics_{};
    can::State bus_state_ = can::State::active;
    Time now_ = 0;
    Time next_sync_ = 0;
    Time next_time_ = 0;
    std::uint64_t syncs_ = 0;
    std::uint64_t overruns_ = 0;
    std::uint64_t syncs_heard_ = 0;
    Time sync_came_ = 0;
    std::uint64_t sent_before_ = 0;
    std::uint64_t withheld_ = 0;  // for is_stuck()
    Time moved_ = 0;
    // something was withheld since the bus took the last
    bool holds_frames_ = false;
    bool sync_ours_ = false;
    bool was_active_ = false;
    bool had_bus_ = false;
    FlyingMaster::State flying_state_ = FlyingMaster::State::off;
    bool sync_begun_ = false;
    bool time_begun_ = false;
    bool produces_ = false;
    bool leads_ = true;
    // set by make_safe(), from whichever thread; taken by receive()
    std::atomic<bool> boots_{true};
    std::atomic<bool> safe_{true};  // nothing was sent since make_safe()
    bool begun_ = false;  // since open()
};

}  // namespace hal::canopen
