// SPDX-License-Identifier: MIT
// What happened in a cycle, said in sentences on standard error: numbers out of the cycle, words outside of it.
#pragma once

#include <chrono>
#include <cstdio>
#include <functional>
#include <string>
#include <thread>

#include "hal/background.hpp"
#include "hal/queue.hpp"

namespace hal {

/// `Event` must be trivially copyable. One cycle tells, one thread words it; on the virtual clock it is said at the end of the instant, so
/// that the sentences of several instances come in the same order every time.
template <class Event>
class Reporter {
public:
    using Words = std::function<std::string(const Event&)>;  ///< the sentence; empty: nothing is said

    /// Sentences are "INSTANCE: SENTENCE". [setup]
    Reporter(std::string instance, Words words, std::size_t room = 256)
        : instance_(std::move(instance)), words_(std::move(words)), events_(room) {}
    ~Reporter() { stop(); }

    void start() { background_.start(); }  // [setup] in the component's start()
    /// What was told by now is still said. [setup]
    void stop() noexcept {
        background_.stop();
        say();
    }
    /// What finds no room is not said. [realtime]
    void tell(const Event& event) noexcept { events_.push(event); }

private:
    void say() noexcept {
        for (Event e; events_.pop(e);)
            if (const std::string sentence = words_(e); !sentence.empty()) std::fputs((instance_ + ": " + sentence + "\n").c_str(), stderr);
    }
    void turn(bool may_wait) noexcept {
        say();
        if (may_wait) std::this_thread::sleep_for(std::chrono::milliseconds(20));
    }

    const std::string instance_;
    const Words       words_;
    Queue<Event>      events_;
    Background        background_{[this](std::int64_t, bool may_wait) { turn(may_wait); }};  // the last: it uses the others
};

}  // namespace hal
