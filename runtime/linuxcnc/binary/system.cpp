// SPDX-License-Identifier: MIT
// Time, texts and files. The process has its user's rights and no more: what LinuxCNC's set-uid
// host does as root, it tries as that user or declines.
#include <algorithm>
#include <atomic>
#include <cerrno>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <ctime>
#include <fcntl.h>
#include <fstream>
#include <iterator>
#include <spawn.h>
#include <string>
#include <sys/resource.h>
#include <sys/utsname.h>
#include <unistd.h>
#include <vector>
#if defined(__x86_64__) || defined(__i386__)
#include <x86intrin.h>
#endif

#include "linuxcnc/binary/module.hpp"

using namespace hal::modules;

namespace {

constexpr long max_delay_ns = 10'000;
std::atomic<decltype(hal_module_calls::reading)> reading{nullptr};  // the machine's

struct Firmware {
    halcyon_firmware shown;  // first
    std::string content;
};

}  // namespace

void hal::modules::take_readings(const hal_module_calls& calls) {
    reading.store(calls.size >= sizeof calls ? calls.reading : nullptr);
}

extern "C" {

long long rtapi_get_time() {
    timespec now{};
    clock_gettime(CLOCK_MONOTONIC, &now);
    return now.tv_sec * 1'000'000'000LL + now.tv_nsec;
}
long long rtapi_get_clocks() {
#if defined(__x86_64__) || defined(__i386__)
    const auto cycles = static_cast<std::int64_t>(__rdtsc());
    const auto note = reading.load(std::memory_order_relaxed);
    return note ? note(cycles) : cycles;
#else
    return rtapi_get_time();
#endif
}
long rtapi_delay_max() { return max_delay_ns; }
void rtapi_delay(long ns) {
    const long long end = rtapi_get_time() + std::min(ns, max_delay_ns);
    while (rtapi_get_time() < end) {
    }
}
// whether threads may have a real-time priority: CAP_SYS_NICE, bit 23, or a limit that allows it
int rtapi_is_realtime() {
    static const bool known = [] {
        rlimit limit{};
        if (getrlimit(RLIMIT_RTPRIO, &limit) == 0 && limit.rlim_cur > 0) return true;
        std::ifstream file("/proc/self/status");
        for (std::string line; std::getline(file, line);) {
            if (line.starts_with("CapEff:")) {
                return (std::strtoull(line.c_str() + 7, nullptr, 16) >> 23 & 1) != 0;
            }
        }
        return false;
    }();
    return known;
}
int rtapi_is_kernelspace() { return 0; }

long simple_strtol(const char* text, char** end, unsigned base) {
    return std::strtol(text, end, static_cast<int>(base));
}

char** rtapi_argv_split(int, const char* text, int* count) {
    if (count) {
        *count = 0;
    }
    if (!text) return nullptr;
    const std::size_t length = std::strlen(text);
    const std::size_t max = length / 2 + 2;
    char** const words = static_cast<char**>(std::malloc(max * sizeof *words + length + 1));
    if (!words) return nullptr;
    char* const copy = reinterpret_cast<char*>(words + max);
    std::memcpy(copy, text, length + 1);
    int found = 0;
    char* rest = nullptr;
    for (char* word = strtok_r(copy, " \t\n", &rest); word;
         word = strtok_r(nullptr, " \t\n", &rest)) {
        words[found++] = word;
    }
    words[found] = nullptr;
    if (count) {
        *count = found;
    }
    return words;
}
void rtapi_argv_free(char** words) { std::free(words); }
char* rtapi_kstrndup(const char* text, std::size_t max, int) {
    return text ? strndup(text, max) : nullptr;
}

// LinuxCNC's needs neither before other calls; what an id holds is given back with it.
int rtapi_init(const char*) {
    return guarded([] {
        Module* const module = Module::current();
        if (!module) {
            rtapi_print_msg(RTAPI_MSG_ERR, "rtapi_init: only while a module is loaded\n");
            return -EPERM;
        }
        return *module->components.insert(new_id()).first;
    });
}
int rtapi_exit(int id) {
    Module* const module = Module::current() ? Module::current() : Module::unloading();
    if (in_cycle || !module || !is_id_of(*module, id)) return -EINVAL;
    module->components.erase(id);
    release_segments(id);
    return 0;
}

// Modules wait for the process they were given, whatever the result, so "no" is a process that
// fails.
int rtapi_spawn_as_root(pid_t* process, const char* path, const void*, const void*,
                        char* const argv[], char* const[]) {
    std::string command = path ? path : "";
    for (int i = 1; path && argv && argv[i]; ++i) {
        command += std::string(" ") + argv[i];
    }
    rtapi_print_msg(RTAPI_MSG_WARN, "not run as root: %s\n", command.c_str());
    char name[] = "false";
    char* const words[] = {name, nullptr};
    pid_t made = -1;
    const int problem = posix_spawnp(&made, name, nullptr, nullptr, words, environ);
    if (process) {
        *process = made;
    }
    return -problem;
}

int rtapi_spawnp_as_root(pid_t* process, const char* file, const void* actions,
                         const void* attributes, char* const argv[], char* const envp[]) {
    return rtapi_spawn_as_root(process, file, actions, attributes, argv, envp);
}

int rtapi_open_as_root(const char* path, int flags) {
    const int file = open(path, flags | O_CLOEXEC);
    if (file >= 0) return file;
    const int why = errno;
    rtapi_print_msg(RTAPI_MSG_ERR, "cannot open %s: %s\n", path, std::strerror(why));
    return -why;
}

int rtapi_request_firmware(const halcyon_firmware** result, const char* name, void*) {
    return guarded([&] {
        *result = nullptr;
        utsname kernel{};
        uname(&kernel);
        if (!name || std::strstr(name, "..")) return -EINVAL;
        for (const std::string& folder : {std::string("/lib/firmware/") + kernel.release + "/",
                                          std::string("/lib/firmware/")}) {
            std::ifstream file(folder + name, std::ios::binary);
            if (!file) continue;
            auto made = std::make_unique<Firmware>();
            made->content.assign(std::istreambuf_iterator<char>(file), {});
            made->shown = {made->content.size(),
                           reinterpret_cast<const unsigned char*>(made->content.data())};
            *result = &made.release()->shown;
            return 0;
        }
        return -ENOENT;
    });
}
void rtapi_release_firmware(const halcyon_firmware* firmware) {
    delete reinterpret_cast<const Firmware*>(firmware);
}
}
