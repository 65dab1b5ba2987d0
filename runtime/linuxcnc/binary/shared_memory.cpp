// SPDX-License-Identifier: MIT
// Shared memory by key: System V segments of mode 0600, which LinuxCNC's programs open by the same
// keys.
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <iterator>
#include <sys/ipc.h>
#include <sys/shm.h>
#include <unistd.h>

#include "linuxcnc/binary/rtapi_interface.hpp"
#include "linuxcnc/binary/segments.hpp"

namespace hal::modules {
namespace {

struct Segment {
    int key = 0;
    int comp = 0;
    int users = 0;
    int id = -1;
    void* address = nullptr;
    std::size_t size = 0;
};
Segment segments[64];

/// The process that detaches last removes the segment.
void detach(Segment& segment) noexcept {
    shmid_ds state{};
    shmdt(segment.address);
    if (shmctl(segment.id, IPC_STAT, &state) == 0 && state.shm_nattch == 0) {
        shmctl(segment.id, IPC_RMID, nullptr);
    }
    segment = {};
}

/// The living process, other than this one, that made the segment to run modules on it: a machine,
/// or LinuxCNC itself. 0: none. The second would clear the memory of the first.
pid_t other_machine(int id) noexcept {
    shmid_ds state{};
    if (shmctl(id, IPC_STAT, &state) != 0 || state.shm_cpid == getpid() || state.shm_nattch == 0) {
        return 0;
    }
    char path[40], name[32] = "";
    std::snprintf(path, sizeof path, "/proc/%ld/comm", static_cast<long>(state.shm_cpid));
    std::FILE* const file = std::fopen(path, "re");
    if (!file) return 0;
    if (!std::fgets(name, sizeof name, file)) {
        *name = '\0';
    }
    std::fclose(file);
    const bool machine = std::strcmp(name, "hal\n") == 0 || std::strcmp(name, "halrun\n") == 0 ||
                         std::strncmp(name, "rtapi", 5) == 0;
    return machine ? state.shm_cpid : 0;
}

Segment* segment_of(int handle) {
    return handle >= 0 && handle < static_cast<int>(std::size(segments)) &&
                   segments[handle].users > 0
               ? &segments[handle]
               : nullptr;
}

}  // namespace

void each_segment(int comp, void (*action)(void* self, const void* begin, unsigned long bytes),
                  void* self) {
    for (const Segment& segment : segments) {
        if (segment.users > 0 && segment.comp == comp) {
            action(self, segment.address, segment.size);
        }
    }
}

void release_segments(int comp) noexcept {
    for (Segment& segment : segments) {
        if (segment.users > 0 && segment.comp == comp) {
            detach(segment);
        }
    }
}

}  // namespace hal::modules

using namespace hal::modules;

extern "C" {

int rtapi_shmem_new(int key, int comp, unsigned long size) {
    if (in_cycle) return -EPERM;
    Segment* place = nullptr;
    for (Segment& segment : segments) {
        if (segment.users > 0 && segment.key == key) {
            ++segment.users;
            return static_cast<int>(&segment - segments);
        }
        if (segment.users == 0 && !place) {
            place = &segment;
        }
    }
    if (!place) return -ENOMEM;
    const int id = shmget(key, size, IPC_CREAT | 0600);
    if (id < 0) {
        const int why = errno;
        rtapi_print_msg(RTAPI_MSG_ERR,
                        "shared memory with key 0x%x, %lu bytes: %s; ipcs -m lists the segments, "
                        "ipcrm -M 0x%x removes this one\n",
                        static_cast<unsigned>(key), size, std::strerror(why),
                        static_cast<unsigned>(key));
        return -why;
    }
    if (const pid_t other = runs_modules ? other_machine(id) : 0; other != 0) {
        rtapi_print_msg(RTAPI_MSG_ERR,
                        "shared memory with key 0x%x belongs to another machine, process %ld; end "
                        "that one, or give each a key (motmod: "
                        "key=, [EMCMOT]SHMEM_KEY)\n",
                        static_cast<unsigned>(key), static_cast<long>(other));
        return -EBUSY;
    }
    void* const address = shmat(id, nullptr, 0);
    if (address == reinterpret_cast<void*>(-1)) return -errno;
    *place = {key, comp, 1, id, address, size};
    // each page is touched now: no page fault in a cycle
    for (std::size_t at = 0; at < size; at += 4096) {
        __atomic_fetch_or(static_cast<char*>(address) + at, 0, __ATOMIC_RELAXED);
    }
    return static_cast<int>(place - segments);
}

int rtapi_shmem_getptr(int handle, void** address) {
    const Segment* const segment = segment_of(handle);
    if (!segment || !address) return -EINVAL;
    *address = segment->address;
    return 0;
}

int rtapi_shmem_delete(int handle, int) {
    Segment* const segment = segment_of(handle);
    if (!segment) return -EINVAL;
    if (--segment->users == 0) {
        detach(*segment);
    }
    return 0;
}
}
