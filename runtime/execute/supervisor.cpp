// SPDX-License-Identifier: MIT
#include "execute/supervisor.hpp"

#include <algorithm>
#include <cerrno>
#include <csignal>
#include <cstring>
#include <ctime>
#include <poll.h>
#include <sched.h>
#include <stdexcept>
#include <sys/eventfd.h>
#include <sys/resource.h>
#include <unistd.h>

#include "base/own_descriptors.hpp"
#include "base/poll_all.hpp"
#include "execute/process_setup.hpp"

namespace hal {
namespace {

constexpr std::int64_t shortest_interval_ns = 2'000'000;
constexpr std::int64_t max_interval_ns = 50'000'000;
constexpr std::int64_t feed_every_ns = 100'000'000;
constexpr std::int64_t usage_interval_ns = 1'000'000'000;

class Hold {
public:
    explicit Hold(pthread_mutex_t& mutex) : mutex_(mutex) { pthread_mutex_lock(&mutex_); }
    ~Hold() { pthread_mutex_unlock(&mutex_); }
    Hold(const Hold&) = delete;

private:
    pthread_mutex_t& mutex_;
};

std::int64_t clock_ns(clockid_t clock) noexcept {
    timespec now{};
    return clock_gettime(clock, &now) == 0 ? now.tv_sec * 1'000'000'000LL + now.tv_nsec : 0;
}

/// Above every thread it watches, as far as the system grants that.
void raise_priority() noexcept {
    sched_param parameters{};
    parameters.sched_priority = sched_get_priority_max(SCHED_FIFO);
    if (pthread_setschedparam(pthread_self(), SCHED_FIFO, &parameters) == 0) return;
    rlimit limit{};
    if (getrlimit(RLIMIT_RTPRIO, &limit) != 0 || limit.rlim_cur < 1) return;
    parameters.sched_priority = static_cast<int>(
        std::min<rlim_t>(limit.rlim_cur, static_cast<rlim_t>(parameters.sched_priority)));
    pthread_setschedparam(pthread_self(), SCHED_FIFO, &parameters);
}

}  // namespace

Supervisor::Supervisor(FaultBoard& board) : board_(board) {
    shared.size = sizeof shared;
    pthread_mutexattr_t attributes;
    pthread_mutexattr_init(&attributes);
    pthread_mutexattr_setprotocol(&attributes, PTHREAD_PRIO_INHERIT);
    if (pthread_mutex_init(&mutex_, &attributes) != 0) {
        pthread_mutex_init(&mutex_, nullptr);
    }
    pthread_mutexattr_destroy(&attributes);
}

Supervisor::~Supervisor() {
    if (started_) {
        quit_ = true;
        eventfd_write(wake_, 1);
        pthread_join(thread_, nullptr);
    }
    if (wake_ >= 0) {
        close_own(wake_);
    }
    pthread_mutex_destroy(&mutex_);
}

void Supervisor::add(Core& core, pthread_t thread, int tid, int priority, int cpu) {
    {
        const Hold hold(mutex_);
        watched_.push_back({.core = &core,
                            .thread = thread,
                            .tid = tid,
                            .priority = priority,
                            .cpu = cpu,
                            .usage = scheduler_usage(tid)});
        core.monitor.expect(monotonic_ns());
        std::stable_sort(watched_.begin(), watched_.end(), [](const Watched& a, const Watched& b) {
            return a.priority > b.priority;
        });
    }
    if (!started_) {
        wake_ = eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK);
        list_descriptor(wake_, "the wake-up of the supervisor");
        looked_ns_ = monotonic_ns();
        sigset_t all, before;  // signals are for the program's own thread; a crash is this one's
        sigfillset(&all);
        for (const int crash : {SIGSEGV, SIGBUS, SIGFPE, SIGILL, SIGABRT, SIGSYS, SIGTRAP}) {
            sigdelset(&all, crash);
        }
        pthread_sigmask(SIG_SETMASK, &all, &before);
        const int failed = pthread_create(&thread_, nullptr, [](void* self) -> void* {
            static_cast<Supervisor*>(self)->work();
            return nullptr;
        }, this);
        pthread_sigmask(SIG_SETMASK, &before, nullptr);
        if (failed) {
            remove(core);
            throw std::runtime_error(std::string("no thread for the supervisor: ") +
                                     std::strerror(failed));
        }
        started_ = true;
    }
    settle_down();
}

void Supervisor::remove(const Core& core) {
    {
        const Hold hold(mutex_);
        std::erase_if(watched_, [&](const Watched& one) { return one.core == &core; });
    }
    settle_down();
}

void Supervisor::fence() { const Hold hold(mutex_); }

Supervisor::Watched* Supervisor::find(const Core& core) {
    const auto at = std::find_if(watched_.begin(), watched_.end(),
                                 [&](const Watched& one) { return one.core == &core; });
    return at == watched_.end() ? nullptr : &*at;
}

void Supervisor::set_priority(const Core& core, int priority) {
    const Hold hold(mutex_);
    Watched* const of = find(core);
    if (!of) return;
    of->priority = priority;
    sched_param parameters{};
    parameters.sched_priority = priority;
    if (!of->demoted) {
        pthread_setschedparam(of->thread, SCHED_FIFO, &parameters);
    }
    std::stable_sort(watched_.begin(), watched_.end(),
                     [](const Watched& a, const Watched& b) { return a.priority > b.priority; });
}

bool Supervisor::reset(Core& core) {
    const Hold hold(mutex_);
    if (core.monitor.hung()) return false;
    core.clear_stop();
    if (Watched* const of = find(core); of && of->demoted) {
        sched_param parameters{};
        parameters.sched_priority = of->priority;
        of->demoted = pthread_setschedparam(of->thread, SCHED_FIFO, &parameters) != 0;
    }
    return true;
}

std::int64_t Supervisor::run_delay_ns(const Core& core) {
    const Hold hold(mutex_);
    const Watched* const of = find(core);
    if (!of || of->usage.taken_ns == 0) return 0;
    return scheduler_usage(of->tid).delay_ns - of->usage.delay_ns;
}

bool Supervisor::demoted(const Core& core) {
    const Hold hold(mutex_);
    const Watched* const of = find(core);
    return of && of->demoted;
}

std::int64_t Supervisor::process_gap_ns(std::int64_t until_ns, std::int64_t silent_ns) const {
    const auto within = [&](std::int64_t end_ns, std::int64_t gap_ns) {
        return end_ns + silent_ns > until_ns && 2 * gap_ns > silent_ns;
    };
    // it may not have looked yet since the process goes on
    const std::int64_t now = monotonic_ns();
    const std::int64_t now_gap = now - looked_ns_ - interval_ns_;
    if (within(now, now_gap)) return now_gap;
    return within(gap_end_ns_, gap_ns_) ? gap_ns_.load() : 0;
}

// Half of the time of the shortest overrun that is a fault, so that each is seen at least once; a
// limit is looked at eight times.
void Supervisor::settle_down() {
    const Hold hold(mutex_);
    std::int64_t interval = max_interval_ns;
    cpu_set_t left;
    if (sched_getaffinity(getpid(), sizeof left, &left) != 0) {
        CPU_ZERO(&left);
    }
    cpu_set_t all = left;
    for (const Watched& one : watched_) {
        interval = std::min(interval, Core::max_overrun * one.core->period_ns() / 2);
        if (const std::int64_t limit = one.core->monitor.supervise_ns; limit > 0) {
            interval = std::min(interval, limit / 8);
        }
        if (one.cpu >= 0) {
            CPU_CLR(static_cast<std::size_t>(one.cpu), &left);
        }
    }
    interval_ns_ = std::max(interval, shortest_interval_ns);
    own_cpu_ = CPU_COUNT(&left) > 0;
    if (started_) {
        pthread_setaffinity_np(thread_, sizeof left, own_cpu_ ? &left : &all);
        eventfd_write(wake_, 1);
    }
}

void Supervisor::work() {
    // functions that set safe values may run here
    release_unused_stack(1 << 18);
    raise_priority();
    const auto asleep = [] { return clock_ns(CLOCK_BOOTTIME) - clock_ns(CLOCK_MONOTONIC); };
    std::int64_t asleep_before = asleep();
    while (!quit_) {
        const std::int64_t interval = interval_ns_;
        const timespec timeout = to_timespec(interval);
        pollfd woken[] = {{wake_, POLLIN, 0}};
        if (poll_all(woken, &timeout) > 0) {
            eventfd_t ignored;
            eventfd_read(wake_, &ignored);
        }
        const Hold hold(mutex_);
        const std::int64_t now = monotonic_ns();
        const std::int64_t gap = now - looked_ns_ - interval;

        const std::int64_t asleep_now = asleep();
        if (gap > max_interval_ns / 2) {
            gap_ns_ = gap;
            gap_end_ns_ = now;
        }
        looked_ns_ = now;
        if (look(now, gap, asleep_now - asleep_before)) {
            __atomic_fetch_add(&shared.progress, 1, __ATOMIC_RELEASE);
            feed_watchdog(now);
        }
        asleep_before = asleep_now;
    }
}

void Supervisor::feed_watchdog(std::int64_t now_ns) {
    const int descriptor = watchdog_;
    if (descriptor < 0 || now_ns - fed_ns_ < feed_every_ns) return;
    fed_ns_ = now_ns;
    [[maybe_unused]] const auto written = ::write(descriptor, "", 1);
}

// Returns whether all supervised threads are within their limits.
bool Supervisor::look(std::int64_t now_ns, std::int64_t gap_ns, std::int64_t suspended_ns) {
    bool well = true;
    for (Watched& one : watched_) {
        Core& core = *one.core;
        core.sample();
        switch (assess(one, now_ns, gap_ns, suspended_ns)) {
        case Health::hung:
            core.stand_in(now_ns, false);  // what it goes on writing does not last
            look_at_late(one);
            if (one.starved && uses_cpu(one)) {
                declare_busy(one, now_ns);
            }
            well = false;
            break;
        case Health::silent:
            declare(one, now_ns, gap_ns, suspended_ns);
            well = false;
            break;
        case Health::in_gap:
            core.monitor.excuse(now_ns);  // the thread counts the gap when it has the CPU again
            break;
        case Health::late: look_at_late(one); break;
        case Health::in_time: begin_anew(one, now_ns); break;
        case Health::unsupervised:
        case Health::behind_hog: break;
        }
    }
    return well;
}

Supervisor::Health Supervisor::assess(const Watched& watched, std::int64_t now_ns,
                                      std::int64_t gap_ns, std::int64_t suspended_ns) const {
    const CycleMonitor& monitor = watched.core->monitor;
    if (monitor.hung()) return Health::hung;
    const std::int64_t limit_ns = monitor.supervise_ns;
    if (limit_ns == 0) return Health::unsupervised;
    if (suspended_ns > limit_ns) return Health::silent;
    const std::int64_t silent_ns = now_ns - monitor.overdue_since_ns();
    if (silent_ns > limit_ns) {
        if (behind_hog(watched, now_ns)) return Health::behind_hog;
        if (in_gap(watched, now_ns, gap_ns)) return Health::in_gap;
        return Health::silent;
    }
    return silent_ns > limit_ns / 4 ? Health::late : Health::in_time;
}

void Supervisor::begin_anew(Watched& watched, std::int64_t now_ns) noexcept {
    watched.mark = {};
    watched.blocked = false;
    if (now_ns - watched.usage.taken_ns > usage_interval_ns) {
        watched.usage = scheduler_usage(watched.tid);
    }
}

// A thread of higher priority occupies its CPU and is about to be declared hung itself, which frees
// the CPU.
bool Supervisor::behind_hog(const Watched& watched, std::int64_t now_ns) const {
    return watched.cpu >= 0 &&
           std::any_of(watched_.begin(), watched_.end(), [&](const Watched& other) {
        const std::int64_t limit = other.core->monitor.supervise_ns;
        const std::int64_t since = other.core->monitor.busy_since_ns();
        return other.cpu == watched.cpu && other.priority > watched.priority && limit > 0 &&
               since != 0 && !other.core->monitor.hung() && 2 * (now_ns - since) > limit &&
               limit - (now_ns - since) < watched.core->monitor.supervise_ns / 4;
    });
}

// The thread tolerates gaps, and has no CPU: as the whole process had none, or because others use
// it.
bool Supervisor::in_gap(const Watched& watched, std::int64_t now_ns, std::int64_t gap_ns) const {
    const Core& core = *watched.core;
    const std::int64_t silent_ns = now_ns - core.monitor.finished_ns() - core.period_ns();
    if (core.monitor.max_gap_ns == 0 || silent_ns > core.monitor.max_gap_ns) return false;
    if (2 * gap_ns > silent_ns) return true;
    Stall found;
    find_cause(watched, found);
    return found.cause == Stall::Cause::starved;
}

namespace {

/// Describes a thread that has not finished a cycle, before its cause is known.
Stall stall_of(const Core& core, int cpu, std::int64_t now_ns) {
    Stall stall;
    stall.thread = core.id();
    stall.function = core.hung_function();
    stall.cycle = core.monitor.cycles();
    stall.limit_ns = core.monitor.supervise_ns;
    stall.silent_ns = now_ns - core.monitor.finished_ns();
    stall.time_ns = now_ns;
    stall.cpu = cpu;
    return stall;
}

}  // namespace

void Supervisor::declare(Watched& watched, std::int64_t now_ns, std::int64_t gap_ns,
                         std::int64_t suspended_ns) {
    Core& core = *watched.core;
    Stall stall = stall_of(core, watched.cpu, now_ns);
    if (!core.declare_hung()) return;
    watched.starved = false;
    core.stand_in(now_ns, true);  // outputs first
    if (suspended_ns > stall.limit_ns) {
        stall.cause = Stall::Cause::suspended;
        stall.silent_ns = suspended_ns;
    } else if (2 * gap_ns > stall.silent_ns) {
        stall.cause = Stall::Cause::process;
        stall.silent_ns = gap_ns;
    } else {
        find_cause(watched, stall);
        name_starved(watched, stall, now_ns);  // before they run
        watched.starved = stall.cause == Stall::Cause::starved;
        if (!watched.starved) {
            demote(watched, stall);
        }
    }
    queue(stall);
}

void Supervisor::demote(Watched& watched, Stall& stall) noexcept {
    if (watched.priority == 0 || watched.demoted) return;
    const sched_param ordinary{};
    stall.demoted = watched.demoted =
        pthread_setschedparam(watched.thread, SCHED_OTHER, &ordinary) == 0;
}

void Supervisor::queue(const Stall& stall) noexcept {
    board_.count({HAL_FAULT_SILENT_THREAD, stall.function, stall.cycle, stall.time_ns,
                  static_cast<double>(stall.silent_ns), nullptr, nullptr},
                 stall.thread);
    stalls_.push(stall);
}

// A thread that seemed to be starved has got CPU time since, and its cycle does not end: its
// function is the cause after all.
void Supervisor::declare_busy(Watched& watched, std::int64_t now_ns) {
    const Core& core = *watched.core;
    Stall stall = stall_of(core, watched.cpu, now_ns);
    watched.starved = false;
    demote(watched, stall);
    queue(stall);
}

// As much CPU time since it was first seen late as a whole cycle may take.
bool Supervisor::uses_cpu(const Watched& watched) noexcept {
    const SchedulerUsage now = scheduler_usage(watched.tid);
    return watched.mark.taken_ns != 0 &&
           now.cpu_ns - watched.mark.cpu_ns > watched.core->monitor.supervise_ns;
}

namespace {

bool is_blocked(const KernelView& view) noexcept {
    return view.state == 'S' || view.state == 'D' || view.state == 'I';
}

}  // namespace

// A thread that sleeps and wakes up in its function is ready to run at times, too.
void Supervisor::look_at_late(Watched& watched) noexcept {
    if (watched.mark.taken_ns == 0) {
        watched.mark = scheduler_usage(watched.tid);
        watched.blocked = false;
    }
    if (!watched.blocked) {
        watched.blocked = is_blocked(kernel_view(watched.tid));
    }
}

// Less than a tenth since it was first seen late. A function that loops for ever on a busy host has
// used more than its limit soon.
bool Supervisor::got_no_cpu(const Watched& watched) noexcept {
    const SchedulerUsage now = scheduler_usage(watched.tid);
    if (watched.mark.taken_ns == 0 || now.taken_ns == 0) return false;
    const std::int64_t used_ns = now.cpu_ns - watched.mark.cpu_ns;
    const std::int64_t since_ns = now.taken_ns - watched.mark.taken_ns;
    return used_ns < std::min<std::int64_t>(since_ns, watched.core->monitor.supervise_ns) / 10;
}

bool Supervisor::starved(const Core& core) {
    const Hold hold(mutex_);
    const Watched* const of = find(core);
    return of && !of->blocked && kernel_view(of->tid).state == 'R' && got_no_cpu(*of);
}

namespace {

bool has_ended(int tid) noexcept { return tgkill(getpid(), tid, 0) != 0 && errno == ESRCH; }

}  // namespace

bool Supervisor::ended(const Core& core) {
    const Hold hold(mutex_);
    const Watched* const of = find(core);
    return of && has_ended(of->tid);
}

/// Returns a thread of the machine that goes before this one on its CPU; `is_busy`: whose cycle is
/// under way. nullptr: there is no such thread.
const Supervisor::Watched* Supervisor::rival_of(const Watched& watched, bool is_busy) const {
    for (const Watched& other : watched_) {
        const bool goes_before =
            &other != &watched && other.cpu == watched.cpu && other.priority > watched.priority;
        if (goes_before && (!is_busy || other.core->monitor.busy_since_ns() != 0)) return &other;
    }
    return nullptr;
}

const Core* Supervisor::rival_of(const Core& core, bool is_busy) {
    const Hold hold(mutex_);
    const Watched* const of = find(core);
    const Watched* const rival = of ? rival_of(*of, is_busy) : nullptr;
    return rival ? rival->core : nullptr;
}

void Supervisor::find_cause(const Watched& watched, Stall& stall) const {
    const KernelView seen = kernel_view(watched.tid);
    stall.tracer = seen.tracer;
    if (has_ended(watched.tid)) {
        stall.cause = Stall::Cause::ended;
    } else if (seen.state == 't' || seen.state == 'T') {
        stall.cause = Stall::Cause::stopped;
    } else if (is_blocked(seen) || (watched.blocked && got_no_cpu(watched))) {
        stall.cause = Stall::Cause::waiting;
    } else if (got_no_cpu(watched)) {
        stall.cause = Stall::Cause::starved;
        if (const Watched* const other = rival_of(watched, true)) {
            stall.occupant = other->core->id();
        }
    } else {
        stall.cause = Stall::Cause::busy;
    }
}

// The threads that got no CPU time beside it; they have as long again to go on now that the CPU is
// free.
void Supervisor::name_starved(Watched& hog, Stall& stall, std::int64_t now_ns) {
    if (stall.cause != Stall::Cause::busy || hog.cpu < 0 || hog.priority == 0) return;
    for (Watched& other : watched_) {
        if (&other == &hog || other.cpu != hog.cpu || other.priority >= hog.priority ||
            other.core->monitor.hung()) {
            continue;
        }
        if (now_ns - other.core->monitor.finished_ns() <
            2 * other.core->period_ns() + shortest_interval_ns) {
            continue;
        }
        if (stall.starved_count < Stall::max_starved) {
            stall.starved[stall.starved_count++] = other.core->id();
        }
        other.core->monitor.excuse(now_ns);
    }
}

}  // namespace hal
