// SPDX-License-Identifier: MIT
#include "base/own_descriptors.hpp"

#include <array>
#include <atomic>
#include <mutex>

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

namespace hal {
namespace {

constexpr int closed = -1;

struct Entry {
    // the last to be written when the entry is used, the first when it is freed
    std::atomic<int> number{closed};
    std::atomic<const char*> name{nullptr};
    // of the file behind it; guarded by the mutex
    dev_t device = 0;
    ino_t file = 0;
};

std::array<Entry, 64> entries;
std::mutex entries_mutex;  // of writers, and of who reads `device` and `file`

/// With the mutex.
bool refers_to_file_of(const Entry& entry) noexcept {
    struct stat about{};
    if (fstat(entry.number.load(std::memory_order_relaxed), &about) != 0) return false;
    return about.st_dev == entry.device && about.st_ino == entry.file;
}

}  // namespace

void list_descriptor(int descriptor, const char* name) noexcept {
    struct stat about{};
    if (descriptor < 0 || fstat(descriptor, &about) != 0) return;
    const std::scoped_lock lock(entries_mutex);
    for (Entry& entry : entries) {
        if (entry.number.load(std::memory_order_relaxed) != closed) continue;
        entry.name.store(name, std::memory_order_relaxed);
        entry.device = about.st_dev;
        entry.file = about.st_ino;
        entry.number.store(descriptor, std::memory_order_release);
        return;
    }
}

void unlist_descriptor(int descriptor) noexcept {
    const std::scoped_lock lock(entries_mutex);
    for (Entry& entry : entries) {
        int listed = descriptor;
        entry.number.compare_exchange_strong(listed, closed);
    }
}

void close_own(int descriptor) noexcept {
    if (descriptor < 0) return;
    unlist_descriptor(descriptor);
    close(descriptor);
}

const char* own_descriptor(int descriptor) noexcept {
    if (descriptor < 0) return nullptr;
    for (const Entry& entry : entries) {
        if (entry.number.load(std::memory_order_acquire) == descriptor) return entry.name.load();
    }
    return nullptr;
}

int own_descriptor_within(unsigned first, unsigned last) noexcept {
    int lowest = closed;
    for (const Entry& entry : entries) {
        const int number = entry.number.load(std::memory_order_acquire);
        const bool within = number >= 0 && static_cast<unsigned>(number) >= first &&
                            static_cast<unsigned>(number) <= last;
        if (within && (lowest == closed || number < lowest)) {
            lowest = number;
        }
    }
    return lowest;
}

bool is_intact(int descriptor) noexcept {
    const std::scoped_lock lock(entries_mutex);
    for (const Entry& entry : entries) {
        if (entry.number.load(std::memory_order_relaxed) != descriptor) continue;
        if (!refers_to_file_of(entry)) return false;
    }
    return true;
}

bool find_lost_descriptor(LostDescriptor& lost) noexcept {
    const std::scoped_lock lock(entries_mutex);
    for (const Entry& entry : entries) {
        const int number = entry.number.load(std::memory_order_relaxed);
        if (number == closed) continue;
        if (refers_to_file_of(entry)) continue;
        const bool is_open = fcntl(number, F_GETFD) != -1;
        lost = {number, entry.name.load(std::memory_order_relaxed), is_open};
        return true;
    }
    return false;
}

// Without the mutex: another thread of the parent may have held it, and this process has no other
// thread.
void drop_descriptors_of_parent() noexcept {
    for (Entry& entry : entries) {
        const int number = entry.number.exchange(closed);
        if (number >= 0) {
            close(number);
        }
    }
}

}  // namespace hal
