// SPDX-License-Identifier: MIT
// Reading a file that a user names. Opening a FIFO would block until another process writes into
// it, and a device may never end: only regular files are read.
#pragma once

#include <algorithm>
#include <cerrno>
#include <cstddef>
#include <cstring>
#include <string>
#include <string_view>

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include "hal/abi.h"

/// Defined by `hal lsp` only: passes the text that an editor has of the file at `path`, which takes
/// precedence over what is on the disk, to `take`. Returns false for a file that no editor has
/// open. [setup]
extern "C" HAL_EXPORT __attribute__((weak)) bool hal_editor_text(
    const char* path, void (*take)(void* bytes, const char* text, std::size_t size), void* bytes);

namespace hal {

/// What kind of file it is, in words; empty for a regular file. [any]
inline const char* special_kind(mode_t mode) {
    if (S_ISREG(mode)) return "";
    if (S_ISDIR(mode)) return "it is a directory";
    if (S_ISFIFO(mode)) return "it is a FIFO, not a regular file";
    if (S_ISSOCK(mode)) return "it is a socket, not a regular file";
    return "it is a device, not a regular file";
}

/// A descriptor that this process was given, as the shell's `<(command)` names it.
inline bool names_descriptor(std::string_view path) {
    return path == "/dev/stdin" || path.starts_with("/dev/fd/") ||
           path.starts_with("/proc/self/fd/");
}

/// Appends what an open file has, at most `max_bytes` in all. Returns the problem; empty: none.
inline std::string append_file(int file, std::size_t max_bytes, std::string& bytes) {
    char part[65536];
    while (true) {
        const ssize_t got = ::read(file, part, sizeof part);
        if (got == 0) return {};
        if (got < 0 && errno == EINTR) continue;
        if (got < 0) return std::strerror(errno);
        if (bytes.size() + static_cast<std::size_t>(got) > max_bytes) {
            return "it is longer than " + std::to_string(max_bytes) + " bytes";
        }
        bytes.append(part, static_cast<std::size_t>(got));
    }
}

/// Opens a file; with `any_kind` a pipe as well. Returns the descriptor, or -1 with the problem.
inline int open_for_reading(const std::string& path, bool any_kind, struct stat& about,
                            std::string& problem) {
    const int mode = any_kind ? 0 : O_NONBLOCK;
    const int file = ::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NOCTTY | mode);
    if (file < 0 || ::fstat(file, &about) != 0) {
        problem =
            errno == ENXIO ? "it is a socket or a device without a driver" : std::strerror(errno);
    } else if (!any_kind || S_ISDIR(about.st_mode)) {
        problem = special_kind(about.st_mode);
    }
    return file;
}

/// Reads a whole regular file of at most `max_bytes` bytes. False: `bytes` is the reason. With
/// `descriptors`, a file that was opened for this process (/dev/fd/N) may be a pipe, too. [setup]
inline bool read_regular_file(const std::string& path, std::size_t max_bytes, std::string& bytes,
                              bool descriptors = false) {
    const auto take = [](void* taken, const char* text, std::size_t size) {
        static_cast<std::string*>(taken)->assign(text, size);
    };
    if (hal_editor_text != nullptr && hal_editor_text(path.c_str(), take, &bytes)) return true;
    bytes.clear();
    struct stat about{};
    std::string problem;
    const int file = open_for_reading(path, descriptors && names_descriptor(path), about, problem);
    if (problem.empty()) {
        const auto size = static_cast<std::size_t>(S_ISREG(about.st_mode) ? about.st_size : 0);
        bytes.reserve(std::min(size, max_bytes));
        problem = append_file(file, max_bytes, bytes);
    }
    if (file >= 0) {
        ::close(file);
    }
    if (problem.empty()) return true;
    bytes = problem;
    return false;
}

}  // namespace hal
