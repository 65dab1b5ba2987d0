// SPDX-License-Identifier: MIT
// What happened in a cycle, in sentences on standard error: numbers out of the cycle, words outside
// of it.
#pragma once

#include <atomic>
#include <chrono>
#include <functional>
#include <string>
#include <thread>

#include "hal/background.hpp"
#include "hal/message_log.hpp"
#include "hal/queue.hpp"

namespace hal {

/// `Event` must be trivially copyable. A cycle queues events, one thread formats them; on the
/// virtual clock they are printed at the end of the instant, so that the sentences of several
/// instances come in the same order every time. The rate is limited as MessageLog states.
template <class Event>
class Reporter {
public:
    /// the sentence; empty: nothing is printed
    using Words = std::function<std::string(const Event&)>;
    /// what it is about
    using Subject = std::function<MessageSubject(const Event&, const std::string& sentence)>;

    /// Sentences are "INSTANCE: SENTENCE". Without `subject`, sentences that differ only in their
    /// numbers are about the same. [setup]
    Reporter(const std::string& instance, Words format, std::size_t capacity = 256,
             Subject subject = {})
        : format_(std::move(format)),
          subject_(std::move(subject)),
          events_(capacity),
          log_(instance) {}
    ~Reporter() { stop(); }

    /// In the component's start(). [setup]
    void start() {
        log_.journal(extension<hal_messages>(HAL_MESSAGES));
        background_.start();
    }
    /// What was queued by now is still printed. [setup]
    void stop() noexcept {
        background_.stop();
        print(now_ns_);
        log_.close();
        log_.journal(nullptr);
    }
    /// Queues an event; if the queue is full, only counts it. [realtime]
    void tell(const Event& event) noexcept {
        if (!events_.push(event)) {
            lost_.fetch_add(1, std::memory_order_relaxed);
        }
    }

private:
    void print(std::int64_t now_ns) noexcept {
        now_ns_ = now_ns;
        for (Event e; events_.pop(e);) {
            if (const std::string sentence = format_(e); !sentence.empty()) {
                log_.print(subject_ ? subject_(e, sentence)
                                    : MessageSubject{MessageLog::without_numbers(sentence)},
                           sentence, now_ns);
            }
        }
        if (const auto lost = lost_.exchange(0, std::memory_order_relaxed); lost != 0) {
            log_.print(std::to_string(lost) + (lost == 1 ? " message was" : " messages were") +
                           " lost: the queue for them was full",
                       now_ns);
        }
        log_.flush(now_ns);
    }
    void turn(std::int64_t now_ns, bool may_wait) noexcept {
        print(now_ns);
        if (may_wait) {
            std::this_thread::sleep_for(std::chrono::milliseconds(20));
        }
    }

    const Words format_;
    const Subject subject_;
    Queue<Event> events_;
    std::atomic<std::uint64_t> lost_{0};  // written by the cycle
    std::int64_t now_ns_ = 0;
    MessageLog log_;
    // the last: it uses the others
    Background background_{[this](std::int64_t now, bool may_wait) { turn(now, may_wait); }};
};

}  // namespace hal
