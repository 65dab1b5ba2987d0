// SPDX-License-Identifier: MIT
// The one thread of the process that writes to DDS: an ordinary one, whoever started it.
#include <pthread.h>
#include <sched.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <condition_variable>
#include <mutex>
#include <stdexcept>
#include <vector>

#include "dds/engine.hpp"

namespace hal::dds {
namespace {

using Clock = std::chrono::steady_clock;  // CLOCK_MONOTONIC

class Pump {
public:
    void add(Served& s) {
        const std::lock_guard lock(mutex_);
        entries_.push_back({&s, 0});
        if (!running_) begin();
        wake_.notify_one();
    }
    void remove(Served& s) noexcept {
        {
            std::unique_lock lock(mutex_);
            std::erase_if(entries_, [&s](const Entry& e) { return e.served == &s; });
            if (!entries_.empty() || !running_) return;
            running_ = false;
            wake_.notify_one();
        }
        pthread_join(thread_, nullptr);
    }

private:
    struct Entry {
        Served*      served;
        std::int64_t next;
    };

    void begin() {
        pthread_attr_t attributes;
        pthread_attr_init(&attributes);
        pthread_attr_setinheritsched(&attributes, PTHREAD_EXPLICIT_SCHED);  // the caller may be a real-time thread's
        pthread_attr_setschedpolicy(&attributes, SCHED_OTHER);
        const sched_param none{};
        pthread_attr_setschedparam(&attributes, &none);
        pthread_attr_setstacksize(&attributes, 1 << 20);
        const int error = pthread_create(&thread_, &attributes, [](void* self) -> void* {
            static_cast<Pump*>(self)->run();
            return nullptr;
        }, this);
        pthread_attr_destroy(&attributes);
        if (error != 0) {
            entries_.clear();
            throw std::runtime_error("no thread for DDS could be started");
        }
        running_ = true;
        pthread_setname_np(thread_, "hal-dds");
    }

    void run() {
        setpriority(PRIO_PROCESS, static_cast<id_t>(gettid()), -10);  // as urgent as an ordinary thread may be, where that is allowed
        prctl(PR_SET_TIMERSLACK, 1UL);  // it is woken beside a cycle, which is not to wait 50 us for it
        std::unique_lock lock(mutex_);
        while (running_) {
            const auto   now = Clock::now().time_since_epoch();
            std::int64_t next = now.count() + 1'000'000'000;
            for (Entry& e : entries_) {
                if (e.next <= now.count()) e.next = e.served->serve(now.count());
                next = std::min(next, e.next);
            }
            if (next > now.count()) wake_.wait_until(lock, Clock::time_point(Clock::duration(next)));
        }
    }

    std::mutex              mutex_;  // of everything; held while served, so that remove() waits for it
    std::condition_variable wake_;
    std::vector<Entry>      entries_;
    pthread_t               thread_{};
    bool                    running_ = false;
};

Pump& pump() {
    static Pump& it = *new Pump;  // never destroyed: components may end after static objects
    return it;
}

}  // namespace

void serve(Served& s) { pump().add(s); }
void withdraw(Served& s) noexcept { pump().remove(s); }

}  // namespace hal::dds
