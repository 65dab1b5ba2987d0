// SPDX-License-Identifier: MIT
// What happened in a cycle, said in sentences on standard error: numbers out of the cycle, words in a thread of their own.
#pragma once

#include <atomic>
#include <chrono>
#include <cstdio>
#include <functional>
#include <string>
#include <thread>

#include "hal/queue.hpp"

namespace hal {

/// `Event` must be trivially copyable. One cycle tells, one thread words it.
template <class Event>
class Reporter {
public:
    using Words = std::function<std::string(const Event&)>;  ///< the sentence; empty: nothing is said

    /// Sentences are "INSTANCE: SENTENCE". [setup]
    Reporter(std::string instance, Words words, std::size_t room = 256)
        : instance_(std::move(instance)), words_(std::move(words)), events_(room) {}
    ~Reporter() { stop(); }

    void start() {  // [setup]
        ended_.store(false);
        thread_ = std::thread([this] { run(); });
    }
    /// What was told by now is still said. [setup]
    void stop() noexcept {
        ended_.store(true);
        if (thread_.joinable()) thread_.join();
    }
    /// What finds no room is not said. [realtime]
    void tell(const Event& event) noexcept { events_.push(event); }

private:
    void run() {
        for (bool last = false; !last;) {
            last = ended_.load();  // looked at before the queue, so that what came before the end is still said
            for (Event e; events_.pop(e);)
                if (const std::string sentence = words_(e); !sentence.empty()) std::fputs((instance_ + ": " + sentence + "\n").c_str(), stderr);
            if (!last) std::this_thread::sleep_for(std::chrono::milliseconds(20));
        }
    }

    const std::string instance_;
    const Words       words_;
    Queue<Event>      events_;
    std::atomic<bool> ended_{false};
    std::thread       thread_;
};

}  // namespace hal
