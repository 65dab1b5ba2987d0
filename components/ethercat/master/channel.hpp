// SPDX-License-Identifier: MIT
// One sequential user of the wire besides the process data: a slave's start-up and mailbox, the
// scan, a tool. It has at most one datagram under way. The engine packs the datagrams of all
// channels into frames at the end of each cycle, and resumes the tasks whose datagrams were
// answered or lost at the beginning of the next one.
#pragma once

#include <array>
#include <cstdint>

#include "ethercat/wire/frames.hpp"
#include "hal/task.hpp"

namespace hal::ethercat::master {

/// Answer to a datagram.
struct Answer {
    bool arrived = false;  ///< false: lost, after all repeats
    std::uint16_t wkc = 0;  ///< working counter
    explicit operator bool() const noexcept { return arrived; }
};

/// See the top of this file. All functions [realtime], in the thread of the master's cycle.
///
///     Task<bool> set_address(Channel& channel, std::uint16_t position, std::uint16_t address) {
///         put(channel.data(), address);
///         const Answer answer = co_await channel.exchange(
///             Command::apwr, at_position(position, registers::station_address), 2);
///         co_return answer.wkc == 1;
///     }
class Channel : public TaskChannel {
public:
    static constexpr std::size_t max = 1486;  ///< data bytes of a datagram

    explicit Channel(std::size_t task_bytes = 16 * 1024) : TaskChannel(task_bytes) {}

    /// Returns the data of the next datagram, and after exchange() the answer.
    std::uint8_t* data() noexcept { return data_.data(); }
    const std::uint8_t* data() const noexcept { return data_.data(); }

    struct Exchange {
        Channel& channel;
        bool await_ready() const noexcept { return false; }
        void await_suspend(std::coroutine_handle<> task) const noexcept { channel.suspend(task); }
        Answer await_resume() const noexcept { return channel.answer_; }
    };
    /// Sends a datagram with `length` bytes of data() to an address from at_position(),
    /// at_station() or the logical address space, and waits for it. A lost one is sent again up to
    /// `repeats` times: 0 for a command that may not be executed twice.
    Exchange exchange(Command command, std::uint32_t address, std::uint16_t length,
                      unsigned repeats = 2) noexcept {
        command_ = command;
        address_ = address;
        length_ = length;
        repeats_ = repeats;

        stage_ = Stage::waiting;
        *active_ = 1;
        return {*this};
    }
    /// Waits until `until_ns` on the clock of the cycle.
    Exchange sleep_until(std::int64_t until_ns) noexcept {
        until_ns_ = until_ns;
        stage_ = Stage::sleeping;
        *active_ = 1;
        return {*this};
    }
    /// Waits for `ns`.
    Exchange sleep(std::int64_t ns) noexcept { return sleep_until(now_ns_ + ns); }
    /// Returns the start of the current cycle.
    std::int64_t now_ns() const noexcept { return now_ns_; }

    /// Ends the previous task, and starts the one that `make` returns: channel.start([&] { return
    /// boot(channel, slave); }).
    template <class Make>
    void start(Make&& make) noexcept {
        stop();
        TaskChannel::start(std::forward<Make>(make));
    }
    /// Ends the task where it waits. A datagram under way is ignored when it arrives.
    void stop() noexcept {
        stage_ = Stage::idle;
        generation_++;
        TaskChannel::stop();
    }

    /// Returns the largest part of the memory for tasks that was used so far, 0..1.
    double max_task_share() const noexcept {
        return static_cast<double>(task_memory().max_used()) /
               static_cast<double>(task_memory().size());
    }

    // For the engine.
    enum class Stage : std::uint8_t { idle, waiting, sent, sleeping };
    Stage stage() const noexcept { return stage_; }
    Command command() const noexcept { return command_; }
    std::uint32_t address() const noexcept { return address_; }
    std::uint16_t length() const noexcept { return length_; }
    /// Changes when a datagram under way is no longer awaited.
    std::uint32_t generation() const noexcept { return generation_; }
    std::int64_t sent_ns() const noexcept { return sent_ns_; }
    std::int64_t until_ns() const noexcept { return until_ns_; }
    /// Sets a flag at each exchange() and sleep(), so that idle channels cost nothing. [setup]
    void set_active_flag(std::uint8_t* flag) noexcept { active_ = flag; }
    void set_now(std::int64_t now_ns) noexcept { now_ns_ = now_ns; }
    void set_sent(std::int64_t now_ns) noexcept {
        stage_ = Stage::sent;
        sent_ns_ = now_ns;
    }
    /// Takes the answer; its data must be in data(). Resumes the task.
    void arrive(std::uint16_t wkc) noexcept { finish({true, wkc}); }
    /// Takes the loss of the datagram: it waits to be sent again, or the task is resumed.
    void lose() noexcept {
        ++generation_;
        if (repeats_ == 0) {
            return finish({});
        }
        --repeats_;
        stage_ = Stage::waiting;
    }
    /// Resumes the task at the end of sleep().
    void wake() noexcept { finish({}); }

private:
    void finish(Answer answer) noexcept {
        answer_ = answer;
        stage_ = Stage::idle;
        resume();
    }

    std::array<std::uint8_t, max> data_{};
    std::uint32_t address_ = 0;
    std::uint32_t generation_ = 0;
    std::int64_t now_ns_ = 0;
    std::int64_t sent_ns_ = 0;
    std::int64_t until_ns_ = 0;
    Answer answer_;
    unsigned repeats_ = 0;
    std::uint8_t unwatched_ = 0;
    std::uint8_t* active_ = &unwatched_;
    std::uint16_t length_ = 0;
    Command command_{};
    Stage stage_ = Stage::idle;
};

}  // namespace hal::ethercat::master
