// SPDX-License-Identifier: MIT
#include "leftovers.hpp"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <chrono>
#include <cstdio>
#include <filesystem>
#include <string>

namespace hal::dds {
namespace {

namespace fs = std::filesystem;
constexpr auto fresh = std::chrono::seconds(10);  // its owner may be about to lock it

bool removed(const fs::path& lock, const fs::path& segment) {
    std::error_code none;
    const auto since = fs::last_write_time(lock, none);
    if (none || fs::file_time_type::clock::now() - since < fresh) return false;
    const int file = ::open(lock.c_str(), O_RDONLY | O_CLOEXEC | O_NOFOLLOW);
    if (file < 0) return false;
    const bool dead = ::flock(file, LOCK_EX | LOCK_NB) == 0 && fs::remove(segment, none);
    if (dead) {
        fs::remove(lock, none);
    }
    ::close(file);
    return dead;
}

}  // namespace

void remove_leftovers() {
    int count = 0;
    std::uintmax_t bytes = 0;
    std::error_code none;
    for (auto at = fs::directory_iterator("/dev/shm", none);
         !none && at != fs::directory_iterator(); at.increment(none)) {
        const std::string name = at->path().filename().string();
        if (!name.starts_with("fastrtps_") || name.starts_with("fastrtps_port") ||
            !name.ends_with("_el")) {
            continue;
        }
        fs::path segment = at->path();
        segment.replace_filename(name.substr(0, name.size() - 3));
        std::error_code unknown;
        const auto size = fs::file_size(segment, unknown);
        if (unknown || !removed(at->path(), segment)) continue;
        ++count;
        bytes += size;
    }
    if (count == 0) return;
    char line[160];
    std::snprintf(
        line, sizeof line,
        "dds: removed %d shared memory segment%s of killed processes from /dev/shm (%.1f MB)\n",
        count, count == 1 ? "" : "s", static_cast<double>(bytes) * 1e-6);
    std::fputs(line, stderr);
}

}  // namespace hal::dds
