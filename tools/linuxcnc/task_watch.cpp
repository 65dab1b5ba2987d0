// SPDX-License-Identifier: MIT
#include "linuxcnc/task_watch.hpp"

#include <algorithm>
#include <cstring>
#include <fstream>
#include <iterator>
#include <sstream>
#include <sys/ipc.h>
#include <sys/shm.h>
#include <vector>

#include "text/numbers.hpp"

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
    std::ifstream file(nml);
    // B NAME SHMEM HOST SIZE 0 0 NUMBER PROCESSES KEY …
    for (std::string line; std::getline(file, line);) {
        std::istringstream in(line);
        const std::vector<std::string> words{std::istream_iterator<std::string>(in), {}};
        if (words.size() < 10 || words[0] != "B" || words[1] != name || words[2] != "SHMEM") {
            continue;
        }
        const auto processes = parse_natural(words[8]);
        const auto key = parse_natural(words[9]);
        if (!key || !processes || *processes > max_processes) {
            return {};
        }
        return {static_cast<key_t>(*key),
                name_bytes + static_cast<std::size_t>(*processes) + sizeof(std::int64_t)};
    }
    return {};
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
