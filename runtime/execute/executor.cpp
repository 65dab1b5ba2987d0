// SPDX-License-Identifier: MIT
#include "execute/executor.hpp"

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <ctime>
#include <fcntl.h>
#include <fstream>
#include <limits>
#include <linux/capability.h>
#include <stdexcept>
#include <pthread.h>
#include <sched.h>
#include <sys/mman.h>
#include <sys/resource.h>
#include <sys/syscall.h>
#include <thread>
#include <unistd.h>

#include "base/keep.hpp"
#include "execute/wait.hpp"

namespace hal {
namespace {

#if defined(__SANITIZE_THREAD__)
constexpr std::size_t stack_bytes = 1 << 22;  // the sanitizer keeps more than half a megabyte of its own on each stack
#else
constexpr std::size_t stack_bytes = 1 << 20;
#endif
constexpr std::int64_t calm_ns = 5'000;  // before the deadline nothing but the clock is looked at
constexpr std::int64_t look_ns = 1'000;  // how often a spinning thread looks whether its deadline has moved
constexpr std::size_t signal_stack_bytes = 1 << 16;

void prefault_stack() noexcept {
    volatile char room[1 << 19];
    for (std::size_t i = 0; i < sizeof room; i += 4096) room[i] = 0;
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
    if (const auto at = text.find_last_of(",-"); !text.empty()) return std::atoi(text.c_str() + (at == std::string::npos ? 0 : at + 1));
    return static_cast<int>(std::thread::hardware_concurrency()) - 1;
}

bool use_deadline(const CoreOptions& options) noexcept {
    struct {
        std::uint32_t size = 48, policy = SCHED_DEADLINE;
        std::uint64_t flags = 0;
        std::int32_t nice = 0;
        std::uint32_t priority = 0;
        std::uint64_t runtime = 0, deadline = 0, period = 0;
    } attributes;  // struct sched_attr; glibc 2.36 has no declaration of it
    const auto period = static_cast<std::uint64_t>(options.period_ns);
    attributes.runtime = options.budget_ns > 0 ? static_cast<std::uint64_t>(options.budget_ns) : period / 2;
    attributes.deadline = attributes.period = period;
    return syscall(SYS_sched_setattr, 0, &attributes, 0) == 0;
}

// for crash handlers: a fixed table, so that nothing is walked that may be changing
constexpr std::size_t max_listed = 256;
std::atomic<Core*> listed_cores[max_listed];

void list(Core* core) {
    for (auto& place : listed_cores) {
        Core* empty = nullptr;
        if (place.compare_exchange_strong(empty, core)) return;
    }
}
void unlist(Core* core) {
    for (auto& place : listed_cores) {
        Core* expected = core;
        if (place.compare_exchange_strong(expected, nullptr)) return;
    }
}

}  // namespace

struct Executor::Runner {
    Runner(std::uint32_t id, const CoreOptions& o, ThreadPins pins, FaultBoard& board, Timeline& t, const std::atomic<bool>& running,
           bool measure)
        : core(id, o.period_ns, pins, board, t, running, measure), options(o), timeline(t) {
        core.budget_ns = o.budget_ns;
        core.profile_every = o.profile_every;
        wait.spin_ns = o.spin_ns >= 0 ? std::min(o.spin_ns, o.period_ns * 9 / 10) : Wait::default_spin_ns(o.period_ns);
    }

    Core core;
    CoreOptions options;
    const Timeline& timeline;
    Wait wait;
    pthread_t thread{};
    std::int64_t grid_ns = 0;                 // position of the next cycle; the thread's, or the virtual clock's
    std::atomic<bool> quit{false}, ended{false}, ready{false};
    std::atomic<std::uint32_t> bell{0};       // futex of slow threads
    std::atomic<std::uint64_t> faults_before{0};
    std::atomic<int> tid{0};
    Granted granted;                          // written before `ready`
    std::unique_ptr<char[]> signal_stack = std::make_unique<char[]>(signal_stack_bytes);
    stack_t signal_stack_before{};            // a sanitizer's; it looks for it when the thread ends
    std::int64_t epoch_ns = 0;

    bool callable() const { return options.period_ns >= Wait::callable_period_ns; }

    void set_up() noexcept {
        tid = static_cast<int>(syscall(SYS_gettid));
        const int cpu = options.cpu >= 0 ? options.cpu : default_cpu();
        const bool wants = options.priority > 0 || options.deadline;
        if (options.deadline && use_deadline(options)) {
            granted.policy = Granted::Policy::deadline;  // its affinity must stay the whole root domain
        } else {
            cpu_set_t set;
            CPU_ZERO(&set);
            CPU_SET(static_cast<std::size_t>(cpu), &set);
            if ((wants || options.cpu >= 0) && pthread_setaffinity_np(pthread_self(), sizeof set, &set) == 0) granted.cpu = cpu;
            sched_param parameters{};
            parameters.sched_priority = options.priority > 0 ? options.priority : 80;
            if (wants && pthread_setschedparam(pthread_self(), SCHED_FIFO, &parameters) == 0) {
                granted.policy = Granted::Policy::fifo;
                granted.priority = parameters.sched_priority;
            }
        }
        granted.refused = wants && granted.policy == Granted::Policy::other;
        // a crash handler must run even when it is the stack that overflowed
        stack_t other{};
        other.ss_sp = signal_stack.get();
        other.ss_size = signal_stack_bytes;
        sigaltstack(&other, &signal_stack_before);
        prefault_stack();
        ready.store(true, std::memory_order_release);
    }

    // The first position that is due after `now_ns`.
    void place(std::int64_t now_ns) noexcept {
        const std::int64_t from = now_ns - timeline.shift_ns();
        grid_ns = epoch_ns + ((from - epoch_ns) / options.period_ns + 1) * options.period_ns;
        while (timeline.due_ns(grid_ns) <= now_ns) grid_ns += options.period_ns;
    }

    // Until a sleeper has to look whether its deadline has moved: no step is longer than a tenth of the time between two of them, so
    // it cannot come before nine tenths of what is left. A spin window that is longer than that sees the steps anyway.
    std::int64_t safe_until(std::int64_t due) const noexcept {
        if (!timeline.led()) return due;
        constexpr std::int64_t least_ns = 50'000;
        const std::int64_t margin = (due - monotonic_ns()) / 10;
        return margin <= std::max(wait.spin_ns, least_ns) ? due : due - margin + wait.spin_ns;
    }

    // Sleeps up to the spin window before the next deadline. False: called between two cycles.
    bool sleep() noexcept {
        for (;;) {
            const std::int64_t due = timeline.due_ns(grid_ns), until = safe_until(due);
            if (callable()) {
                const std::uint32_t heard = bell.load(std::memory_order_acquire);
                core.service();  // what came before `heard` was read
                if (!wait.sleep(until, bell, heard)) return false;
            } else {
                wait.sleep(until);
            }
            if (until == due) return true;
        }
    }

    struct Woken {
        std::int64_t due_ns, now_ns;
    };
    // Spins to the deadline, wherever it is by then.
    Woken spin() const noexcept {
        for (;;) {
            const Woken woken{timeline.due_ns(grid_ns), monotonic_ns()};
            if (woken.now_ns >= woken.due_ns) return woken;
            Wait::spin(std::min(woken.due_ns, woken.now_ns + look_ns));
        }
    }

    // The thread. Positions are epoch + k * period for ever: an overrun skips periods and keeps the phase.
    void loop() noexcept {
        set_up();
        place(monotonic_ns());
        const std::int64_t period = options.period_ns;
        std::uint64_t served = 0;
        while (!quit.load(std::memory_order_acquire)) {
            if (!sleep()) continue;
            core.warm(timeline.due_ns(grid_ns) - calm_ns);
            Woken woken = spin();
            if (const std::int64_t late = (woken.now_ns - woken.due_ns) / period; late > 0) {
                core.skip(static_cast<std::uint64_t>(late));
                grid_ns += late * period;
                woken = spin();  // steps made meanwhile may have put this one later
            }
            core.cycle(grid_ns, woken.due_ns, woken.now_ns);
            if (++served == 100) faults_before.store(faults_of_this_thread(), std::memory_order_release);
            grid_ns += period;
        }
        core.make_safe();
        sigaltstack(&signal_stack_before, nullptr);
        ended.store(true, std::memory_order_release);
    }
};

Executor::Executor(bool virtual_clock) : virtual_(virtual_clock) {
    board_.shared.size = sizeof board_.shared;
    board_.shared.clear = [](const hal_faults* f) {
        auto* faults = const_cast<hal_faults*>(f);
        __atomic_store_n(&faults->cleared, __atomic_load_n(&faults->count, __ATOMIC_ACQUIRE), __ATOMIC_RELEASE);
    };
    board_.shared.raise = [](const hal_faults*, const void* self, const char* reason, double detail) {
        if (Core* const core = Core::current()) core->raise({HAL_FAULT_COMPONENT, 0, core->cycle_number(), 0, detail, reason, self});
    };
    static_assert(std::is_standard_layout_v<Between>);
    background_.shared.size = sizeof background_.shared;
    background_.shared.is_virtual = virtual_;
    background_.shared.attach = [](const hal_background* b, void (*work)(void*, std::int64_t), void* self) {
        if (b->is_virtual == 0) return false;
        try {
            reinterpret_cast<Between*>(const_cast<hal_background*>(b))->works.push_back({work, self});
        } catch (const std::bad_alloc&) {
            return false;
        }
        return true;
    };
    background_.shared.detach = [](const hal_background* b, void* self) {
        std::erase_if(reinterpret_cast<Between*>(const_cast<hal_background*>(b))->works,
                      [self](const Between::Work& w) { return w.self == self; });
    };
    if (!virtual_) epoch_ns_ = monotonic_ns();
}

Executor::~Executor() {
    while (!runners_.empty()) {
        if (remove(runners_.back()->core, 2'000'000'000)) continue;
        keep_for_good(std::move(runners_.back()));  // a thread that hangs in a component still uses it
        runners_.pop_back();
    }
}

Executor::Runner& Executor::runner(const Core& core) const {
    for (const auto& runner : runners_)
        if (&runner->core == &core) return *runner;
    std::abort();
}

Core& Executor::add(const CoreOptions& options, ThreadPins pins) {
    auto owned = std::make_unique<Runner>(next_id_++, options, pins, board_, timeline_, running_, !virtual_);
    Runner& runner = *owned;
    const auto place = std::upper_bound(runners_.begin(), runners_.end(), options.period_ns,
                                        [](std::int64_t period, const auto& other) { return period < other->options.period_ns; });
    runners_.insert(place, std::move(owned));
    list(&runner.core);
    timeline_.bound(runners_.front()->options.period_ns);
    runner.epoch_ns = epoch_ns_;
    if (virtual_) {
        runner.place(virtual_now_ns_);
        return runner.core;
    }
    pthread_attr_t attributes;
    pthread_attr_init(&attributes);
    pthread_attr_setstacksize(&attributes, stack_bytes);
    const int failed = pthread_create(&runner.thread, &attributes, [](void* self) -> void* {
        static_cast<Runner*>(self)->loop();
        return nullptr;
    }, &runner);
    pthread_attr_destroy(&attributes);
    if (failed) {
        unlist(&runner.core);
        std::erase_if(runners_, [&](const auto& one) { return one.get() == &runner; });
        timeline_.bound(runners_.empty() ? 0 : runners_.front()->options.period_ns);
        throw std::runtime_error(std::string("the system gives no thread: ") + std::strerror(failed));
    }
    while (!runner.ready.load(std::memory_order_acquire)) std::this_thread::yield();
    return runner.core;
}

bool Executor::remove(Core& core, std::int64_t timeout_ns) {
    const auto at = std::find_if(runners_.begin(), runners_.end(), [&](const auto& runner) { return &runner->core == &core; });
    Runner& leaving = **at;
    if (virtual_) {
        core.make_safe();
    } else if (leaving.thread) {
        leaving.quit.store(true, std::memory_order_release);
        call(leaving);
        timespec until;
        clock_gettime(CLOCK_REALTIME, &until);
        const std::int64_t end = until.tv_nsec + timeout_ns + leaving.options.period_ns;
        until.tv_sec += end / 1'000'000'000;
        until.tv_nsec = end % 1'000'000'000;
        if (pthread_timedjoin_np(leaving.thread, nullptr, &until) != 0) {
            leaving.quit.store(false, std::memory_order_release);  // should it come back to life, it goes on
            return false;
        }
    }
    unlist(&core);
    runners_.erase(at);
    timeline_.bound(runners_.empty() ? 0 : runners_.front()->options.period_ns);
    return true;
}

void Executor::call(Runner& runner) {
    if (virtual_) runner.core.service();
    else if (runner.callable()) Wait::ring(runner.bell);
}

namespace {
// Short naps: a cycle is soon over, and the session has nothing else to do.
template <class Ready>
bool wait_for(Ready ready, std::int64_t timeout_ns) {
    const std::int64_t end = monotonic_ns() + timeout_ns;
    for (int turn = 0; !ready(); ++turn) {
        if (monotonic_ns() > end) return false;
        if (turn < 20) std::this_thread::yield();
        else std::this_thread::sleep_for(std::chrono::microseconds(20));
    }
    return true;
}

constexpr std::int64_t for_ever = std::numeric_limits<std::int64_t>::max() / 2;

// A cycle that began so long ago is not waited for again: it was waited for once.
bool hangs(const Core& core, std::int64_t timeout_ns) {
    const std::int64_t since = core.busy_since_ns();
    return since != 0 && monotonic_ns() - since > timeout_ns + 2 * core.period_ns();
}
}  // namespace

std::vector<Core*> Executor::hanging(std::int64_t timeout_ns) const {
    std::vector<Core*> found;
    for (const auto& runner : runners_) {
        Core& core = runner->core;
        const std::int64_t since = core.busy_since_ns();
        if (since == 0) continue;
        if (!wait_for([&] { return core.busy_since_ns() != since || hangs(core, timeout_ns); }, for_ever) || hangs(core, timeout_ns))
            found.push_back(&core);
    }
    return found;
}

std::vector<Core*> Executor::swap(const std::vector<std::pair<Core*, plan::Plan*>>& plans, std::int64_t timeout_ns) {
    std::vector<Core*> silent;
    for (const auto& [core, plan] : plans) core->offer(plan);
    for (const auto& [core, plan] : plans) call(runner(*core));
    for (const auto& [core, plan] : plans) {
        const bool taken =
            wait_for([&, core = core, plan = plan] { return core->taken() == plan->epoch; }, timeout_ns + 2 * core->period_ns());
        if (!taken && core->withdraw(plan)) silent.push_back(core);
        else if (!taken)
            wait_for([&, core = core, plan = plan] { return core->taken() == plan->epoch; }, for_ever);  // it is just taking it
    }
    return silent;
}

bool Executor::observe(const std::vector<std::pair<Core*, Observation*>>& wishes, std::int64_t timeout_ns) {
    for (const auto& [core, wish] : wishes) core->observe(wish);
    for (const auto& [core, wish] : wishes) call(runner(*core));
    bool all = true;
    for (const auto& [core, wish] : wishes) {
        const auto done = [wish = wish] { return wish->done.load(std::memory_order_acquire); };
        wait_for([&, core = core] { return done() || hangs(*core, timeout_ns); }, timeout_ns + 2 * core->period_ns());
        if (done()) continue;
        if (core->withdraw(wish)) all = false;
        else wait_for(done, for_ever);  // it is being answered: never free it under the thread
    }
    return all;
}

bool Executor::write(const std::vector<std::pair<Core*, std::vector<Write>>>& rows, std::int64_t timeout_ns) {
    for (const auto& [core, row] : rows) {
        const auto fits = [&, core = core, needed = row.size()] { return core->room() >= needed; };
        if (fits()) continue;
        wait_for([&, core = core] { return call(runner(*core)), fits() || hangs(*core, timeout_ns); }, timeout_ns + 2 * core->period_ns());
        if (!fits()) return false;
    }
    for (const auto& [core, row] : rows) {
        core->write(row.data(), row.size());
        if (virtual_) core->service();
    }
    return true;
}

void Executor::set_priority(Core& core, int priority) {
    Runner& target = runner(core);
    if (virtual_ || target.granted.policy != Granted::Policy::fifo || target.granted.priority == priority) return;
    sched_param parameters{};
    parameters.sched_priority = priority;
    if (pthread_setschedparam(target.thread, SCHED_FIFO, &parameters) == 0) target.granted.priority = priority;
}

void Executor::advance(std::int64_t ns) {
    if (!virtual_) {
        const std::int64_t until = monotonic_ns() + ns;
        const timespec at{until / 1'000'000'000, until % 1'000'000'000};
        while (clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &at, nullptr) == EINTR) {}
        return;
    }
    const std::int64_t end = virtual_now_ns_ + ns;
    for (bool ran = false;;) {
        Runner* next = nullptr;
        std::int64_t next_ns = 0;
        for (const auto& runner : runners_)  // fastest first, so it wins at equal instants
            if (const std::int64_t due = timeline_.due_ns(runner->grid_ns); due <= end && (!next || due < next_ns)) {
                next = runner.get();
                next_ns = due;
            }
        if (ran && (!next || next_ns != virtual_now_ns_))
            for (const Between::Work& w : background_.works) w.work(w.self, virtual_now_ns_);
        if (!next) break;
        ran = true;
        virtual_now_ns_ = next_ns;
        next->core.cycle(next->grid_ns, next_ns, next_ns);
        next->grid_ns += next->options.period_ns;
    }
    virtual_now_ns_ = end;
}

void Executor::advance_cycles(const Core& core, std::uint64_t cycles) {
    const Runner& of = runner(core);
    if (!timeline_.led()) return advance(static_cast<std::int64_t>(cycles) * core.period_ns());
    for (; cycles > 0; --cycles) advance(timeline_.due_ns(of.grid_ns) - virtual_now_ns_);
}

void Executor::lead() {
    timeline_.lead();
    for (const auto& runner : runners_)
        if (!virtual_) call(*runner);
}

std::int64_t Executor::now_ns() const { return virtual_ ? virtual_now_ns_ : monotonic_ns(); }

Granted Executor::granted(const Core& core) const { return runner(core).granted; }

std::int64_t Executor::spin_ns(const Core& core) const { return runner(core).wait.spin_ns; }

std::uint64_t Executor::page_faults(const Core& core) const {
    const Runner& of = runner(core);
    const std::uint64_t before = of.faults_before.load(std::memory_order_acquire);
    if (virtual_ || before == 0) return 0;
    std::ifstream file("/proc/self/task/" + std::to_string(of.tid.load()) + "/stat");
    std::string text((std::istreambuf_iterator<char>(file)), {});
    const auto name_end = text.rfind(')');
    if (name_end == std::string::npos) return 0;
    unsigned long long minor = 0, major = 0;
    // after the name: state ppid pgrp session tty tpgid flags minflt cminflt majflt
    if (std::sscanf(text.c_str() + name_end + 1, " %*c %*d %*d %*d %*d %*d %*u %llu %*u %llu", &minor, &major) != 2) return 0;
    return minor + major > before ? minor + major - before : 0;
}

namespace {

/// CAP_IPC_LOCK: no limit counts (mlockall(2)).
bool may_lock_memory() {
    std::ifstream file("/proc/self/status");
    for (std::string line; std::getline(file, line);)
        if (line.starts_with("CapEff:")) return std::strtoull(line.c_str() + 7, nullptr, 16) >> CAP_IPC_LOCK & 1;
    return false;
}

}  // namespace

std::vector<std::string> Executor::prepare_process() {
    std::vector<std::string> refused;
    // Under a small limit MCL_FUTURE would make later allocations fail, which is worse than a page fault.
    const rlimit all{RLIM_INFINITY, RLIM_INFINITY};
    rlimit now{};
    const bool unlimited = setrlimit(RLIMIT_MEMLOCK, &all) == 0 || (getrlimit(RLIMIT_MEMLOCK, &now) == 0 && now.rlim_cur == RLIM_INFINITY);
    if ((!unlimited && !may_lock_memory()) || mlockall(MCL_CURRENT | MCL_FUTURE) != 0) refused.emplace_back("memory locking");
    // keeps the CPU out of deep sleep states for as long as the file stays open
    static const int latency = open("/dev/cpu_dma_latency", O_WRONLY | O_CLOEXEC);
    if (latency >= 0) {
        const std::int32_t none = 0;
        [[maybe_unused]] const auto written = ::write(latency, &none, sizeof none);
    }
    return refused;
}

void Executor::make_all_safe() noexcept {
    for (auto& place : listed_cores)
        if (Core* const core = place.load(std::memory_order_acquire)) core->make_safe();
}

}  // namespace hal
