// SPDX-License-Identifier: MIT
#pragma once

#include <deque>
#include <vector>

#include "link/can.hpp"

namespace hal::guardian {

/// A CAN interface whose driver does what a test asks for. What it has accepted waits in `waiting`,
/// urgent frames first, until transmit() puts it on the bus.
class FakeLink final : public can::Link {
public:
    /// What a test sets and reads while the transmitter owns the link.
    struct State {
        bool has_echo = true;
        bool has_priorities = false;
        bool is_full = false;  ///< ENOBUFS: frames stay in the queue of the link
        bool is_rejected = false;  ///< the driver drops frames
        can::Sent answer = can::Sent::queued;
        can::State controller = can::State::active;
        std::deque<can::Frame> queue;  ///< of the link
        std::deque<can::Frame> waiting;  ///< in the queue of the interface
        std::vector<can::Frame> on_bus;
        std::deque<can::Frame> received;
        std::size_t urgent = 0;  ///< of `waiting`
        bool is_urgent = false;
        std::uint64_t dropped = 0;

        /// The controller sends `count` frames.
        void transmit(std::size_t count) {
            for (; count > 0 && !waiting.empty(); --count) {
                can::Frame frame = waiting.front();
                waiting.pop_front();
                urgent -= urgent > 0 ? 1 : 0;
                on_bus.push_back(frame);
                if (has_echo) {
                    frame.own = true;
                    received.push_back(frame);
                }
            }
        }
    };

    explicit FakeLink(State& state) : state_(state) {
        description_.address = "can:fake0";
        description_.transport = "fake";
        description_.has_echo = state.has_echo;
    }
    explicit FakeLink(State& state, bool listen_only) : FakeLink(state) {
        description_.listen_only = listen_only;
    }

    can::Sent send(const can::Frame& frame, std::int64_t) noexcept override {
        if (state_.answer != can::Sent::queued) {
            ++state_.dropped;
            return state_.answer;
        }
        state_.queue.push_back(frame);
        return can::Sent::queued;
    }
    void flush(std::int64_t) noexcept override {
        if (state_.is_full) return;
        for (; !state_.queue.empty(); state_.queue.pop_front()) {
            if (state_.is_rejected) {
                ++state_.dropped;
            } else if (state_.is_urgent) {
                const auto at = static_cast<std::ptrdiff_t>(state_.urgent++);
                state_.waiting.insert(state_.waiting.begin() + at, state_.queue.front());
            } else {
                state_.waiting.push_back(state_.queue.front());
            }
        }
    }
    void discard_queued() noexcept override {
        state_.dropped += state_.queue.size();
        state_.queue.clear();
    }
    bool set_urgent(bool is_urgent) noexcept override {
        state_.is_urgent = is_urgent && state_.has_priorities;
        return state_.has_priorities;
    }
    std::size_t receive(std::span<can::Frame> frames, std::int64_t) noexcept override {
        std::size_t count = 0;
        for (; count < frames.size() && !state_.received.empty(); state_.received.pop_front()) {
            frames[count++] = state_.received.front();
        }
        return count;
    }
    can::Statistics statistics() const noexcept override {
        can::Statistics statistics;
        statistics.queued = static_cast<std::uint32_t>(state_.queue.size());
        statistics.dropped = state_.dropped;
        return statistics;
    }
    can::State state() const noexcept override { return state_.controller; }
    bool set_filters(std::span<const can::Filter>) override { return true; }
    const can::Description& description() const noexcept override { return description_; }
    bool wait(std::int64_t) override { return false; }

private:
    State& state_;
    can::Description description_;
};

}  // namespace hal::guardian
