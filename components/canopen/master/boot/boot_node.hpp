// SPDX-License-Identifier: MIT
// One node as its master sees it: waits for its turn, boots (boot_slave.hpp), starts, is
// supervised, and boots again after a failure or loss. Private to the master.
#pragma once

#include "boot_channel.hpp"
#include "boot_slave.hpp"
#include "nmt_master.hpp"
#include "node_supervision.hpp"

namespace hal::canopen {

/// See the top of this file. All functions [realtime] unless tagged otherwise.
class Master::Node final : private BootOwner {
public:
    Node(const NodeSetup&, RemoteNode&, Master&);  // [setup]

    /// Boots the node, from the beginning; it waits while MasterSetup::parallel others boot.
    void begin(BootStart) noexcept;
    /// Does what is due.
    void poll() noexcept;
    /// Cancels all work; the node is idle until begin().
    void leave(Step, Cause) noexcept;
    /// Starts a booted node. `sent_to_all`: the command was sent to all nodes.
    void start(bool sent_to_all) noexcept;
    /// Executes an NMT command of the application.
    void command(NmtCommand, bool sent_to_all) noexcept;

    void on_event(NodeEvent) noexcept;
    void on_foreign_command(std::uint8_t command) noexcept;
    /// After RemoteNode processed it.
    void on_heartbeat(bool boot_up) noexcept;
    /// Before the SDO client processes it.
    void on_sdo_frame(const Frame&) noexcept;
    /// Updates the status from the remote node.
    void refresh() noexcept;

    /// Returns the largest use of the memory of its tasks, in bytes. [any]
    std::size_t max_task_memory() const noexcept { return channel_.task_memory().max_used(); }
    /// Returns true while the node counts for MasterSetup::parallel.
    bool booting() const noexcept {
        return status.step >= Step::resetting && status.step <= Step::watching;
    }
    /// Returns true if its boot failed or it was lost.
    bool has_failed() const noexcept {
        return status.step == Step::failed || status.step == Step::waiting;
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
    /// The observation of a running node.
    struct Running {
        Time since = 0;
        bool was_operational = false;
        unsigned not_operational = 0;  // heartbeats in a row
        unsigned heartbeats = 0;  // in the window
        Time window_began = 0;
    };
    /// The newest NMT command of another device, while the node was started.
    struct ForeignCommand {
        std::uint8_t command = 0;  // 0: none
        Time at = 0;
    };

    void enter(Step) noexcept override;
    void send(NmtCommand) noexcept override;
    void on_response() noexcept override;
    void on_boot_end() noexcept override;

    void begin_now() noexcept;
    void cancel_work() noexcept;
    void resume_supervision() noexcept;
    void count_in_master(int by) noexcept;
    void set_online() noexcept;
    void set_operational(bool) noexcept;
    bool unsupervised() const noexcept { return (status.notes & note_unsupervised) != 0; }
    Time start_limit() const noexcept;
    void poll_starting() noexcept;
    void run() noexcept;
    void watch_running(bool operational) noexcept;
    void detect_duplicate() noexcept;
    void on_lost() noexcept;
    void on_boot_up() noexcept;
    void reboot_while_booting() noexcept;
    void fail(BootResult, Cause) noexcept;
    void wait_for_absent() noexcept;
    void lose(Cause) noexcept;
    void react(Reaction, Time delay, BootStart) noexcept;
    void retry_after(Time delay, BootStart) noexcept;
    void on_sign_of_life(BootStart) noexcept;
    bool is_started_or_ready() const noexcept {
        return status.step >= Step::ready && status.step <= Step::running;
    }
    Time now() const noexcept { return master_.now_; }

    RemoteNode& remote_;
    Master& master_;
    NodeSupervision supervision_;
    BootChannel channel_;
    BootSlave boot_;

    BootStart next_start_ = BootStart::reset;  // of the boot that is queued or waiting
    NmtCommand stop_command_ = NmtCommand::stop;
    unsigned start_attempts_ = 0;
    unsigned reboots_ = 0;  // during this boot
    Time start_deadline_ = 0;
    Time backoff_ = 0;
    Time wanted_since_ = -1;  // begin of the boot timeout; -1: not waited for
    Running running_{};
    ForeignCommand foreign_{};
};

}  // namespace hal::canopen
