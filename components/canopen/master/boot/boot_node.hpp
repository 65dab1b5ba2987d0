// SPDX-License-Identifier: MIT
// One node on its way from reset to operational and back. Private to the master.
#pragma once

#include <vector>

#include "nmt_master.hpp"

namespace hal::canopen {

class Master::Node {
public:
    enum class How : std::uint8_t {
        reset,      ///< its communication is reset first
        was_reset,  ///< that was done for all
        as_it_is,   ///< nothing is known of its state
        booted,     ///< it has just booted by itself
    };

    Node(const NodeSetup&, RemoteNode&, Master&);  // [setup]

    void begin(How) noexcept;
    void poll() noexcept;
    void leave(Step, Cause) noexcept;  ///< gives up what it does; nothing is tried until it is begun again
    void start(bool told) noexcept;    ///< `told`: the command went to all
    void lose(Cause) noexcept;
    bool command(NmtCommand, bool told) noexcept;

    void on_event(NodeEvent) noexcept;
    void on_beat(bool boot_up) noexcept;       ///< after the remote node took it
    void on_sdo_frame(const Frame&) noexcept;  ///< before the client takes it
    void refresh() noexcept;

    /// It takes one of the places of MasterSetup::parallel.
    bool booting() const noexcept { return status.step >= Step::resetting && status.step <= Step::watching; }
    /// What comes after it in the start order need not wait (any longer).
    bool settled() const noexcept {
        return status.operational || removed || (!setup.mandatory && (status.step >= Step::waiting || status.step == Step::off));
    }

    const NodeSetup& setup;
    NodeStatus status{};
    bool removed = false;
    bool missing = false;  ///< it never answered since start(): a command to all does not reach it

private:
    enum class Task : std::uint8_t {
        none, device_type, vendor, product, revision, serial, producer, program_id, program_version,
        control_read, stop, erase, flash, download, launch,
        restore, date, time, compare, write, verify, consumer_count, consumer_entry, save,
    };
    enum class Own : std::uint8_t { none, producer, no_producer, guard_time, life_factor, consumer, date, time };
    struct Object {
        const ObjectWrite* write = nullptr;  // nullptr: one of ours, its value in `own`
        std::uint16_t index = 0;
        std::uint8_t sub = 0;
        Own kind = Own::none;
        bool always = false, optional = false, last = true;  // last: what the object shall hold in the end
        bool unreadable = false, absent = false;
        std::array<std::uint8_t, 4> own{};
        std::uint8_t own_size = 0;
        std::span<const std::uint8_t> value() const noexcept {
            return write != nullptr ? std::span<const std::uint8_t>(write->data) : std::span(own).first(own_size);
        }
    };
    struct Group {
        std::size_t begin = 0, end = 0;  // of objects_: written together or not at all
    };

    void add_own(Own, std::uint16_t index, std::uint8_t sub, std::uint32_t value, unsigned size, bool optional);
    void make_groups();

    void enter(Step) noexcept;
    void go() noexcept;
    void reset(NmtCommand) noexcept;
    void drop() noexcept;  // what is under way and what was set up for it
    void unwatch() noexcept;
    void patience(Time) noexcept;
    void submit(Task, std::uint16_t index, std::uint8_t sub) noexcept;
    void read(Task, std::uint16_t index, std::uint8_t sub) noexcept;
    void write(Task, std::uint16_t index, std::uint8_t sub, std::span<const std::uint8_t>) noexcept;
    void write(Task, std::uint16_t index, std::uint8_t sub, std::uint32_t value, unsigned size) noexcept;
    void answered() noexcept;
    bool ok() const noexcept { return request_.abort == Abort::none; }
    bool silent() const noexcept { return !ok() && !request_.aborted_by_server && request_.abort != Abort::memory; }
    bool lacks() const noexcept {
        return request_.aborted_by_server && (request_.abort == Abort::no_object || request_.abort == Abort::no_sub);
    }
    std::uint64_t number() const noexcept;
    void about(std::uint16_t index, std::uint8_t sub, std::uint64_t expected = 0, std::uint64_t found = 0) noexcept;
    void about_request(std::uint64_t expected, std::uint64_t found) noexcept { about(request_.index, request_.sub, expected, found); }
    void fail(BootResult, Cause) noexcept;
    void fail_transfer(BootResult) noexcept;
    void react(Reaction, Time delay, How) noexcept;
    void try_again(Time delay, How) noexcept;
    void came_back(How) noexcept;
    void booted(BootResult) noexcept;
    void run() noexcept;

    void identify() noexcept;
    void identified() noexcept;
    void next_identity(std::size_t) noexcept;
    void check_state() noexcept;
    void state_known(bool operational) noexcept;
    void check_program() noexcept;
    void program_differs() noexcept;
    void program_right() noexcept;
    void update() noexcept;
    void update_answered() noexcept;
    void await_flash(Task after) noexcept;
    void flash_ready() noexcept;
    void configure() noexcept;
    void configure_anew() noexcept;
    void configure_from(std::size_t group) noexcept;
    void next_compare() noexcept;
    void next_write() noexcept;
    void next_verify() noexcept;
    void next_group() noexcept;
    void compared() noexcept;
    void written() noexcept;
    void verified() noexcept;
    void consumer_answered() noexcept;
    void refused_producer() noexcept;
    bool applies(const Object&) const noexcept;
    void configured() noexcept;
    void fail_write(Cause) noexcept;
    bool guarding() const noexcept { return setup.guard_ms != 0 || guarded_; }
    void watch() noexcept;
    void watch_on() noexcept;
    Time guard_period() const noexcept { return (setup.guard_ms != 0 ? setup.guard_ms : setup.heartbeat_ms) * millisecond; }
    void await_beat() noexcept;
    void watched() noexcept;
    void rebooted_while_booting() noexcept;
    Time now() const noexcept { return master_.now_; }
    Time limit() const noexcept;

    RemoteNode& remote_;
    Master& master_;
    SdoRequest request_{};
    std::vector<std::uint8_t> room_;
    std::array<std::uint8_t, 4> small_{};
    std::vector<Object> objects_;
    std::vector<Group> groups_;
    std::size_t own_group_ = 0;  // the first of ours

    Task task_ = Task::none, after_ = Task::none;
    How how_ = How::reset;
    NmtCommand held_by_ = NmtCommand::stop;
    std::size_t group_ = 0, object_ = 0, asked_ = 0;
    std::uint8_t consumers_ = 0, consumer_ = 0, free_ = 0;
    std::uint16_t producer_ms_ = 0;
    bool guarded_ = false, restored_ = false, updated_ = false, state_known_ = false, told_pre_operational_ = false, again_ = false;
    bool was_operational_ = false, kept_ = false, skips_configuration_ = false;
    unsigned doubts_ = 0, tries_ = 0, reboots_ = 0, beats_ = 0;
    Time deadline_ = 0, patience_ = 0, backoff_ = 0, running_since_ = 0, beats_since_ = 0;
    Time needed_since_ = -1;  // since when it is waited for
    BootResult mismatch_ = BootResult::none;
    std::array<std::uint32_t, 5> identity_{};
    unsigned identity_known_ = 0;
    std::uint64_t beat_number_ = 0, beat_before_ = 0;
};

}  // namespace hal::canopen
