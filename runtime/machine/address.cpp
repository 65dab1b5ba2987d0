// SPDX-License-Identifier: MIT
#include "machine/address.hpp"

#include <algorithm>
#include <cstdlib>
#include <filesystem>

#include <fcntl.h>
#include <sys/file.h>
#include <unistd.h>

namespace hal {
namespace {

constexpr std::string_view lock_ending = ".lock";

/// True when a living process holds the lock of this file.
bool held(const std::string& path) {
    const int file = open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NOFOLLOW);
    if (file < 0) return false;
    const bool free = flock(file, LOCK_SH | LOCK_NB) == 0;
    close(file);
    return !free;
}

}  // namespace

bool good_instance_name(std::string_view name) {
    const auto good = [](char c) {
        return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') ||
               c == '-' || c == '_' || c == '.';
    };
    return !name.empty() && name.size() <= 64 && name[0] != '.' &&
           std::all_of(name.begin(), name.end(), good);
}

std::string socket_folder() {
    const char* const runtime = std::getenv("XDG_RUNTIME_DIR");
    if (runtime && runtime[0] == '/') return std::string(runtime) + "/halcyon";
    return "/tmp/halcyon-" + std::to_string(getuid());
}

std::string socket_path(std::string_view name) {
    return socket_folder() + "/" + std::string(name) + ".sock";
}

bool was_killed(std::string_view name) {
    constexpr int looks = 100;

    constexpr int apart_us =
        10'000;  // the kernel closes the connections of a killed process a little before its lock
    for (int i = 0; i < looks && access(socket_path(name).c_str(), F_OK) == 0; ++i) {
        if (!held(lock_path(name))) return true;
        usleep(apart_us);
    }
    return false;
}
std::string lock_path(std::string_view name) {
    return socket_folder() + "/" + std::string(name) + std::string(lock_ending);
}

std::vector<std::string> running_instances() {
    std::vector<std::string> names;
    std::error_code ignored;
    for (const auto& entry : std::filesystem::directory_iterator(socket_folder(), ignored)) {
        const std::string file = entry.path().filename().string();
        if (!file.ends_with(lock_ending) || !held(entry.path().string())) continue;
        names.push_back(file.substr(0, file.size() - lock_ending.size()));
    }
    std::sort(names.begin(), names.end());
    return names;
}

std::string instance_wanted(std::string_view wanted) {
    if (!wanted.empty()) return std::string(wanted);
    if (const char* const named = std::getenv("HALCYON_INSTANCE"); named && *named) return named;
    const auto running = running_instances();
    return running.size() == 1 ? running[0] : "default";
}

}  // namespace hal
