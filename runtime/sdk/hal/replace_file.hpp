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

/// Where the bytes go: a file that replaces another one, or a new one.
struct Replacement {
    std::string target;
    bool exists = false;
    struct stat about{};  ///< of the existing file
};

/// Finds the file that a path names. Returns the reason when it cannot be replaced, or "".
inline std::string find_target(const std::string& path, Replacement& to) {
    to.target = path;
    if (!to.exists) {
        struct stat link{};
        if (::lstat(path.c_str(), &link) == 0) return "it is a symbolic link to nothing";
        return {};
    }
    char* const real = ::realpath(path.c_str(), nullptr);
    if (!real) return std::strerror(errno);
    to.target = real;
    std::free(real);
    if (::faccessat(AT_FDCWD, to.target.c_str(), W_OK, AT_EACCESS) != 0) {
        return std::strerror(errno);
    }
    return {};
}

inline std::string folder_of(const std::string& file) {
    const auto slash = file.rfind('/');
    if (slash == std::string::npos) return ".";
    if (slash == 0) return "/";
    return file.substr(0, slash);
}

/// Creates a file with a new name in a folder. Returns its descriptor; -1 with errno.
inline int create_part(const std::string& folder, std::string& name) {
    static std::atomic<unsigned> number{0};
    for (int turn = 0; turn < 100; ++turn) {
        name = folder + "/.hal-" + std::to_string(::getpid()) + "-" + std::to_string(number++) +
               ".part";
        const int file = ::open(name.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0666);
        if (file >= 0 || errno != EEXIST) return file;
    }
    return -1;
}

/// Writes the bytes to the disk, with owner and permissions of the file that is replaced, and
/// closes. Returns 0 or errno.
inline int fill(int file, const Replacement& to, std::string_view bytes) {
    // another user's file in a folder of ours
    if (to.exists && ::fchown(file, to.about.st_uid, to.about.st_gid) != 0) {
        errno = 0;
    }
    const bool good = write_whole(file, bytes) &&
                      (!to.exists || ::fchmod(file, to.about.st_mode & 07777) == 0) &&
                      ::fsync(file) == 0;
    const int why = errno;
    const bool closed = ::close(file) == 0;
    if (!good) return why;
    return closed ? 0 : errno;
}

inline void sync_folder(const std::string& folder) {
    const int entry = ::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
    if (entry < 0) return;
    ::fsync(entry);
    ::close(entry);
}

}  // namespace detail

/// Replaces the content of a file, or creates the file. A reader finds, even after a failure (a
/// full disk, a crash), the old content or the new one, never a part of it: the bytes go to a file
/// beside it, to the disk, and then take the name. An existing file keeps its permissions, and its
/// owner where that is allowed; a symbolic link stays one. Returns the reason of a failure, or an
/// empty string.
inline std::string replace_file(const std::string& path, std::string_view bytes) {
    detail::Replacement to;
    to.exists = ::stat(path.c_str(), &to.about) == 0;
    if (to.exists && S_ISDIR(to.about.st_mode)) return std::strerror(EISDIR);
    const bool special = path.starts_with("/dev/") || path.starts_with("/proc/") ||
                         (to.exists && !S_ISREG(to.about.st_mode));
    if (special) return detail::write_in_place(path, bytes);
    if (std::string problem = detail::find_target(path, to); !problem.empty()) return problem;
    const std::string folder = detail::folder_of(to.target);
    std::string part;
    const int file = detail::create_part(folder, part);
    if (file < 0) return std::strerror(errno);
    int error = detail::fill(file, to, bytes);
    if (error == 0 && ::rename(part.c_str(), to.target.c_str()) != 0) {
        error = errno;
    }
    if (error != 0) {
        ::unlink(part.c_str());
        return std::strerror(error);
    }
    detail::sync_folder(folder);  // the new name, too, is on the disk
    return {};
}

}  // namespace hal
