// SPDX-License-Identifier: MIT
// The thread of the process that writes to DDS; never a real-time one.
#include <pthread.h>
#include <sched.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <time.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <condition_variable>
#include <cstdio>
#include <mutex>
#include <stdexcept>
#include <utility>
#include <vector>

#include "dds/engine.hpp"
#include "participant.hpp"

namespace hal::dds {
namespace {

using Clock = std::chrono::steady_clock;  // CLOCK_MONOTONIC

class Pump {
public:
    void add(Served& s) {
        const std::lock_guard lock(mutex_);
        entries_.push_back({&s, 0});
        if (!running_) {
            begin();
        }
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
    /// Returns a clock that continues while the machine sleeps.
    static std::int64_t awake_ns() noexcept {
        timespec t{};
        clock_gettime(CLOCK_BOOTTIME, &t);
        return std::int64_t{t.tv_sec} * 1'000'000'000 + t.tv_nsec;
    }

    struct Entry {
        Served* served;
        std::int64_t next;
    };

    void begin() {
        pthread_attr_t attributes;
        pthread_attr_init(&attributes);
        // the caller may be a real-time thread
        pthread_attr_setinheritsched(&attributes, PTHREAD_EXPLICIT_SCHED);
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
            throw std::runtime_error("cannot start the DDS thread");
        }
        running_ = true;
        pthread_setname_np(thread_, "hal-dds");
    }

    void run() {
        // the highest priority of an ordinary thread, if permitted
        setpriority(PRIO_PROCESS, static_cast<id_t>(gettid()), -10);
        prctl(PR_SET_TIMERSLACK, 1UL);  // the default of 50 us would delay samples
        std::unique_lock lock(mutex_);
        for (last_ns_ = awake_ns(); running_;) {
            check_for_suspension();
            engine_log().flush();
            const auto now = Clock::now().time_since_epoch();
            std::int64_t next = now.count() + 1'000'000'000;
            for (Entry& e : entries_) {
                if (e.next <= now.count()) {
                    e.next = e.served->serve(now.count());
                }
                next = std::min(next, e.next);
            }
            if (next > now.count()) {
                wake_.wait_until(lock, Clock::time_point(Clock::duration(next)));
            }
        }
    }

    /// The thread wakes at least every second. After a longer gap, others may have dropped this
    /// process.
    void check_for_suspension() {
        const std::int64_t now = awake_ns();
        const std::int64_t gone = now - std::exchange(last_ns_, now);
        if (gone > participant_lease_ns) {
            char text[128];
            std::snprintf(text, sizeof text,
                          "this process was suspended for %.1f s and may have been dropped by "
                          "others; announcing it again",
                          static_cast<double>(gone) * 1e-9);
            engine_log().print(text);
            anew_at_ns_ = now;
        }
        if (now < anew_at_ns_) return;
        const bool known = announce_anew();
        last_ns_ = awake_ns();
        anew_at_ns_ = known ? INT64_MAX : last_ns_ + 1'000'000'000;
    }

    // of everything; held while served, so that remove() waits for it
    std::mutex mutex_;
    std::condition_variable wake_;
    std::vector<Entry> entries_;
    pthread_t thread_{};
    bool running_ = false;
    std::int64_t last_ns_ = 0;
    std::int64_t anew_at_ns_ = INT64_MAX;  // of the thread
};

Pump& pump() {
    static Pump& it = *new Pump;  // never destroyed: components may end after static objects
    return it;
}

}  // namespace

void serve(Served& s) { pump().add(s); }
void withdraw(Served& s) noexcept { pump().remove(s); }

}  // namespace hal::dds
