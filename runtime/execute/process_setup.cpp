// SPDX-License-Identifier: MIT
#include "execute/process_setup.hpp"

#include <cstdint>
#include <cstdlib>
#include <fcntl.h>
#include <fstream>
#include <linux/capability.h>
#include <pthread.h>
#include <sys/mman.h>
#include <sys/resource.h>
#include <unistd.h>

#include "base/own_descriptors.hpp"

namespace hal {
namespace {

/// CAP_IPC_LOCK: no limit counts (mlockall(2)).
bool may_lock_memory() {
    std::ifstream file("/proc/self/status");
    for (std::string line; std::getline(file, line);) {
        if (line.starts_with("CapEff:")) {
            return std::strtoull(line.c_str() + 7, nullptr, 16) >> CAP_IPC_LOCK & 1;
        }
    }
    return false;
}

std::vector<std::string> prepare() {
    std::vector<std::string> refused;
    // Under a small limit MCL_FUTURE would make later allocations fail, which is worse than a page
    // fault.
    const rlimit all{RLIM_INFINITY, RLIM_INFINITY};
    rlimit now{};
    const bool unlimited = setrlimit(RLIMIT_MEMLOCK, &all) == 0 ||
                           (getrlimit(RLIMIT_MEMLOCK, &now) == 0 && now.rlim_cur == RLIM_INFINITY);
    if ((!unlimited && !may_lock_memory()) || mlockall(MCL_CURRENT | MCL_FUTURE) != 0) {
        refused.emplace_back("memory locking");
    }
    // keeps the CPU out of deep sleep states for as long as the file stays open
    static const int latency = open("/dev/cpu_dma_latency", O_WRONLY | O_CLOEXEC);
    if (latency >= 0) {
        list_descriptor(latency, "the request for a short wake-up latency");
        const std::int32_t none = 0;
        [[maybe_unused]] const auto written = ::write(latency, &none, sizeof none);
    }
    return refused;
}

}  // namespace

void limit_helper_stacks() {
#if !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)  // whose frames are larger
    // Less than a real-time thread asks for: glibc gives the stack of an ended thread to a new one
    // that asks for as much or less, and release_unused_stack() may have unlocked it.
    constexpr std::size_t max = (1 << 20) - (1 << 16);
    pthread_attr_t attributes;
    if (pthread_getattr_default_np(&attributes) != 0) return;
    std::size_t size = 0;
    if (pthread_attr_getstacksize(&attributes, &size) == 0 && size > max &&
        pthread_attr_setstacksize(&attributes, max) == 0) {
        pthread_setattr_default_np(&attributes);
    }
    pthread_attr_destroy(&attributes);
#endif
}

void release_unused_stack([[maybe_unused]] std::size_t kept_bytes) noexcept {
#if !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)
    pthread_attr_t attributes;
    if (pthread_getattr_np(pthread_self(), &attributes) != 0) return;
    void* lowest = nullptr;
    std::size_t size = 0;
    if (pthread_attr_getstack(&attributes, &lowest, &size) == 0) {
        const auto page = static_cast<std::uintptr_t>(sysconf(_SC_PAGESIZE));
        const auto begin = reinterpret_cast<std::uintptr_t>(lowest);
        const auto frame = reinterpret_cast<std::uintptr_t>(__builtin_frame_address(0));
        const std::uintptr_t end = (frame - kept_bytes) / page * page;
        if (end > begin && end < begin + size && munlock(lowest, end - begin) == 0) {
            madvise(lowest, end - begin, MADV_DONTNEED);
        }
    }
    pthread_attr_destroy(&attributes);
#endif
}

const std::vector<std::string>& prepare_process() {
    static const std::vector<std::string> refused = prepare();
    return refused;
}

}  // namespace hal
