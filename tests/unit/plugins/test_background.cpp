// SPDX-License-Identifier: MIT
// Work outside of the cycle: `answer` is what the helper made of `question`.
#include <chrono>
#include <string>
#include <thread>

#include "hal/background.hpp"
#include "hal/component.hpp"
#include "hal/queue.hpp"

struct TestBackground : hal::Component {
    using Component::Component;
    hal::In<double> question{*this, "question", "goes to the helper in each cycle"};
    hal::Out<double> answer{*this, "answer", "twice the question"};
    hal::Out<std::int64_t> at{*this, "at", "when the helper answered", {.unit = "ns"}};
    hal::Out<std::uint32_t> turns{*this, "turns", "pieces of work so far"};
    hal::Out<bool> waits{*this, "waits", "the helper has a thread of its own"};
    hal::Function run{*this, "", &TestBackground::cycle, "asks and takes an answer"};

    void start() { background_.start(); }
    void stop() noexcept { background_.stop(); }
    void cycle(hal::Cycle) noexcept {
        questions_.put(question);
        const Answer& a = answers_.get();
        answer = a.value;
        at = a.at;
        turns = a.turns;
        waits = a.waits;
    }

private:
    struct Answer {
        double value = 0;
        std::int64_t at = -1;
        std::uint32_t turns = 0;
        bool waits = false;
    };
    void turn(std::int64_t now, bool may_wait) {
        const std::string memory(1000, 'm');  // which a cycle may not take
        ++made_.turns;
        made_.value = 2 * questions_.get() * (memory.size() == 1000);
        made_.at = now;
        made_.waits = may_wait;
        answers_.put(made_);
        if (may_wait) {
            std::this_thread::sleep_for(std::chrono::milliseconds(1));
        }
    }
    Answer made_;  // of the helper
    hal::Mailbox<double> questions_;
    hal::Mailbox<Answer> answers_;
    hal::Background background_{[this](std::int64_t now, bool may_wait) { turn(now, may_wait); }};
};

HAL_COMPONENT(TestBackground, "test-background", "Work outside of the cycle")
