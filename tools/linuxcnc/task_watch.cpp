// SPDX-License-Identifier: MIT
#include "linuxcnc/task_watch.hpp"

#include <algorithm>
#include <cstring>
#include <sys/ipc.h>
#include <sys/shm.h>
#include <vector>

#include "linuxcnc/nml_buffers.hpp"

namespace hal::tools {

namespace {

// a longer one is a time without CPU, which task may not have had either
constexpr std::int64_t max_step_ns = 100'000'000;

// A buffer begins with its name in 32 bytes and a byte for each process, then a header of three
// `long`: read since the last write, number of writes, size.
constexpr std::size_t name_bytes = 32;
constexpr std::size_t max_processes = 1000;

struct Buffer {
    key_t key = -1;
    std::size_t writes_offset = 0;
};

/// The buffer of that name in an NML configuration; key -1: there is none in shared memory.
Buffer buffer_of(const std::string& nml, const std::string& name) {
    const std::vector<NmlBuffer> all = shared_nml_buffers(nml);
    const auto found = std::ranges::find(all, name, &NmlBuffer::name);
    const bool is_usable =
        found != all.end() && found->key && found->processes && *found->processes <= max_processes;
    if (!is_usable) return {};
    return {*found->key, name_bytes + *found->processes + sizeof(std::int64_t)};
}

std::int64_t number_at(const char* memory) {
    std::int64_t number = 0;
    std::memcpy(&number, memory, sizeof number);
    return number;
}

}  // namespace

TaskWatch::~TaskWatch() {
    if (memory_) {
        ::shmdt(memory_);
    }
}

void TaskWatch::attach() {
    using namespace std::chrono_literals;
    if (Clock::now() - attached_ < 500ms) return;
    attached_ = Clock::now();
    const Buffer buffer = buffer_of(nml_, "emcStatus");
    const int id = buffer.key == -1 ? -1 : ::shmget(buffer.key, 0, 0);
    shmid_ds segment{};
    if (id < 0 || ::shmctl(id, IPC_STAT, &segment) != 0 ||
        segment.shm_segsz < buffer.writes_offset + sizeof(std::int64_t)) {
        return;
    }
    void* const memory = ::shmat(id, nullptr, SHM_RDONLY);
    if (memory == reinterpret_cast<void*>(-1)) return;
    memory_ = memory;
    writes_ = static_cast<const char*>(memory) + buffer.writes_offset;
    seen_ = number_at(writes_);
    looked_ = Clock::now();
}

std::int64_t TaskWatch::silent_ns() {
    if (timeout_ns_ == 0) return 0;
    if (!writes_) {
        attach();
    }
    if (!writes_) return 0;
    const Clock::time_point now = Clock::now();
    silent_ns_ += std::min(std::chrono::nanoseconds(now - looked_).count(), max_step_ns);
    looked_ = now;
    if (const std::int64_t writes = number_at(writes_); writes != seen_) {
        seen_ = writes;
        silent_ns_ = 0;
        beats_ = true;
    }
    return beats_ && silent_ns_ > timeout_ns_ ? silent_ns_ : 0;
}

}  // namespace hal::tools
