// SPDX-License-Identifier: MIT
// What a guardian did after the end of its machine, for the next start. [setup]
#pragma once

#include <fcntl.h>
#include <poll.h>
#include <stdlib.h>
#include <sys/stat.h>
#include <time.h>
#include <unistd.h>

#include <algorithm>
#include <filesystem>
#include <string>
#include <system_error>

#include "bus/guardian/report_lock.hpp"
#include "hal/read_file.hpp"
#include "hal/system_log.hpp"
#include "link/system.hpp"

namespace hal::bus {

/// Returns what is stated of a report that was cut.
inline std::string cut_reason() {
    return "it could not be written whole (disk full?); the system's log may have it";
}

/// Returns the file in which a guardian of a link leaves what it did; empty: there is no folder for
/// it. Creates the folder.
inline std::string report_file(const std::string& link) {
    namespace fs = std::filesystem;
    const char* const state = std::getenv("XDG_STATE_HOME");
    const char* const home = std::getenv("HOME");
    fs::path folder;
    if (state != nullptr && state[0] == '/') {
        folder = state;
    } else if (home != nullptr && home[0] == '/') {
        folder = fs::path(home) / ".local/state";
    } else {
        return {};
    }
    folder /= "halcyon";
    std::error_code none;
    fs::create_directories(folder, none);
    std::string name = "guardian-" + link;
    std::replace_if(name.begin(), name.end(),
                    [](char c) { return c == '/' || c == ':' || c == '?' || c == '&'; }, '-');
    return (folder / name).string();
}

/// Marks a report that has no file: the length of its lock needs no space on a full disk.
inline void mark_lost(const char* report) {
    const link::Descriptor lock(
        ::open(lock_file(report).c_str(), O_WRONLY | O_CLOEXEC | O_NOFOLLOW));
    if (lock && ::ftruncate(lock.get(), 1) == 0) {
        ::fsync(lock.get());
    }
}

/// Returns whether a report is marked as lost, and removes the mark.
inline bool take_mark(const std::string& report) {
    const link::Descriptor lock(::open(lock_file(report).c_str(), O_RDWR | O_CLOEXEC | O_NOFOLLOW));
    struct stat status{};
    if (!lock || ::fstat(lock.get(), &status) != 0 || status.st_size == 0) return false;
    return ::ftruncate(lock.get(), 0) == 0;
}

/// Returns the content of the file and deletes it. States what is known of a report that is
/// incomplete, because its last character, a line end, is missing, or that has no file.
inline std::string take_report(const std::string& file) {
    constexpr std::size_t max_bytes = 65536;  // of a line with 247 slaves: 15000
    if (file.empty()) return {};
    const bool is_lost = take_mark(file);
    std::string text;
    if (!read_regular_file(file, max_bytes, text)) {
        if (!is_lost) return {};
        text.clear();  // has the reason
    }
    ::unlink(file.c_str());
    if (text.empty()) return "the process has ended; the report is lost: " + cut_reason();
    if (text.back() != '\n') return text + " … the rest is lost: " + cut_reason();
    while (!text.empty() && text.back() == '\n') {
        text.pop_back();
    }
    return text;
}

/// Writes the entry of a file in its folder to the disk.
inline bool keep_name(const char* file) {
    const std::filesystem::path folder = std::filesystem::path(file).parent_path();
    const link::Descriptor fd(::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC));
    return fd && ::fsync(fd.get()) == 0;
}

/// Writes the file to the disk; an empty name: nothing. Returns false when it is incomplete or
/// missing, of which the next start reads one or the other.
inline bool keep_report(const char* file, const std::string& text) {
    if (file[0] == '\0') return true;
    const link::Descriptor fd(
        ::open(file, O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC | O_NOFOLLOW, 0600));
    if (!fd) {
        mark_lost(file);
        return false;
    }
    if (!write_whole(fd.get(), text + "\n")) return false;
    return ::fsync(fd.get()) == 0 && keep_name(file);
}

/// Prints a line on standard error, whose reader has a second to accept it.
inline bool print_report(const std::string& line) {
    pollfd output{STDERR_FILENO, POLLOUT, 0};
    if (::poll(&output, 1, 1000) <= 0) return false;
    return write_whole(STDERR_FILENO, line);
}

/// Reports in the file, and then on standard error, whose reader may make it wait; what one of them
/// does not accept whole goes to the system's log as well. `name`: of the instance.
inline void report_end(const char* name, const char* file, const std::string& text) {
    const std::string line = std::string(name) + ": guardian: " + text + "\n";
    const bool kept = keep_report(file, text);
    const bool printed = print_report(line);
    if (!printed || !kept) {
        write_system_log("hal-guardian", line);
    }
}

/// Returns "2026-11-28 12:00:00, ".
inline std::string report_time() {
    char text[32];
    const time_t seconds = time(nullptr);
    tm local{};
    localtime_r(&seconds, &local);
    strftime(text, sizeof text, "%Y-%m-%d %H:%M:%S, ", &local);
    return text;
}

}  // namespace hal::bus
