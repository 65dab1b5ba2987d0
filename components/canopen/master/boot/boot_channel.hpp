// SPDX-License-Identifier: MIT
// What the tasks of a boot work with: SDO requests to one node, and waits for a time, a boot-up
// message or a heartbeat, one at a time.
//
//     Task<bool> check_vendor(BootChannel& node) {
//         const SdoAnswer answer = co_await node.read(0x1018, 1);
//         if (!answer.ok()) co_return node.fail_transfer(BootResult::vendor);
//         if (answer.number() == node.setup.vendor) co_return true;
//         node.note_answer(node.setup.vendor, answer.number());
//         co_return node.fail(BootResult::vendor, Cause::mismatch);
//     }
#pragma once

#include <algorithm>
#include <array>
#include <cstring>
#include <span>
#include <vector>

#include "canopen/master/network.hpp"
#include "hal/task.hpp"
#include "node_setup.hpp"
#include "node_status.hpp"

namespace hal::canopen {

/// The end of an SDO request.
struct SdoAnswer {
    Abort abort = Abort::none;
    bool by_server = false;  ///< the node sent `abort`
    std::span<const std::uint8_t> value{};  ///< what was read; valid until the next request

    /// Returns true if the request succeeded.
    bool ok() const noexcept { return abort == Abort::none; }
    /// Returns true if the node did not respond.
    bool no_response() const noexcept { return !ok() && !by_server && abort != Abort::memory; }
    /// Returns true if the node has no such object.
    bool object_missing() const noexcept {
        return by_server && (abort == Abort::no_object || abort == Abort::no_sub);
    }
    /// Returns up to eight bytes of the value as a number.
    std::uint64_t number() const noexcept {
        std::uint64_t number = 0;
        if (!value.empty()) {
            std::memcpy(&number, value.data(), std::min<std::size_t>(value.size(), sizeof number));
        }
        return number;
    }
};

/// The node whose boot it is. [realtime]
class BootOwner {
public:
    /// The boot enters a step. Must not stop the boot.
    virtual void enter(Step) noexcept = 0;
    /// Sends an NMT command to the node.
    virtual void send(NmtCommand) noexcept = 0;
    /// The node responded to an SDO request.
    virtual void on_response() noexcept = 0;
    /// The task ended; BootChannel::outcome() has its result. May start another one.
    virtual void on_boot_end() noexcept = 0;

protected:
    ~BootOwner() = default;
};

/// The result of a boot.
struct BootOutcome {
    BootResult result = BootResult::none;
    Cause cause = Cause::none;
};

/// See the top of this file. All functions [realtime] unless tagged otherwise.
class BootChannel : public TaskChannel {
public:
    /// Memory of the deepest chain of tasks: boot, path, prepare, configuration, update, group, and
    /// one that compares, writes or verifies.
    static constexpr std::size_t task_bytes = 4 * 1024;

    /// `now` is the clock of the master, `sdo_timeout` that of the node. [setup]
    BootChannel(const NodeSetup&, NodeStatus&, RemoteNode&, const Time& now, Time sdo_timeout,
                BootOwner&);

    const NodeSetup& setup;
    NodeStatus& status;
    RemoteNode& remote;

    Time now() const noexcept { return now_; }
    void enter(Step step) noexcept { owner_.enter(step); }
    void send(NmtCommand command) noexcept { owner_.send(command); }

    struct Request {
        BootChannel& node;
        bool await_ready() const noexcept { return false; }
        void await_suspend(std::coroutine_handle<> task) const noexcept { node.suspend(task); }
        SdoAnswer await_resume() const noexcept { return node.answer_; }
    };
    /// Reads an object.
    Request read(std::uint16_t index, std::uint8_t sub) noexcept;
    /// Writes an object; `data` must outlive the request.
    Request write(std::uint16_t index, std::uint8_t sub,
                  std::span<const std::uint8_t> data) noexcept;
    /// Writes a value of `size` bytes. `timeout`: for this request, if it is longer than the
    /// configured one, because the node writes to flash.
    Request write(std::uint16_t index, std::uint8_t sub, std::uint32_t value, unsigned size,
                  Time timeout) noexcept;

    struct Wait {
        BootChannel& node;
        bool await_ready() const noexcept { return false; }
        void await_suspend(std::coroutine_handle<> task) const noexcept { node.suspend(task); }
        /// true: what was waited for came; false: the time is over
        bool await_resume() const noexcept { return node.came_; }
    };
    /// Waits until poll() at `until` or later.
    Wait sleep_until(Time until) noexcept { return wait(Awaited::time, until); }
    /// Waits for a boot-up message.
    Wait boot_up(Time until) noexcept { return wait(Awaited::boot_up, until); }
    /// Waits for a heartbeat or guarding response; remote.state() has its state.
    Wait heartbeat(Time until) noexcept { return wait(Awaited::heartbeat, until); }
    /// Returns the number of heartbeats that on_heartbeat() got.
    std::uint64_t heartbeats() const noexcept { return heartbeats_; }

    /// Sets the outcome: good, or was already operational.
    void succeed(BootResult result) noexcept { outcome_ = {result, Cause::none}; }
    /// Sets the outcome; returns false.
    bool fail(BootResult, Cause) noexcept;
    /// Sets the outcome after a request that failed; returns false.
    bool fail_transfer(BootResult) noexcept;
    BootOutcome outcome() const noexcept { return outcome_; }
    /// Notes an object in the status, for the message of a failure.
    void note_object(std::uint16_t index, std::uint8_t sub, std::uint64_t expected,
                     std::uint64_t found) noexcept;
    /// Notes the object of the last request.
    void note_answer(std::uint64_t expected, std::uint64_t found) noexcept {
        note_object(request_.index, request_.sub, expected, found);
    }

    // For the node.
    /// Stops the previous task, and starts the one that `make` returns.
    template <class Make>
    void start(Make&& make) noexcept {
        stop();
        TaskChannel::start(std::forward<Make>(make));
        end();
    }
    /// Stops the task where it waits; a request is aborted.
    void stop() noexcept;
    void poll() noexcept;
    void on_boot_up() noexcept { arrive(Awaited::boot_up); }
    void on_heartbeat() noexcept {
        ++heartbeats_;
        arrive(Awaited::heartbeat);
    }

private:
    enum class Awaited : std::uint8_t { nothing, answer, time, boot_up, heartbeat };
    Request submit(std::uint16_t index, std::uint8_t sub) noexcept;
    void set_sdo_timeout(Time) noexcept;
    Wait wait(Awaited what, Time until) noexcept {
        awaited_ = what;
        until_ = until;
        return {*this};
    }
    void arrive(Awaited) noexcept;
    void on_answer() noexcept;
    void finish_wait(bool came) noexcept;
    void end() noexcept {
        if (!busy()) {
            owner_.on_boot_end();
        }
    }

    const Time& now_;
    const Time sdo_timeout_;
    BootOwner& owner_;
    SdoRequest request_{};
    std::vector<std::uint8_t> buffer_;
    std::array<std::uint8_t, 4> small_{};
    SdoAnswer answer_{};
    BootOutcome outcome_{};
    Time until_ = 0;
    std::uint64_t heartbeats_ = 0;
    Awaited awaited_ = Awaited::nothing;
    bool came_ = false;
};

}  // namespace hal::canopen
