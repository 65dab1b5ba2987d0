// SPDX-License-Identifier: MIT
// `hal doctor`: what on this machine prevents real time, remedies to type, and the measured wake-up
// jitter.
#include "inspect/doctor.hpp"

#include <algorithm>
#include <cctype>
#include <cerrno>
#include <cstring>
#include <fcntl.h>
#include <filesystem>
#include <fmt/core.h>
#include <fstream>
#include <functional>
#include <nlohmann/json.hpp>
#include <sched.h>
#include <set>
#include <sys/mman.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <sys/utsname.h>
#include <sys/xattr.h>
#include <thread>
#include <unistd.h>

#include "base/types.hpp"
#include "cli/output.hpp"
#include "hal/privilege.hpp"
#include "inspect/doctor_interface.hpp"
#include "inspect/finding.hpp"
#include "inspect/jitter.hpp"
#include "inspect/remedies.hpp"
#include "text/quoting.hpp"

namespace hal::tools {

namespace {

std::string first_line(const std::string& path) {
    std::ifstream file(path);
    std::string line;
    std::getline(file, line);
    return line;
}

/// Returns the alternative to file capabilities for scheduling and memory locking: limits for a
/// group of users, which Halcyon's package has.
std::string limits_of_a_group() {
    if (::access("/etc/security/limits.d/halcyon-realtime.conf", F_OK) == 0) {
        return "sudo usermod -aG realtime $USER, then log in again";
    }
    return "sudo groupadd -f realtime; sudo usermod -aG realtime $USER; "
           "printf '@realtime - rtprio 98\\n@realtime - memlock unlimited\\n' | sudo tee "
           "/etc/security/limits.d/realtime.conf, then log in again";
}

/// Returns true for a capability in the effective set of this process.
bool capable(int number) {
    std::ifstream status("/proc/self/status");
    for (std::string line; std::getline(status, line);) {
        if (line.starts_with("CapEff:")) {
            return (std::stoull(line.substr(7), nullptr, 16) >> number) & 1;
        }
    }
    return false;
}
constexpr int cap_net_raw = 13;
constexpr int cap_ipc_lock = 14;
constexpr int cap_sys_nice = 23;

/// The end of the names of Debian's kernel packages.
std::string_view kernel_flavour(std::string_view machine) {
    if (machine == "aarch64") return "arm64";
    return machine.starts_with("arm") ? "armmp" : "amd64";
}

Finding kernel() {
    utsname about{};
    ::uname(&about);
    const std::string version = about.version;
    const bool rt = first_line("/sys/kernel/realtime") == "1" ||
                    version.find("PREEMPT_RT") != std::string::npos;
    if (rt) {
        return {Verdict::good, "kernel", fmt::format("{} with PREEMPT_RT", about.release)};
    }
    const char* kind = "no preemption";
    for (const char* const name : {"PREEMPT", "PREEMPT_DYNAMIC"}) {
        if (version.find(name) != std::string::npos) {
            kind = name;
        }
    }
    return {Verdict::fair,
            "kernel",
            fmt::format("{} ({}), not PREEMPT_RT: occasional wake-up latencies of milliseconds",
                        about.release, kind),
            fmt::format("sudo apt-get install -y linux-image-rt-{}", kernel_flavour(about.machine)),
            {},
            "reboot into it"};
}

/// The file with the kernel command line: boards have no GRUB.
std::string_view command_line_file() {
    // Raspberry Pi
    if (::access("/boot/firmware/cmdline.txt", F_OK) == 0) return "/boot/firmware/cmdline.txt";
    // BeagleBone
    if (::access("/boot/uEnv.txt", F_OK) == 0) return "cmdline in /boot/uEnv.txt";
    return "GRUB_CMDLINE_LINUX in /etc/default/grub";
}

Finding machine() {
    std::ifstream info("/proc/cpuinfo");
    for (std::string line; std::getline(info, line);) {
        if (line.starts_with("flags") && line.find(" hypervisor") != std::string::npos) {
            std::ifstream stat("/proc/stat");
            std::string word;
            long long value = 0;
            long long steal = 0;
            stat >> word;
            for (int i = 0; i < 8 && stat >> value; ++i) {
                steal = value;
            }
            return {Verdict::fair, "machine",
                    fmt::format(
                        "virtual: the host preempts the processor ({} s so far)",
                        static_cast<double>(steal) / static_cast<double>(::sysconf(_SC_CLK_TCK))),
                    "run on bare metal, or give the guest dedicated processors"};
        }
    }
    return {Verdict::good, "machine", "not virtual"};
}

/// Requests SCHED_FIFO from the scheduler: limits and capabilities are only hints.
Finding scheduling() {
    int problem = 0;
    std::thread([&] {
        sched_param wanted{};
        wanted.sched_priority = 98;
        problem = ::pthread_setschedparam(::pthread_self(), SCHED_FIFO, &wanted);
    }).join();
    rlimit limit{};
    ::getrlimit(RLIMIT_RTPRIO, &limit);
    const std::string why =
        capable(cap_sys_nice) ? "cap_sys_nice" : fmt::format("limit rtprio {}", limit.rlim_cur);
    if (problem == 0) {
        return {Verdict::good, "SCHED_FIFO", fmt::format("allowed up to priority 98 ({})", why)};
    }
    return {Verdict::poor, "SCHED_FIFO",
            fmt::format("denied ({}): threads compete with every other program", why),
            grant_command(), limits_of_a_group()};
}

Finding memory() {
    rlimit limit{};
    ::getrlimit(RLIMIT_MEMLOCK, &limit);
    if (capable(cap_ipc_lock)) {
        return {Verdict::good, "memory locking", "allowed (cap_ipc_lock)"};
    }
    if (limit.rlim_cur == RLIM_INFINITY) {
        return {Verdict::good, "memory locking", "allowed (limit memlock unlimited)"};
    }
    return {Verdict::poor, "memory locking",
            fmt::format("limited to {} KiB: a page fault in a cycle costs 1 us to 10 ms",
                        limit.rlim_cur / 1024),
            grant_command(), limits_of_a_group()};
}

Finding capabilities() {
    const std::string path = privilege::program();
    const bool on_file = ::getxattr(path.c_str(), "security.capability", nullptr, 0) > 0;
    if (capable(cap_sys_nice) && capable(cap_ipc_lock) && capable(cap_net_raw)) {
        return {Verdict::good, "capabilities",
                on_file ? "granted to the program file" : "all present (by user)"};
    }
    return {Verdict::fair, "capabilities",
            on_file
                ? "granted to the program file, but not effective (a nosuid mount, or a container)"
                : "none granted to the program file: raw sockets and priorities need them",
            grant_command()};
}

/// Asks the kernel: a container may deny it in spite of the capability.
Finding raw_ethernet() {
    const int socket = ::socket(AF_PACKET, SOCK_RAW | SOCK_CLOEXEC, 0);
    const int problem = errno;
    if (socket >= 0) {
        ::close(socket);
    }
    if (socket >= 0) {
        return {Verdict::good, "raw Ethernet", "allowed (cap_net_raw)"};
    }
    if (problem == EPERM || problem == EACCES) {
        return {Verdict::fair, "raw Ethernet", "denied: links such as eth:enp3s0 cannot be opened",
                grant_command()};
    }
    return {Verdict::fair, "raw Ethernet",
            fmt::format("no packet sockets in this kernel: {}", std::strerror(problem)),
            "use a kernel with CONFIG_PACKET, as every distribution's is"};
}

Finding throttling() {
    const std::string text = first_line("/proc/sys/kernel/sched_rt_runtime_us");
    if (text.empty()) {
        return {Verdict::good, "throttling", "none visible"};
    }
    if (text == "-1") {
        return {Verdict::good, "throttling", "off (kernel.sched_rt_runtime_us = -1)"};
    }
    return {Verdict::good, "throttling",
            fmt::format("real-time threads may use {} us of each {} us; threads below this limit "
                        "are not affected",
                        text, first_line("/proc/sys/kernel/sched_rt_period_us"))};
}

Finding governor() {
    std::set<std::string> governors;
    for (unsigned cpu = 0; cpu < std::thread::hardware_concurrency(); ++cpu) {
        const std::string text =
            first_line(fmt::format("/sys/devices/system/cpu/cpu{}/cpufreq/scaling_governor", cpu));
        if (!text.empty()) {
            governors.insert(text);
        }
    }
    if (governors.empty()) {
        return {Verdict::good, "frequency", "no scaling visible"};
    }
    std::string all;
    for (const auto& g : governors) {
        append_item(all, g);
    }
    if (governors == std::set<std::string>{"performance"}) {
        return {Verdict::good, "frequency", "governor performance"};
    }
    return {Verdict::fair, "frequency",
            fmt::format("governor {}: an idle processor ramps up slowly", all),
            "sudo sh -c 'echo performance | tee "
            "/sys/devices/system/cpu/cpu*/cpufreq/scaling_governor'"};
}

Finding isolation() {
    const std::string isolated = first_line("/sys/devices/system/cpu/isolated");

    const std::string full = first_line("/sys/devices/system/cpu/nohz_full");
    const long cpus = ::sysconf(_SC_NPROCESSORS_ONLN);
    if (!isolated.empty()) {
        return {Verdict::good, "isolated cpus",
                fmt::format("{} of {}{}", isolated, cpus,
                            full.empty() || full == "(null)" ? "" : ", without ticks: " + full)};
    }
    if (cpus < 2) {
        return {Verdict::fair, "isolated cpus", "one processor only: everything shares it"};
    }
    return {
        Verdict::fair, "isolated cpus",
        fmt::format("none of {}: other programs run beside the threads", cpus),
        fmt::format("add isolcpus={0} nohz_full={0} rcu_nocbs={0} to the kernel command line ({1})",
                    cpus - 1, command_line_file())};
}

Finding clock_source() {
    const std::string source =
        first_line("/sys/devices/system/clocksource/clocksource0/current_clocksource");
    const bool fast = source == "tsc" || source == "arch_sys_counter" || source == "kvm-clock" ||
                      source == "riscv_clocksource";
    if (fast) {
        return {Verdict::good, "clock source", source};
    }
    return {Verdict::fair, "clock source",
            fmt::format("{}: reading the clock costs about a microsecond",
                        source.empty() ? "unknown" : source),
#if defined(__x86_64__) || defined(__i386__)
            "find out why the kernel left tsc: dmesg | grep -i clocksource"};
#else
            "processors without a generic timer, such as Cortex-A8, have no faster one: use longer "
            "periods"};
#endif
}

Finding idle_states() {
    const int device = ::open("/dev/cpu_dma_latency", O_WRONLY | O_CLOEXEC);
    if (device >= 0) {
        ::close(device);
    }
    unsigned states = 0;
    while (!first_line(fmt::format("/sys/devices/system/cpu/cpu0/cpuidle/state{}/name", states))
                .empty()) {
        ++states;
    }
    if (states <= 1) {
        return {Verdict::good, "idle states", "no deep states visible"};
    }
    if (device >= 0) {
        return {
            Verdict::good, "idle states",
            fmt::format("{}, held shallow through /dev/cpu_dma_latency while threads run", states)};
    }
    const std::string access =
        "sudo groupadd -f realtime; sudo usermod -aG realtime $USER; sudo chgrp realtime "
        "/dev/cpu_dma_latency; sudo chmod 0660 /dev/cpu_dma_latency";
    const std::string rule =
        "; echo 'KERNEL==\"cpu_dma_latency\", GROUP=\"realtime\", MODE=\"0660\"' | sudo tee "
        "/etc/udev/rules.d/99-cpu-dma-latency.rules";
    const bool has_udev = std::filesystem::is_directory("/etc/udev/rules.d");
    return {
        Verdict::fair,
        "idle states",
        fmt::format(
            "{}, and /dev/cpu_dma_latency is not writable: leaving a deep state takes up to 0.2 ms",
            states),
        access + (has_udev ? rule : ""),
        {},
        has_udev
            ? "log in again"
            : "log in again; udev is not installed, so repeat chgrp and chmod after each boot"};
}

/// System-management interrupts stop all processors unseen; Intel counts them in a register.
Finding management_interrupts() {
#if !defined(__x86_64__) && !defined(__i386__)
    return {Verdict::good, "firmware", "this processor has no system-management interrupts"};
#endif
    const int device = ::open("/dev/cpu/0/msr", O_RDONLY | O_CLOEXEC);
    std::uint64_t count = 0;
    const bool read = device >= 0 && ::pread(device, &count, sizeof count, 0x34) == sizeof count;
    if (device >= 0) {
        ::close(device);
    }
    if (!read) {
        return {Verdict::good, "firmware",
                "system-management interrupts cannot be counted from here (as root: modprobe msr)"};
    }
    return {
        count == 0 ? Verdict::good : Verdict::fair, "firmware",
        fmt::format("{} system-management interrupts since power-on", count),
        count == 0
            ? ""
            : "in the firmware setup, disable legacy USB, and power management of fans and memory"};
}

constexpr Finding (*checks[])() = {kernel,       machine,      scheduling,  memory,
                                   capabilities, raw_ethernet, throttling,  governor,
                                   isolation,    clock_source, idle_states, management_interrupts};

}  // namespace

int run_doctor(const DoctorOptions& options) {
    if (options.yes && !options.fix) {
        return fail(options, "--yes applies to --fix: it carries out commands without asking");
    }
    if (!options.interface.empty()) return run_interface_doctor(options);
    if (options.trial || options.hold || options.udp || options.cpu >= 0) {
        return fail(options, "--cpu, --udp, --try and --hold apply to --interface NAME");
    }
    nlohmann::ordered_json report;
    std::vector<Finding> findings;
    findings.reserve(std::size(checks));
    for (const auto& check : checks) {
        findings.push_back(check());
        report["findings"].push_back(json_of(findings.back()));
    }
    if (!options.json && !print_findings(findings)) return 1;
    if (options.fix) return carry_out(options, remedies_of(findings));
    constexpr std::int64_t period_ns = 1'000'000;
    constexpr std::int64_t spin_ns = 200'000;
    for (const std::int64_t spin : {std::int64_t{0}, spin_ns}) {
        if (options.seconds <= 0.0) break;
        const Jitter jitter =
            measure_jitter(period_ns, spin, static_cast<std::int64_t>(options.seconds * 1e9));
        const std::string how = spin == 0 ? "sleeping to the deadline"
                                          : fmt::format("sleeping, then spinning the last {}",
                                                        format_duration(static_cast<double>(spin)));
        if (options.json) {
            report["wakeup"].push_back({{"period_ns", period_ns},
                                        {"spin_ns", spin},
                                        {"policy", jitter.policy},
                                        {"cycles", jitter.cycles},
                                        {"p50_ns", jitter.p50_ns},
                                        {"p99_ns", jitter.p99_ns},
                                        {"max_ns", jitter.max_ns}});
            continue;
        }
        const std::string title =
            spin == 0 ? fmt::format("\nwake-up latency at 1 kHz, {}:\n{:42} {:>10} {:>10} {:>10}\n",
                                    jitter.policy, "", "p50", "p99", "max")
                      : "";
        if (!print(fmt::format("{}  {:40} {:>10} {:>10} {:>10}\n", title, how,
                               format_duration(jitter.p50_ns), format_duration(jitter.p99_ns),
                               format_duration(jitter.max_ns)))) {
            return 1;
        }
    }
    return exit_code(!options.json || print(report.dump(2) + "\n"));
}

}  // namespace hal::tools
