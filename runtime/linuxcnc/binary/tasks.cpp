// SPDX-License-Identifier: MIT
// Tasks: real-time threads that a module makes for itself. They run beside the machine's threads
// whether these are started or not, meet their deadlines like them (a late one skips periods and
// keeps its phase), and end, at the latest, when the module is unloaded.
#include <algorithm>
#include <array>
#include <atomic>
#include <cerrno>
#include <csetjmp>
#include <csignal>
#include <cstdint>
#include <cstdio>
#include <cstring>
#include <ctime>
#include <pthread.h>
#include <sched.h>
#include <semaphore.h>
#include <sys/prctl.h>

#include "linuxcnc/binary/messages.hpp"
#include "linuxcnc/binary/module.hpp"
#include "linuxcnc/binary/tasks.hpp"

// guard/module_calls.cpp
extern "C" [[gnu::weak, gnu::visibility("default")]] void halcyon_guard_module_task(bool runs);

namespace hal::modules {
namespace {

constexpr int highest_priority = 98;
constexpr int lowest_priority = 1;
constexpr std::size_t min_stack = 1 << 20;
constexpr std::size_t signal_stack_bytes = 1 << 16;
constexpr std::int64_t second_ns = 1'000'000'000;

enum class State { free, made, runs, ended, lost };

struct Task {
    std::atomic<State> state{State::free};
    Module* module = nullptr;
    void (*code)(void*) = nullptr;
    void* argument = nullptr;
    int priority = 0;
    std::size_t stack = 0;
    pthread_t thread{};
    std::atomic<std::int64_t> period_ns{0};
    std::int64_t due_ns = 0;                 // the task's own, as is the next
    long correction_ns = 0;                  // added to each period
    std::atomic<std::int64_t> waited_ns{0};  // when it has called rtapi_wait() last
    std::atomic<bool> ending{false};
    std::atomic<bool> paused{false};
    std::atomic<bool> reported{false};
    sem_t bell;                              // ends a wait early
    sigjmp_buf leave;
    alignas(16) char signal_stack[signal_stack_bytes];
};
std::array<Task, 64> tasks;  // fixed: cycles and signal handlers look into it
constinit thread_local Task* current __attribute__((tls_model("initial-exec"))) = nullptr;

std::int64_t now_ns() noexcept { return rtapi_get_time(); }
timespec to_timespec(std::int64_t ns) noexcept {
    return {static_cast<time_t>(ns / second_ns), static_cast<long>(ns % second_ns)};
}

int number_of(const Task& task) noexcept { return static_cast<int>(&task - tasks.data()) + 1; }
Task* task_of(int id) noexcept {
    if (id < 1 || id > static_cast<int>(tasks.size())) return nullptr;
    Task& task = tasks[static_cast<std::size_t>(id) - 1];
    return task.state.load(std::memory_order_acquire) == State::free ? nullptr : &task;
}

int fail(const char* function, const char* why, int result = -EINVAL) {
    // in a cycle the result is enough
    if (!in_cycle) {
        rtapi_print_msg(RTAPI_MSG_ERR, "%s: %s\n", function, why);
    }
    return result;
}

void enter() noexcept {
    in_cycle = true;
    if (halcyon_guard_module_task) {
        halcyon_guard_module_task(true);
    }
}
void leave_cycle() noexcept {
    if (halcyon_guard_module_task) {
        halcyon_guard_module_task(false);
    }
    in_cycle = false;
}

void set_up(Task& task) noexcept {
    char name[16];
    std::snprintf(name, sizeof name, "%s", task.module->name().c_str());
    pthread_setname_np(pthread_self(), name);
    sched_param parameters{};
    parameters.sched_priority = task.priority;
    // without the privilege it is an ordinary thread, like the machine's
    pthread_setschedparam(pthread_self(), SCHED_FIFO, &parameters);
    prctl(PR_SET_TIMERSLACK, 1UL, 0UL, 0UL, 0UL);
    const stack_t other{.ss_sp = task.signal_stack, .ss_flags = 0, .ss_size = signal_stack_bytes};
    sigaltstack(&other, nullptr);
    volatile char buffer[1 << 18];
    for (std::size_t i = 0; i < sizeof buffer; i += 4096) {
        buffer[i] = 0;  // no page fault later
    }
}

void* run(void* self) {
    Task& task = *static_cast<Task*>(self);
    set_up(task);
    current = &task;
    if (task.module->accesses_ports) {
        permit_ports();
    }
    if (sigsetjmp(task.leave, 0) == 0) {
        enter();
        task.code(task.argument);
        leave_cycle();
    }
    current = nullptr;
    const stack_t none{.ss_sp = nullptr, .ss_flags = SS_DISABLE, .ss_size = 0};
    sigaltstack(&none, nullptr);
    task.state.store(State::ended, std::memory_order_release);
    return nullptr;
}

/// Sleeps until `due` on the monotonic clock. False: woken by the bell.
bool sleep_until(Task& task, std::int64_t due) noexcept {
    const timespec until = to_timespec(due);
    for (;;) {
        if (sem_clockwait(&task.bell, CLOCK_MONOTONIC, &until) == 0) return false;
        if (errno != EINTR) return true;
    }
}

/// Ends the task's thread. False: it does not come to rtapi_wait().
bool end(Task& task) noexcept {
    if (task.state.load(std::memory_order_acquire) == State::made) return true;
    task.ending.store(true, std::memory_order_release);
    sem_post(&task.bell);
    const timespec until = to_timespec(now_ns() + second_ns);
    return pthread_clockjoin_np(task.thread, nullptr, CLOCK_MONOTONIC, &until) == 0;
}

/// Returns false after reporting; the task's place is then lost.
bool remove(Task& task) noexcept {
    if (end(task)) {
        if (task.state.load(std::memory_order_relaxed) != State::made) {
            sem_destroy(&task.bell);
        }
        task.module = nullptr;
        task.state.store(State::free, std::memory_order_release);
        return true;
    }
    rtapi_print_msg(RTAPI_MSG_ERR,
                    "%s: task %d has not called rtapi_wait() for 1 s and cannot be ended; its code "
                    "stays in memory until the machine ends\n",
                    task.module->name().c_str(), number_of(task));
    task.state.store(State::lost, std::memory_order_release);
    task.module->keep_for_good();
    return false;
}

}  // namespace

void release_tasks(Module& module) noexcept {
    for (Task& task : tasks) {
        if (const State state = task.state.load(std::memory_order_acquire);
            state != State::free && state != State::lost && task.module == &module) {
            remove(task);
        }
    }
}

bool correct_task(long ns) noexcept {
    if (!current) return false;
    // as for the machine's threads
    const auto max = static_cast<long>(current->period_ns.load(std::memory_order_relaxed) / 10);
    current->correction_ns = std::clamp(ns, -max, max);
    return true;
}

const char* module_of_task() noexcept {
    return current ? current->module->name().c_str() : nullptr;
}

void report_silent_tasks() noexcept {
    for (Task& task : tasks) {
        if (task.state.load(std::memory_order_acquire) != State::runs ||
            task.paused.load(std::memory_order_relaxed)) {
            continue;
        }
        const std::int64_t limit = std::max<std::int64_t>(
            10 * task.period_ns.load(std::memory_order_relaxed), second_ns / 10);
        const bool silent = now_ns() - task.waited_ns.load(std::memory_order_relaxed) > limit;
        if (silent && !task.reported.exchange(true)) {
            std::fprintf(stderr, "hal: %s: task %d has not called rtapi_wait() for %.1f s\n",
                         task.module->name().c_str(), number_of(task),
                         static_cast<double>(limit) * 1e-9);
        }
        if (!silent) {
            task.reported = false;
        }
    }
}

}  // namespace hal::modules

using namespace hal::modules;

extern "C" {

int rtapi_prio_highest() { return highest_priority; }
int rtapi_prio_lowest() { return lowest_priority; }
int rtapi_prio_next_higher(int priority) {
    return std::clamp(priority + (priority < highest_priority), lowest_priority, highest_priority);
}
int rtapi_prio_next_lower(int priority) {
    return std::clamp(priority - (priority > lowest_priority), lowest_priority, highest_priority);
}

int rtapi_task_new(void (*code)(void*), void* argument, int priority, int owner,
                   unsigned long stack_bytes, int) {
    Module* const module = Module::current();
    if (!module) {
        return fail("rtapi_task_new", "only while a module is loaded, in rtapi_app_main", -EPERM);
    }
    if (!code || !is_id_of(*module, owner)) {
        return fail("rtapi_task_new", code ? "the owner is not an id of this module" : "no code");
    }
    if (priority < lowest_priority || priority > highest_priority) {
        return fail("rtapi_task_new", "the priority is not one of rtapi_prio_...");
    }
    const auto task = std::find_if(tasks.begin(), tasks.end(), [](const Task& one) {
        return one.state.load(std::memory_order_acquire) == State::free;
    });
    if (task == tasks.end()) {
        return fail("rtapi_task_new", "all modules together have at most 64 tasks", -ENOMEM);
    }
    if (!module->calls().own_threads(module->host())) {
        return fail("rtapi_task_new",
                    "a task runs in real time, which hal sim does not; hal run does", -ENOSYS);
    }
    task->module = module;
    task->code = code;
    task->argument = argument;
    task->priority = priority;
    task->stack = std::max<std::size_t>(stack_bytes, min_stack);
    task->state.store(State::made, std::memory_order_release);
    return number_of(*task);
}

int rtapi_task_start(int id, unsigned long period_ns) {
    if (in_cycle) return fail("rtapi_task_start", "not in a cycle", -EPERM);
    Task* const task = task_of(id);
    if (!task || period_ns == 0) {
        return fail("rtapi_task_start", task ? "the period is 0" : "unknown task");
    }
    const auto period = static_cast<std::int64_t>(clock_multiple(period_ns));
    // again
    if (task->state.load(std::memory_order_acquire) == State::runs && task->paused.load()) {
        task->period_ns = period;
        return rtapi_task_resume(id);
    }
    if (task->state.load(std::memory_order_acquire) != State::made) {
        return fail("rtapi_task_start", "the task is not paused");
    }
    task->period_ns = period;
    task->ending = task->paused = task->reported = false;
    task->correction_ns = 0;
    task->waited_ns = task->due_ns = now_ns();
    if (sem_init(&task->bell, 0, 0) != 0) return -errno;
    pthread_attr_t attributes;
    pthread_attr_init(&attributes);
    pthread_attr_setstacksize(&attributes, task->stack);
    task->state.store(State::runs, std::memory_order_release);
    start_printer();
    const int problem = pthread_create(&task->thread, &attributes, run, task);
    pthread_attr_destroy(&attributes);
    if (problem == 0) return 0;
    task->state.store(State::made, std::memory_order_release);
    sem_destroy(&task->bell);
    return fail("rtapi_task_start", std::strerror(problem), -problem);
}

int rtapi_task_delete(int id) {
    Task* const task = task_of(id);
    if (!task || task->state.load() == State::lost) {
        return fail("rtapi_task_delete", "unknown task");
    }
    if (in_cycle) {
        return fail("rtapi_task_delete",
                    "not in a cycle; a task ends itself when its function returns", -EPERM);
    }
    return remove(*task) ? 0 : -EBUSY;
}

int rtapi_task_pause(int id) {
    Task* const task = task_of(id);
    if (!task || task->state.load() != State::runs) return -EINVAL;
    task->paused = true;  // it stops at its next rtapi_wait()
    if (current == task) {
        rtapi_wait();
    }
    return 0;
}

int rtapi_task_resume(int id) {
    Task* const task = task_of(id);
    if (!task) return -EINVAL;
    if (task->state.load() == State::made) {
        return fail("rtapi_task_resume",
                    "a task without a period could not be ended and would keep the CPU; "
                    "rtapi_task_start gives it one",
                    -ENOSYS);
    }
    if (task->state.load() != State::runs || !task->paused.exchange(false)) return -EINVAL;
    sem_post(&task->bell);
    return 0;
}

int rtapi_task_self() {
    if (current) return number_of(*current);
    if (in_cycle) return 0;
    return -EINVAL;
}

void rtapi_wait() {
    Task* const task = current;
    if (!task) {
        rtapi_print_msg(RTAPI_MSG_ERR, "rtapi_wait: only in a task of the module's own\n");
        return;
    }
    leave_cycle();
    task->module->parameters.exchange();
    std::int64_t period = task->period_ns.load(std::memory_order_relaxed);
    task->due_ns += std::max<std::int64_t>(period + task->correction_ns, 0);
    task->waited_ns.store(now_ns(), std::memory_order_relaxed);
    for (;;) {
        const bool due =
            sleep_until(*task, task->paused.load() ? now_ns() + second_ns : task->due_ns);
        if (task->ending.load(std::memory_order_acquire)) {
            siglongjmp(task->leave, 1);
        }
        if (due && !task->paused.load()) break;
    }
    period = task->period_ns.load(std::memory_order_relaxed);
    if (const std::int64_t late = (now_ns() - task->due_ns) / period; late > 0) {
        task->due_ns += late * period;
    }
    task->waited_ns.store(now_ns(), std::memory_order_relaxed);
    task->module->parameters.exchange();
    enter();
}

long long rtapi_task_pll_get_reference() {
    if (current) return current->due_ns;
    if (in_cycle) return cycle_now->start_ns;
    return -EINVAL;
}
}
