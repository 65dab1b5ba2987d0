// SPDX-License-Identifier: MIT
#include "machine.hpp"

#include <ctime>
#include <exception>
#include <fmt/core.h>
#include <fstream>
#include <sched.h>
#include <sstream>
#include <sys/utsname.h>
#include <thread>
#include <unistd.h>

#include "execute/core.hpp"
#include "execute/wait.hpp"

namespace hal::bench {
namespace {

struct CpuTimes {
    double busy = 0;
    double all = 0;
    double stolen = 0;  // clock ticks
};

CpuTimes cpu_times() {
    std::ifstream file("/proc/stat");
    std::string cpu;
    file >> cpu;
    double ticks[8] = {};  // user nice system idle iowait irq softirq steal
    for (double& t : ticks) {
        file >> t;
    }
    CpuTimes times;
    for (const double t : ticks) {
        times.all += t;
    }
    times.busy = times.all - ticks[3] - ticks[4];
    times.stolen = ticks[7];
    return times;
}

std::string first_line(const std::string& path) {
    std::ifstream file(path);
    std::string line;
    std::getline(file, line);
    return line;
}

std::string processor() {
    std::ifstream file("/proc/cpuinfo");
    bool virtual_machine = false;
    std::string model;
    for (std::string line; std::getline(file, line);) {
        const auto colon = line.find(": ");
        if (line.starts_with("model name") && model.empty() && colon != std::string::npos) {
            model = line.substr(colon + 2);
        }
        if (line.starts_with("flags") && line.find(" hypervisor") != std::string::npos) {
            virtual_machine = true;
        }
    }
    return model + (virtual_machine ? ", virtual machine" : "");
}

/// True when the thread got it.
bool become_real_time(int cpu) {
    cpu_set_t set;
    CPU_ZERO(&set);
    CPU_SET(static_cast<std::size_t>(cpu), &set);
    pthread_setaffinity_np(pthread_self(), sizeof set, &set);
    sched_param parameters{};
    parameters.sched_priority = priority;
    return pthread_setschedparam(pthread_self(), SCHED_FIFO, &parameters) == 0;
}

}  // namespace

int real_time_cpu() {
    const std::string isolated = first_line("/sys/devices/system/cpu/isolated");  // "2-3,6"
    const auto at = isolated.find_last_of(",-");
    if (!isolated.empty()) return std::stoi(isolated.substr(at == std::string::npos ? 0 : at + 1));
    return static_cast<int>(std::thread::hardware_concurrency()) - 1;
}

std::vector<std::string> machine_facts(int cpu) {
    utsname system{};
    uname(&system);
    std::vector<std::string> facts;
    facts.push_back(fmt::format("{}, {} CPUs; Linux {} {}", processor(),
                                std::thread::hardware_concurrency(), system.release,
                                system.version));
    const bool preempt_rt = first_line("/sys/kernel/realtime") == "1";
    const std::string isolated = first_line("/sys/devices/system/cpu/isolated");
    bool granted = false;
    std::thread([&] { granted = become_real_time(cpu); }).join();
    facts.push_back(fmt::format(
        "PREEMPT_RT: {}; SCHED_FIFO {}: {}; real-time thread on CPU {}; isolated CPUs: {}; "
        "sched_rt_runtime_us: {}",
        preempt_rt ? "yes" : "no", priority,
        granted ? "granted" : "denied, so ordinary threads are measured", cpu,
        isolated.empty() ? "none" : isolated, first_line("/proc/sys/kernel/sched_rt_runtime_us")));
    return facts;
}

void stay_off(int cpu) {
    cpu_set_t set;
    if (sched_getaffinity(0, sizeof set, &set) != 0) return;
    CPU_CLR(static_cast<std::size_t>(cpu), &set);
    if (CPU_COUNT(&set) > 0) {
        sched_setaffinity(0, sizeof set, &set);
    }
}

void wait_for_quiet(double max_s) {
    const std::int64_t end = monotonic_ns() + static_cast<std::int64_t>(max_s * 1e9);
    CpuTimes before = cpu_times();
    for (int calm = 0; calm < 2 && monotonic_ns() < end;) {
        std::this_thread::sleep_for(std::chrono::milliseconds(200));
        const CpuTimes now = cpu_times();
        calm = now.busy - before.busy <= 0.08 * (now.all - before.all) ? calm + 1 : 0;
        before = now;
    }
}

double tsc_per_ns() {
#if defined(__x86_64__)
    static const double rate = [] {
        const std::int64_t begin = monotonic_ns();
        const auto ticks = __builtin_ia32_rdtsc();
        std::this_thread::sleep_for(std::chrono::milliseconds(100));
        const auto more = __builtin_ia32_rdtsc() - ticks;
        return static_cast<double>(more) / static_cast<double>(monotonic_ns() - begin);
    }();
    return rate;
#else
    return 0.0;
#endif
}

double stolen_ms() {
    return cpu_times().stolen * 1000.0 / static_cast<double>(sysconf(_SC_CLK_TCK));
}

void run_real_time(int cpu, const std::function<void()>& work) {
    std::thread([&] {
        become_real_time(cpu);
        work();
    }).join();
}

void run_undisturbed(const std::function<void()>& work) {
    std::exception_ptr problem;
    std::thread([&] {
        sched_param parameters{};
        parameters.sched_priority = 1;
        pthread_setschedparam(pthread_self(), SCHED_FIFO, &parameters);
        try {
            work();
        } catch (...) {
            problem = std::current_exception();
        }
    }).join();
    if (problem) {
        std::rethrow_exception(problem);
    }
}

PeriodicThread::PeriodicThread(int cpu, std::int64_t period_ns,
                               std::function<void(std::uint64_t)> work)
    : cpu_(cpu), period_ns_(period_ns), work_(std::move(work)) {
    pthread_create(&thread_, nullptr, [](void* self) -> void* {
        auto& t = *static_cast<PeriodicThread*>(self);
        become_real_time(t.cpu_);
        const Wait wait{Wait::default_spin_ns(t.period_ns_)};
        std::int64_t due = monotonic_ns() + t.period_ns_;
        for (std::uint64_t cycle = 0; !t.quit_.load(std::memory_order_relaxed); ++cycle) {
            wait.sleep(due);
            if (const std::int64_t now = Wait::spin(due); now > due) {
                due += (now - due) / t.period_ns_ * t.period_ns_;
            }
            const std::int64_t begin = monotonic_ns();
            t.work_(cycle);
            t.last_ns_.store(static_cast<std::int32_t>(monotonic_ns() - begin),
                             std::memory_order_relaxed);
            due += t.period_ns_;
        }
        return nullptr;
    }, this);
}

PeriodicThread::~PeriodicThread() {
    quit_ = true;
    pthread_join(thread_, nullptr);
}

}  // namespace hal::bench
