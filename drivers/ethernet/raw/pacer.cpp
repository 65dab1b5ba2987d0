// SPDX-License-Identifier: MIT
#include "pacer.hpp"

#include <linux/futex.h>
#include <pthread.h>
#include <sched.h>
#include <sys/prctl.h>
#include <sys/syscall.h>

#include <algorithm>
#include <cstdlib>
#include <cstring>
#include <fstream>

namespace hal::ethernet::rawether {

namespace {

// on 32-bit machines: the call that takes seconds of 64 bits, as this build has them
#ifdef SYS_futex_time64
constexpr long futex_call = SYS_futex_time64;
#else
constexpr long futex_call = SYS_futex;
#endif

constexpr std::int64_t wake_up_ns = 30'000;  // latency of waking a thread on another CPU
// before a frame's time; a frame queued later leaves after it, even if due earlier
constexpr std::int64_t nothing_new_ns = 10'000;

}  // namespace

bool SpinBudget::is_needed() {
    std::ifstream file("/proc/sys/kernel/sched_rt_runtime_us");
    long runtime = 0;
    return !(file >> runtime) || runtime >= 0;
}

/// Returns how long before the time of a frame the pacer spins.
static std::int64_t spin_ns_of(const Options& options) {
    if (options.policy == Policy::block) return 0;
    return options.policy == Policy::spin ? INT64_MAX : options.spin_ns;
}

Pacer::Pacer(Sender& sender, const Options& options)
    : sender_(sender),
      spin_ns_(spin_ns_of(options)),
      places_(hal::Queue<std::uint32_t>(options.send_capacity).capacity()),
      unused_(options.send_capacity),
      outgoing_(options.send_capacity),

      budget_(SpinBudget::is_needed()) {
    for (std::uint32_t i = 0; i < places_.size(); ++i) {
        unused_.push(i);
    }
    waiting_.reserve(places_.size());
    thread_ = std::thread([this, options] {
        prepare(options);
        ready_ = true;
        ready_.notify_one();
        run();
    });
    ready_.wait(false);
}

Pacer::~Pacer() {
    ending_ = true;
    ring();
    thread_.join();
}

void Pacer::prepare(const Options& options) {
    pthread_setname_np(pthread_self(), "pacer");
    prctl(PR_SET_TIMERSLACK, 1UL);
    if (options.pacer_cpu >= 0) {
        cpu_set_t cpus;
        CPU_ZERO(&cpus);
        CPU_SET(static_cast<std::size_t>(options.pacer_cpu), &cpus);
        if (sched_setaffinity(0, sizeof cpus, &cpus) != 0) {
            remark_ = "cannot run the pacer on CPU " + std::to_string(options.pacer_cpu);
        }
    }
    sched_param wanted{};
    wanted.sched_priority = options.pacer_priority;
    if (pthread_setschedparam(pthread_self(), SCHED_FIFO, &wanted) != 0) {
        remark_ =
            "the pacer runs without real-time priority: frames may leave late; to grant it, see: "
            "hal doctor";
    }
}

Sent Pacer::send(std::span<const std::uint8_t> frame, const Launch& launch,
                 std::int64_t now_ns) noexcept {
    const auto asleep_until = asleep_until_.load(std::memory_order_relaxed);
    if (launch.at_ns - now_ns < wake_up_ns && asleep_until > launch.at_ns) {
        sender_.await(launch.at_ns);
        return sender_.leave(frame, launch);
    }
    const std::uint32_t* unused = unused_.front();
    if (unused == nullptr) return sender_.drop(Sent::full);
    const auto number = *unused;
    unused_.drop();
    Place& slot = places_[number];
    std::memcpy(slot.bytes.data(), frame.data(), slot.length = frame.size());
    slot.launch = launch;
    outgoing_.push(number);  // the queue is as large as the pool
    const auto wanted = spin_ns_ < launch.at_ns ? launch.at_ns - spin_ns_ : 0;
    if (wanted < asleep_until_.fetch_add(0, std::memory_order_acq_rel)) {
        ring();
    }
    return Sent::queued;
}

void Pacer::ring() noexcept {
    bell_.fetch_add(1, std::memory_order_release);
    syscall(futex_call, reinterpret_cast<std::uint32_t*>(&bell_), FUTEX_WAKE_PRIVATE, 1, nullptr,
            nullptr, 0);
}

/// Sleeps until the time or the bell.
void Pacer::sleep(std::int64_t until_ns) noexcept {
    const auto bell = bell_.load(std::memory_order_acquire);
    asleep_until_.exchange(until_ns, std::memory_order_acq_rel);
    if (outgoing_.front() == nullptr && !ending_.load()) {
        const timespec t = link::to_timespec(until_ns);
        // FUTEX_WAIT_BITSET takes an absolute time of CLOCK_MONOTONIC (futex(2)).
        syscall(futex_call, reinterpret_cast<std::uint32_t*>(&bell_), FUTEX_WAIT_BITSET_PRIVATE,
                bell, until_ns == INT64_MAX ? nullptr : &t, nullptr, FUTEX_BITSET_MATCH_ANY);
    }
    asleep_until_.exchange(INT64_MIN, std::memory_order_acq_rel);
}

bool Pacer::collect() noexcept {
    const std::uint32_t* number = outgoing_.front();
    if (number == nullptr) return false;
    for (; number != nullptr; outgoing_.drop(), number = outgoing_.front()) {
        waiting_.push_back({places_[*number].launch.at_ns, sequence_++, *number});
        std::push_heap(waiting_.begin(), waiting_.end());
    }
    return true;
}

/// Spins until the time, within the budget. Returns false to check everything again.
bool Pacer::look_until(std::int64_t time_ns) noexcept {
    constexpr std::int64_t while_ns = 50'000;
    const auto began = link::monotonic_ns();
    auto now = began;
    for (; now < time_ns && now - began < while_ns; now = link::monotonic_ns()) {
        if (outgoing_.front() != nullptr || ending_.load(std::memory_order_relaxed)) break;
        pause_processor();
    }
    if (!budget_.spent(began, now) && now < time_ns) {
        sleep(std::min(now + SpinBudget::rest_ns, time_ns));
    }
    return now >= time_ns;
}

void Pacer::run() noexcept {
    while (!ending_.load(std::memory_order_relaxed)) {
        collect();
        if (waiting_.empty()) {
            sleep(INT64_MAX);
            continue;
        }
        const Waiting next = waiting_.front();
        if (next.at_ns - link::monotonic_ns() > spin_ns_) {
            sleep(next.at_ns - spin_ns_);
            continue;
        }
        if (!look_until(next.at_ns - nothing_new_ns)) continue;
        std::pop_heap(waiting_.begin(), waiting_.end());
        waiting_.pop_back();
        const Place& slot = places_[next.slot];
        const auto began = link::monotonic_ns();
        sender_.await(next.at_ns);
        (void)budget_.spent(began, link::monotonic_ns());
        sender_.leave({slot.bytes.data(), slot.length}, slot.launch);
        unused_.push(next.slot);
    }
}

}  // namespace hal::ethernet::rawether
