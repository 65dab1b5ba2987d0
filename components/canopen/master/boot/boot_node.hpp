// SPDX-License-Identifier: MIT
// One node in the boot procedure, from reset to operational. Private to the master.
#pragma once

#include <vector>

#include "nmt_master.hpp"

namespace hal::canopen {

class Master::Node {
public:
    enum class How : std::uint8_t {
        reset,      ///< reset its communication first
        was_reset,  ///< all nodes were reset by one command
        in_unknown_state,   ///< without reset; its state is unknown
        booted,     ///< after its own boot-up message
    };

    Node(const NodeSetup&, RemoteNode&, Master&);  // [setup]

    void begin(How) noexcept;
    void poll() noexcept;
    void leave(Step, Cause) noexcept;  ///< cancels all work; the node is idle until begin()
    void start(bool sent_to_all) noexcept;  ///< `sent_to_all`: the command was sent to all nodes
    void lose(Cause) noexcept;
    bool command(NmtCommand, bool sent_to_all) noexcept;

    void on_event(NodeEvent) noexcept;
    void on_foreign_command(std::uint8_t command) noexcept;
    void on_heartbeat(bool boot_up) noexcept;  ///< after RemoteNode processed it
    void on_sdo_frame(const Frame&) noexcept;  ///< before the SDO client processes it
    void refresh() noexcept;

    /// Returns true while the node counts for MasterSetup::parallel.
    bool booting() const noexcept {
        return status.step >= Step::resetting && status.step <= Step::watching;
    }
    /// Returns true if nodes later in the start order need not wait for this one.
    bool settled() const noexcept {
        return status.operational || removed ||
               (!setup.mandatory && (status.step >= Step::waiting || status.step == Step::off));
    }

    const NodeSetup& setup;
    NodeStatus status{};
    bool removed = false;
    /// never responded since start(): a command to all nodes does not reach it
    bool missing = false;

private:
    enum class Task : std::uint8_t {
        none,
        device_type,
        vendor,
        product,
        revision,
        serial,
        producer,
        program_id,
        program_version,
        control_read,
        stop,
        erase,
        flash,
        download,
        launch,
        restore,
        date,
        time,
        compare,
        write,
        verify,
        consumer_count,
        consumer_entry,
        save,
    };
    enum class Own : std::uint8_t {
        none,
        producer,
        no_producer,
        guard_time,
        life_factor,
        consumer,
        date,
        time
    };
    struct Object {
        const ObjectWrite* write = nullptr;  // nullptr: an object of the master, its value in `own`
        std::uint16_t index = 0;
        std::uint8_t sub = 0;
        Own kind = Own::none;
        bool always = false;
        bool optional = false;
        bool last = true;  // last: the final write of this object
        bool unreadable = false;
        bool absent = false;
        std::array<std::uint8_t, 4> own{};
        std::uint8_t own_size = 0;
        std::span<const std::uint8_t> value() const noexcept {
            return write != nullptr ? std::span<const std::uint8_t>(write->data)
                                    : std::span(own).first(own_size);
        }
    };
    struct Group {
        std::size_t begin = 0;
        std::size_t end = 0;  // of objects_: written completely or not at all
    };

    void add_own(Own, std::uint16_t index, std::uint8_t sub, std::uint32_t value, unsigned size,
                 bool optional);
    void make_groups();

    void enter(Step) noexcept;
    void begin_now() noexcept;
    void reset(NmtCommand) noexcept;
    void cancel_work() noexcept;  // cancels the request and stops the supervision
    void stop_supervision() noexcept;
    void set_sdo_timeout(Time) noexcept;
    void submit(Task, std::uint16_t index, std::uint8_t sub) noexcept;
    void read(Task, std::uint16_t index, std::uint8_t sub) noexcept;
    void write(Task, std::uint16_t index, std::uint8_t sub, std::span<const std::uint8_t>) noexcept;
    void write(Task, std::uint16_t index, std::uint8_t sub, std::uint32_t value,
               unsigned size) noexcept;
    void answered() noexcept;
    void producer_answered() noexcept;
    void program_id_answered() noexcept;
    void program_version_answered() noexcept;
    void restore_answered() noexcept;
    void date_answered(Task task) noexcept;
    void save_answered() noexcept;
    void heard_by_sdo() noexcept;
    bool ok() const noexcept { return request_.abort == Abort::none; }
    bool no_response() const noexcept {
        return !ok() && !request_.aborted_by_server && request_.abort != Abort::memory;
    }
    bool object_missing() const noexcept {
        return request_.aborted_by_server &&
               (request_.abort == Abort::no_object || request_.abort == Abort::no_sub);
    }
    std::uint64_t number() const noexcept;
    void note_object(std::uint16_t index, std::uint8_t sub, std::uint64_t expected = 0,
                     std::uint64_t found = 0) noexcept;
    void note_request(std::uint64_t expected, std::uint64_t found) noexcept {
        note_object(request_.index, request_.sub, expected, found);
    }
    void fail(BootResult, Cause) noexcept;
    void fail_transfer(BootResult) noexcept;
    void react(Reaction, Time delay, How) noexcept;
    void retry_after(Time delay, How) noexcept;
    void on_sign_of_life(How) noexcept;
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
    void producer_rejected() noexcept;
    bool applies(const Object&) const noexcept;
    void configured() noexcept;
    void fail_write(Cause) noexcept;
    bool guarding() const noexcept { return setup.guard_ms != 0 || guarded_; }
    void watch() noexcept;
    void resume_supervision() noexcept;
    Time guard_period() const noexcept {
        return (setup.guard_ms != 0 ? setup.guard_ms : setup.heartbeat_ms) * millisecond;
    }
    void await_heartbeat() noexcept;
    void supervised() noexcept;
    void rebooted_while_booting() noexcept;
    Time now() const noexcept { return master_.now_; }
    Time limit() const noexcept;

    RemoteNode& remote_;
    Master& master_;
    SdoRequest request_{};
    std::vector<std::uint8_t> buffer_;
    std::array<std::uint8_t, 4> small_{};
    std::vector<Object> objects_;
    std::vector<Group> groups_;
    std::size_t own_group_ = 0;  // the first group of the master's own objects

    Task task_ = Task::none;
    Task after_ = Task::none;
    How how_ = How::reset;
    NmtCommand stop_command_ = NmtCommand::stop;
    std::size_t group_ = 0;
    std::size_t object_ = 0;
    std::size_t asked_ = 0;
    std::uint8_t consumers_ = 0;
    std::uint8_t consumer_ = 0;
    std::uint8_t free_ = 0;
    std::uint16_t producer_ms_ = 0;
    bool guarded_ = false;
    bool restored_ = false;
    bool updated_ = false;
    bool state_known_ = false;

    bool sent_pre_operational_ = false;
    bool again_ = false;
    bool was_operational_ = false;
    bool left_running_ = false;
    bool configuration_current_ = false;
    unsigned not_operational_ = 0;
    unsigned start_attempts_ = 0;
    unsigned reboots_ = 0;
    unsigned heartbeats_in_window_ = 0;
    Time deadline_ = 0;
    Time answer_deadline_ = 0;
    Time backoff_ = 0;
    Time running_since_ = 0;
    Time window_began_ = 0;
    Time wanted_since_ = -1;  // begin of the boot timeout; -1: not waited for
    BootResult mismatch_ = BootResult::none;
    std::array<std::uint32_t, 5> identity_{};
    unsigned identity_known_ = 0;
    std::uint8_t foreign_command_ = 0;  // of another device, while the node was started; 0: none
    Time foreign_command_at_ = 0;
    std::uint64_t heartbeats_ = 0;
    std::uint64_t heartbeats_before_ = 0;
};

}  // namespace hal::canopen
