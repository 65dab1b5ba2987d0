// SPDX-License-Identifier: MIT
#include "execute/runner.hpp"

#include <algorithm>
#include <cerrno>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <ctime>
#include <fstream>
#include <sched.h>
#include <stdexcept>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/syscall.h>
#include <thread>
#include <unistd.h>

#include "hal/read_file.hpp"

namespace hal {
namespace {

#if defined(__SANITIZE_THREAD__)
// the sanitizer keeps more than half a megabyte of its own on each stack
constexpr std::size_t stack_bytes = 1 << 22;
#else
constexpr std::size_t stack_bytes = 1 << 20;
#endif
constexpr std::int64_t calm_ns = 5'000;  // before the deadline nothing but the clock is looked at
// how often a spinning thread looks whether its deadline has moved
constexpr std::int64_t look_ns = 1'000;
constexpr std::size_t signal_stack_bytes = 1 << 16;

void prefault_stack() noexcept {
    volatile char buffer[1 << 19];
    for (std::size_t i = 0; i < sizeof buffer; i += 4096) {
        buffer[i] = 0;
    }
}

std::uint64_t faults_of_this_thread() noexcept {
    rusage usage{};
    getrusage(RUSAGE_THREAD, &usage);
    return static_cast<std::uint64_t>(usage.ru_minflt + usage.ru_majflt);
}

int default_cpu() {
    // the last isolated CPU ("2-3,6"), or the last of all
    std::ifstream file("/sys/devices/system/cpu/isolated");
    std::string text;
    std::getline(file, text);
    if (const auto at = text.find_last_of(",-"); !text.empty()) {
        return std::atoi(text.c_str() + (at == std::string::npos ? 0 : at + 1));
    }
    return static_cast<int>(std::thread::hardware_concurrency()) - 1;
}

bool use_deadline(const CoreOptions& options) noexcept {
    struct {
        std::uint32_t size = 48;
        std::uint32_t policy = SCHED_DEADLINE;
        std::uint64_t flags = 0;
        std::int32_t nice = 0;
        std::uint32_t priority = 0;
        std::uint64_t runtime = 0;
        std::uint64_t deadline = 0;
        std::uint64_t period = 0;
    } attributes;  // struct sched_attr; glibc 2.36 has no declaration of it
    const auto period = static_cast<std::uint64_t>(options.period_ns);
    attributes.runtime =
        options.budget_ns > 0 ? static_cast<std::uint64_t>(options.budget_ns) : period / 2;
    attributes.deadline = attributes.period = period;
    return syscall(SYS_sched_setattr, 0, &attributes, 0) == 0;
}

}  // namespace

Runner::Runner(std::uint32_t id, const CoreOptions& o, ThreadPins pins, FaultBoard& board,
               Timeline& timeline, const std::atomic<bool>& running, bool measure,
               std::int64_t epoch_ns)
    : core(id, o.period_ns, pins, board, timeline, running, measure, o.mark, o.inputs),
      options(o),
      timeline_(timeline),
      epoch_ns_(epoch_ns),
      signal_stack_(std::make_unique<char[]>(signal_stack_bytes)) {
    core.budget_ns = o.budget_ns;
    core.monitor.supervise_ns = o.supervise_ns;
    core.profile_every = o.profile_every;
    wait_.spin_ns = o.spin_ns >= 0 ? std::min(o.spin_ns, o.period_ns * 9 / 10)
                                   : Wait::default_spin_ns(o.period_ns);
}

void Runner::start() {
    pthread_attr_t attributes;
    pthread_attr_init(&attributes);
    pthread_attr_setstacksize(&attributes, stack_bytes);
    const int failed = pthread_create(&thread, &attributes, [](void* self) -> void* {
        static_cast<Runner*>(self)->loop();
        return nullptr;
    }, this);
    pthread_attr_destroy(&attributes);
    if (failed) {
        thread = {};
        throw std::runtime_error(std::string("the system gives no thread: ") +
                                 std::strerror(failed));
    }
    while (!ready_.load(std::memory_order_acquire)) {
        std::this_thread::yield();
    }
    bind();
}

// From outside: a thread that binds itself to the CPU of a busy real-time process does not return
// from that call.
void Runner::bind() noexcept {
    // its affinity must stay the whole root domain
    if (granted.policy == Granted::Policy::deadline) return;
    const bool wants = options.priority > 0 || options.deadline;
    const int cpu = options.cpu >= 0 ? options.cpu : default_cpu();
    cpu_set_t set;
    CPU_ZERO(&set);
    CPU_SET(static_cast<std::size_t>(cpu), &set);
    if ((wants || options.cpu >= 0) && pthread_setaffinity_np(thread, sizeof set, &set) == 0) {
        granted.cpu = cpu;
    }
}

void Runner::ask_to_end() {
    quit_.store(true, std::memory_order_release);
    call();
}

bool Runner::join(std::int64_t timeout_ns) {
    timespec until;
    clock_gettime(CLOCK_REALTIME, &until);
    until = to_timespec(std::int64_t{until.tv_sec} * 1'000'000'000 + until.tv_nsec + timeout_ns);
    return pthread_timedjoin_np(thread, nullptr, &until) == 0;
}

void Runner::call() {
    if (callable()) {
        Wait::ring(bell_);
    }
}

void Runner::set_up() noexcept {
    tid = static_cast<int>(syscall(SYS_gettid));
    FloatModes::defaults().set();  // a thread inherits those of its creator
    pthread_setcancelstate(PTHREAD_CANCEL_DISABLE, nullptr);  // a function may ask for it
    if (!options.name.empty()) {
        pthread_setname_np(pthread_self(), options.name.substr(0, 15).c_str());
    }
    const bool wants = options.priority > 0 || options.deadline;
    if (options.deadline && use_deadline(options)) {
        granted.policy = Granted::Policy::deadline;
    } else {
        sched_param parameters{};
        parameters.sched_priority = options.priority > 0 ? options.priority : 80;
        if (wants && pthread_setschedparam(pthread_self(), SCHED_FIFO, &parameters) == 0) {
            granted.policy = Granted::Policy::fifo;
            granted.priority = parameters.sched_priority;
        }
    }
    core.monitor.max_gap_ns =
        granted.policy == Granted::Policy::other ? options.max_gap_ns : options.max_gap_realtime_ns;
    granted.refused = wants && granted.policy == Granted::Policy::other;
    // Without a real-time policy spinning is charged like work, and the kernel preempts the thread
    // for it.
    if (granted.policy == Granted::Policy::other && options.spin_ns < 0) {
        wait_.spin_ns = 0;
    }
    // else the kernel may wake an ordinary thread 50 us late, to save power
    prctl(PR_SET_TIMERSLACK, 1UL, 0UL, 0UL, 0UL);
    // a crash handler must run even when it is the stack that overflowed
    stack_t other{};
    other.ss_sp = signal_stack_.get();
    other.ss_size = signal_stack_bytes;
    sigaltstack(&other, &signal_stack_before_);
    prefault_stack();
    ready_.store(true, std::memory_order_release);
}

void Runner::place(std::int64_t now_ns) noexcept {
    const std::int64_t from = now_ns - timeline_.shift_ns();
    grid_ns = epoch_ns_ + ((from - epoch_ns_) / options.period_ns + 1) * options.period_ns;
    while (timeline_.due_ns(grid_ns) <= now_ns) {
        grid_ns += options.period_ns;
    }
}

// Until a sleeper has to look whether its deadline has moved: no step is longer than a tenth of the
// time between two of them, so it cannot come before nine tenths of the remaining time. A spin
// window that is longer than that sees the steps anyway.
std::int64_t Runner::safe_until(std::int64_t due) const noexcept {
    if (!timeline_.led()) return due;
    constexpr std::int64_t min_ns = 50'000;
    const std::int64_t margin = (due - monotonic_ns()) / 10;
    return margin <= std::max(wait_.spin_ns, min_ns) ? due : due - margin + wait_.spin_ns;
}

// Sleeps up to the spin window before the next deadline. False: called between two cycles.
bool Runner::sleep() noexcept {
    for (;;) {
        const std::int64_t due = timeline_.due_ns(grid_ns);
        const std::int64_t until = safe_until(due);
        if (callable()) {
            const std::uint32_t heard = bell_.load(std::memory_order_acquire);
            core.service();  // what came before `heard` was read
            if (!wait_.sleep(until, bell_, heard)) return false;
        } else {
            wait_.sleep(until);
        }
        if (until == due) return true;
    }
}

// Spins to the deadline, wherever it is by then.
Runner::Woken Runner::spin() const noexcept {
    for (;;) {
        const Woken woken{timeline_.due_ns(grid_ns), monotonic_ns()};
        if (woken.now_ns >= woken.due_ns) return woken;
        Wait::spin(std::min(woken.due_ns, woken.now_ns + look_ns));
    }
}

// The thread. Positions are epoch + k * period for ever: an overrun skips periods and keeps the
// phase.
void Runner::loop() noexcept {
    set_up();
    place(monotonic_ns());
    core.monitor.begin(monotonic_ns(), timeline_.due_ns(grid_ns));
    const std::int64_t period = options.period_ns;
    std::uint64_t served = 0;
    while (!quit_.load(std::memory_order_acquire)) {
        if (!sleep()) continue;
        core.warm(timeline_.due_ns(grid_ns) - calm_ns);
        Woken woken = spin();
        if (const std::int64_t late = (woken.now_ns - woken.due_ns) / period; late > 0) {
            core.woke_late(woken.due_ns, woken.now_ns);
            core.skip(static_cast<std::uint64_t>(late));
            grid_ns += late * period;
            woken = spin();  // steps made meanwhile may have put this one later
        }
        core.cycle(grid_ns, woken.due_ns, woken.now_ns);
        if (++served == 100) {
            faults_before_.store(faults_of_this_thread(), std::memory_order_release);
        }
        grid_ns += period;
    }
    core.make_safe_at_end();
    sigaltstack(&signal_stack_before_, nullptr);
    ended_.store(true, std::memory_order_release);
}

std::uint64_t Runner::page_faults() const {
    const std::uint64_t before = faults_before_.load(std::memory_order_acquire);
    if (before == 0) return 0;
    constexpr std::size_t max = 4096;
    std::string text;
    if (!read_regular_file("/proc/self/task/" + std::to_string(tid.load()) + "/stat", max, text)) {
        return 0;
    }
    const auto name_end = text.rfind(')');
    if (name_end == std::string::npos) return 0;
    unsigned long long minor = 0;
    unsigned long long major = 0;
    // after the name: state ppid pgrp session tty tpgid flags minflt cminflt majflt
    if (std::sscanf(text.c_str() + name_end + 1, " %*c %*d %*d %*d %*d %*d %*u %llu %*u %llu",
                    &minor, &major) != 2) {
        return 0;
    }
    return minor + major > before ? minor + major - before : 0;
}

}  // namespace hal
