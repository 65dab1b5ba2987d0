// SPDX-License-Identifier: MIT
#include "machine/processes/address.hpp"

#include <algorithm>
#include <array>
#include <cstdlib>

#include <fcntl.h>
#include <grp.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include "text/characters.hpp"
#include "text/folder_entries.hpp"

namespace hal {
namespace {

constexpr std::string_view lock_ending = ".lock";
constexpr const char* services = "/run/halcyon";  // a folder for each, made by systemd

std::string service_folder(std::string_view name) {
    return std::string(services) + "/" + std::string(name) + "/halcyon";
}

std::string lock_in(const std::string& folder, std::string_view name) {
    return folder + "/" + std::string(name) + std::string(lock_ending);
}

std::string socket_in(const std::string& folder, std::string_view name) {
    return folder + "/" + std::string(name) + ".sock";
}

/// The folder of a running instance: this user's, else that of a service; this user's when there is
/// neither.
std::string folder_of(std::string_view name) {
    std::string own = socket_folder();
    if (!good_instance_name(name) || access(lock_in(own, name).c_str(), F_OK) == 0) return own;
    std::string shared = service_folder(name);
    return access(lock_in(shared, name).c_str(), F_OK) == 0 ? shared : own;
}

/// True when no living process holds the lock of this file.
bool is_free(int file) {
    if (flock(file, LOCK_SH | LOCK_NB) != 0) return false;
    flock(file, LOCK_UN);
    return true;
}

/// True when a living process holds the lock of this file.
bool held(const std::string& path) {
    const int file = open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NOFOLLOW);
    if (file < 0) return false;
    const bool free = is_free(file);
    close(file);
    return !free;
}

/// Returns what a lock file contains; nothing when it cannot be read.
std::string read_lock(int file) {
    std::array<char, 32> text{};
    const ssize_t got = pread(file, text.data(), text.size(), 0);
    return {text.data(), static_cast<std::size_t>(std::max<ssize_t>(got, 0))};
}

/// True for a real folder of this user that nobody else can write to: not one that a link in /tmp
/// leads to.
bool is_own_folder(const std::string& folder) {
    struct stat about{};
    return lstat(folder.c_str(), &about) == 0 && S_ISDIR(about.st_mode) &&
           about.st_uid == geteuid() && (about.st_mode & 0022) == 0;
}

/// True when `file` contains a process ID or nothing (its process died before it wrote it).
bool has_process_id(int file) {
    std::array<char, 32> text{};
    const ssize_t got = pread(file, text.data(), text.size(), 0);
    if (got < 0) return false;
    const std::string_view content(text.data(), static_cast<std::size_t>(got));
    return content.empty() || (content.ends_with('\n') &&
                               content.find_first_not_of("0123456789") == content.size() - 1);
}

/// True when `path` names `file` and nothing newer.
bool is_named(int file, const std::string& path) {
    struct stat opened{}, named{};
    return fstat(file, &opened) == 0 && lstat(path.c_str(), &named) == 0 &&
           S_ISREG(opened.st_mode) && opened.st_ino == named.st_ino &&
           opened.st_dev == named.st_dev;
}

bool is_socket_or_absent(const std::string& path) {
    struct stat about{};
    return lstat(path.c_str(), &about) != 0 || S_ISSOCK(about.st_mode);
}

/// Removes the socket and the lock file of an instance whose process is dead. The lock is held
/// meanwhile: an instance of this name that starts just now waits for it, finds its file removed,
/// and makes another one.
void remove_left_behind(const std::string& name) {
    const std::string lock = lock_path(name);
    const std::string socket = socket_path(name);
    const int file = open(lock.c_str(), O_RDWR | O_CLOEXEC | O_NOFOLLOW | O_NONBLOCK);
    if (file < 0) return;
    if (flock(file, LOCK_EX | LOCK_NB) == 0 && is_named(file, lock) && has_process_id(file) &&
        is_socket_or_absent(socket)) {
        unlink(socket.c_str());
        unlink(lock.c_str());
    }
    close(file);
}

}  // namespace

bool good_instance_name(std::string_view name) {
    return !name.empty() && name.size() <= 64 && name[0] != '.' &&
           std::ranges::all_of(name, is_name_character);
}

std::string socket_folder() {
    const char* const runtime = std::getenv("XDG_RUNTIME_DIR");
    if (runtime && runtime[0] == '/') return std::string(runtime) + "/halcyon";
    return "/tmp/halcyon-" + std::to_string(getuid());
}

std::string socket_path(std::string_view name) { return socket_in(socket_folder(), name); }

std::string found_socket(std::string_view name) { return socket_in(folder_of(name), name); }

std::string group_without_user(std::string_view name) {
    if (!good_instance_name(name)) return "";
    const std::string folder = service_folder(name);
    struct stat about{};
    if (stat(folder.c_str(), &about) != 0 || access(folder.c_str(), X_OK) == 0) return "";
    if ((about.st_mode & 0050) != 0050) return "";
    std::vector<char> text(std::size_t{1} << 16);
    group entry{};
    group* found = nullptr;
    if (getgrgid_r(about.st_gid, &entry, text.data(), text.size(), &found) == 0 && found) {
        return found->gr_name;
    }
    return std::to_string(about.st_gid);
}

std::string lock_content(std::int64_t pid) { return std::to_string(pid) + "\n"; }

InstanceWitness::~InstanceWitness() {
    if (file_ >= 0) {
        close(file_);
    }
}

void InstanceWitness::watch(std::string_view name, std::int64_t pid) {
    file_ = open(lock_in(folder_of(name), name).c_str(), O_RDONLY | O_CLOEXEC | O_NOFOLLOW);
    content_ = lock_content(pid);
}

InstanceEnd InstanceWitness::end() const {
    // the kernel closes the connections of a killed process a little before its lock
    constexpr int looks = 100;
    constexpr int apart_us = 10'000;
    for (int i = 0; i < looks; ++i) {
        const std::string content = read_lock(file_);
        if (content.empty()) return InstanceEnd::ended;
        // else another instance has it by now
        if (content != content_ || is_free(file_)) return InstanceEnd::killed;
        usleep(apart_us);
    }
    return InstanceEnd::running;
}

std::string lock_path(std::string_view name) { return lock_in(socket_folder(), name); }

std::vector<std::string> running_instances() {
    std::vector<std::string> names;
    const bool is_own = is_own_folder(socket_folder());
    for (const auto& path : folder_entries(socket_folder())) {
        const std::string file = path.filename().string();
        if (!file.ends_with(lock_ending)) continue;
        const std::string name = file.substr(0, file.size() - lock_ending.size());
        if (held(path.string())) {
            names.push_back(name);
        } else if (is_own && good_instance_name(name)) {
            remove_left_behind(name);
        }
    }
    for (const auto& path : folder_entries(services)) {
        const std::string name = path.filename().string();
        if (held(lock_in(service_folder(name), name))) {
            names.push_back(name);
        }
    }
    std::sort(names.begin(), names.end());
    // the folder of a service may be that of this process, too
    names.erase(std::unique(names.begin(), names.end()), names.end());
    return names;
}

std::string instance_wanted(std::string_view wanted) {
    if (!wanted.empty()) return std::string(wanted);
    if (const char* const named = std::getenv("HALCYON_INSTANCE"); named && *named) return named;
    const auto running = running_instances();
    return running.size() == 1 ? running[0] : "default";
}

}  // namespace hal
