// SPDX-License-Identifier: MIT
// Atomic replacement of a file: the program and its components write all files for later reading in
// this way. [setup]
#pragma once

#include <atomic>
#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <string>
#include <string_view>

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

namespace hal {

namespace detail {

inline bool write_whole(int file, std::string_view bytes) {
    while (!bytes.empty()) {
        const ssize_t n = ::write(file, bytes.data(), bytes.size());
        if (n < 0 && errno == EINTR) continue;
        if (n <= 0) return false;
        bytes.remove_prefix(static_cast<std::size_t>(n));
    }
    return true;
}

/// A device, a pipe, or what a shell has opened: there is nothing to replace.
inline std::string write_in_place(const std::string& path, std::string_view bytes) {
    const int file = ::open(path.c_str(), O_WRONLY | O_TRUNC | O_CLOEXEC);
    if (file < 0) return std::strerror(errno);
    const bool good = write_whole(file, bytes);
    const int why = errno;
    if (::close(file) == 0 && good) {
        return {};
    }
    return std::strerror(good ? errno : why);
}

}  // namespace detail

/// Replaces the content of a file, or creates the file. A reader finds, even after a failure (a
/// full disk, a crash), the old content or the new one, never a part of it: the bytes go to a file
/// beside it, to the disk, and then take the name. An existing file keeps its permissions, and its
/// owner where that is allowed; a symbolic link stays one. Returns the reason of a failure, or an
/// empty string.
inline std::string replace_file(const std::string& path, std::string_view bytes) {
    struct stat about{};
    const bool exists = ::stat(path.c_str(), &about) == 0;
    if (exists && S_ISDIR(about.st_mode)) return std::strerror(EISDIR);
    if (path.starts_with("/dev/") || path.starts_with("/proc/") ||
        (exists && !S_ISREG(about.st_mode))) {
        return detail::write_in_place(path, bytes);
    }
    std::string target = path;
    if (exists) {
        char* const real = ::realpath(path.c_str(), nullptr);
        if (!real) return std::strerror(errno);
        target = real;
        std::free(real);
        if (::faccessat(AT_FDCWD, target.c_str(), W_OK, AT_EACCESS) != 0) {
            return std::strerror(errno);
        }
    } else if (struct stat link{}; ::lstat(path.c_str(), &link) == 0) {
        return "it is a symbolic link to nothing";
    }
    const auto slash = target.rfind('/');
    const std::string folder = slash == std::string::npos ? "."
                               : slash == 0               ? "/"
                                                          : target.substr(0, slash);
    static std::atomic<unsigned> number{0};
    std::string fresh;
    int file = -1;
    for (int turn = 0; file < 0 && turn < 100; ++turn) {
        fresh = folder + "/.hal-" + std::to_string(::getpid()) + "-" + std::to_string(number++) +
                ".part";
        file = ::open(fresh.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0666);
        if (file < 0 && errno != EEXIST) break;
    }
    if (file < 0) return std::strerror(errno);
    // another user's file in a folder of ours
    if (exists && ::fchown(file, about.st_uid, about.st_gid) != 0) {
        errno = 0;
    }
    bool good = detail::write_whole(file, bytes) &&
                (!exists || ::fchmod(file, about.st_mode & 07777) == 0) && ::fsync(file) == 0;
    int why = errno;
    if (::close(file) != 0 && good) {
        good = false;
        why = errno;
    }
    if (good && ::rename(fresh.c_str(), target.c_str()) != 0) {
        good = false;
        why = errno;
    }
    if (!good) {
        ::unlink(fresh.c_str());
        return std::strerror(why);
    }
    if (const int entry = ::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC); entry >= 0) {
        ::fsync(entry);  // the new name, too, is on the disk
        ::close(entry);
    }
    return {};
}

}  // namespace hal
