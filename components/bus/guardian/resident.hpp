// SPDX-License-Identifier: MIT
// What keeps a guardian alive and prompt. For its main function.
#pragma once

#include <fcntl.h>
#include <sched.h>
#include <signal.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <array>
#include <cstddef>
#include <cstdlib>
#include <string>

#include "bus/guardian/child_process.hpp"
#include "bus/guardian/starvation_watch.hpp"
#include "link/system.hpp"

namespace hal::bus {

/// Nothing ends the guardian before it has stopped the devices. [setup]
inline void ignore_signals() {
    for (const int signal :
         {SIGINT, SIGTERM, SIGHUP, SIGQUIT, SIGPIPE, SIGUSR1, SIGUSR2, SIGTSTP, SIGXFSZ}) {
        ::signal(signal, SIG_IGN);
    }
}

/// Locks the memory, raises the priority. Each of these is an improvement that the system may deny.
/// [setup]
inline void be_resident() {
    mlockall(MCL_CURRENT | MCL_FUTURE);
    const sched_param priority{.sched_priority = guardian_priority};
    if (sched_setscheduler(0, SCHED_FIFO | SCHED_RESET_ON_FORK, &priority) != 0) {
        setpriority(PRIO_PROCESS, 0, -10);
    }
    const int fd = ::open("/proc/self/oom_score_adj", O_WRONLY | O_CLOEXEC);
    if (fd >= 0) {
        [[maybe_unused]] const ssize_t written = ::write(fd, "-1000", 5);
        ::close(fd);
    }
}

/// Closes what was inherited but the descriptors of a guardian, and opens the process that started
/// it; an empty descriptor: it has ended already. A guardian that is suspended is continued by the
/// kernel when that process, or the thread of it that started the guardian, ends. [setup]
inline link::Descriptor open_parent(const char* pid_text) {
    prctl(PR_SET_PDEATHSIG, SIGCONT);
    syscall(SYS_close_range, guardian_lock_fd + 1, ~0U, 0);
    const auto pid = static_cast<pid_t>(std::atoi(pid_text));
    link::Descriptor parent(static_cast<int>(syscall(SYS_pidfd_open, pid, 0)));
    if (getppid() != pid) return link::Descriptor();
    return parent;
}

/// Maps the memory that the component shares. Returns nullptr when it has another size. [setup]
inline void* map_guardian_memory(std::size_t size) {
    struct stat memory{};
    if (fstat(guardian_memory_fd, &memory) != 0 ||
        static_cast<std::size_t>(memory.st_size) != size) {
        return nullptr;
    }
    void* const mapped = mmap(nullptr, size, PROT_READ | PROT_WRITE, MAP_SHARED | MAP_POPULATE,
                              guardian_memory_fd, 0);
    return mapped == MAP_FAILED ? nullptr : mapped;
}

/// Returns what the component has written for the guardian. [setup]
inline std::string read_guardian_text() {
    std::string text;
    std::array<char, 4096> part;
    lseek(guardian_text_fd, 0, SEEK_SET);
    while (true) {
        const ssize_t count = ::read(guardian_text_fd, part.data(), part.size());
        if (count <= 0) return text;
        text.append(part.data(), static_cast<std::size_t>(count));
    }
}

}  // namespace hal::bus
