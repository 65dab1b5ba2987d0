// SPDX-License-Identifier: MIT
// Reading a file that a user names. Opening a FIFO would block until another process writes into
// it, and a device may never end: only regular files are read.
#pragma once

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

/// Reads a whole regular file of at most `max_bytes` bytes. False: `bytes` is the reason. With
/// `descriptors`, a file that was opened for this process (/dev/fd/N) may be a pipe, too. [setup]
inline bool read_regular_file(const std::string& path, std::size_t max_bytes, std::string& bytes,
                              bool descriptors = false) {
    const auto take = [](void* taken, const char* text, std::size_t size) {
        static_cast<std::string*>(taken)->assign(text, size);
    };
    if (hal_editor_text != nullptr && hal_editor_text(path.c_str(), take, &bytes)) return true;
    const bool any = descriptors && names_descriptor(path);
    const int file = ::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NOCTTY | (any ? 0 : O_NONBLOCK));
    struct stat about{};
    std::string problem;
    bytes.clear();
    if (file < 0 || ::fstat(file, &about) != 0) {
        problem =
            errno == ENXIO ? "it is a socket or a device without a driver" : std::strerror(errno);
    } else if (!any || S_ISDIR(about.st_mode)) {
        problem = special_kind(about.st_mode);
    }
    if (problem.empty() && S_ISREG(about.st_mode) && about.st_size > 0) {
        bytes.reserve(static_cast<std::size_t>(about.st_size) < max_bytes
                          ? static_cast<std::size_t>(about.st_size) + 1
                          : max_bytes);
    }
    char part[65536];
    while (problem.empty()) {
        const ssize_t got = ::read(file, part, sizeof part);
        if (got == 0) break;
        if (got < 0 && errno == EINTR) continue;
        if (got < 0) {
            problem = std::strerror(errno);
        } else if (bytes.size() + static_cast<std::size_t>(got) > max_bytes) {
            problem = "it is longer than " + std::to_string(max_bytes) + " bytes";
        } else {
            bytes.append(part, static_cast<std::size_t>(got));
        }
    }
    if (file >= 0) {
        ::close(file);
    }
    if (problem.empty()) return true;
    bytes = problem;
    return false;
}

}  // namespace hal
