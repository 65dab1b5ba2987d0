// SPDX-License-Identifier: MIT
#include "recording/mcap/held_file.hpp"

#include <cerrno>
#include <cstdio>
#include <cstring>
#include <filesystem>

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

namespace hal::mcap {
namespace {

// The end of symbolic links, which need not exist yet.
std::string followed(const std::string& path) {
    std::filesystem::path at = path;
    std::error_code error;
    for (int links = 0; links < 40 && std::filesystem::is_symlink(at, error); ++links) {
        const std::filesystem::path next = std::filesystem::read_symlink(at, error);
        if (error) break;
        at = next.is_absolute() ? next : at.parent_path() / next;
    }
    return at.string();
}

std::string not_a_file(const std::string& path) {
    struct stat about{};
    if (::stat(path.c_str(), &about) != 0 || S_ISREG(about.st_mode)) return "";
    return S_ISDIR(about.st_mode) ? "it is a folder; name a file in it"
                                  : "it is a pipe or a device; name a file";
}

bool same_file(int file, const std::string& path) {
    struct stat open{}, named{};
    return ::fstat(file, &open) == 0 && ::stat(path.c_str(), &named) == 0 &&
           open.st_dev == named.st_dev && open.st_ino == named.st_ino;
}

// Gives what an earlier recorder left a name that is free. Nobody else renames it: it is locked.
std::string set_aside(const std::string& part, const std::string& target) {
    const std::filesystem::path whole = target;
    const std::string base = (whole.parent_path() / whole.stem()).string();

    const std::string ending = whole.extension().string();
    for (int n = 1; n < 1000; ++n) {
        const std::string number = std::to_string(n);
        std::string name =
            base + "-unfinished-" + std::string(3 - number.size(), '0') + number + ending;
        struct stat about{};
        if (::lstat(name.c_str(), &about) == 0) continue;
        return std::rename(part.c_str(), name.c_str()) == 0 ? name : "";
    }
    errno = EEXIST;
    return "";
}

/// Opens a file for one recorder, and empties it. Another recorder that has it fails with EBUSY. A
/// part that a killed recorder left behind is kept under another name, in HeldFile::kept. The file
/// is opened again when it was replaced between opening and locking it.
HeldFile hold(const std::string& path, bool part) {
    HeldFile held;
    held.target = followed(path);
    held.path = part ? held.target + ".part" : held.target;
    const auto failed = [&](int error, std::string sentence) {
        if (held.file >= 0) {
            ::close(held.file);
        }
        held.file = -1;
        held.error = error;
        held.problem = sentence.empty() ? std::strerror(error) : std::move(sentence);
        return held;
    };
    for (const std::string& name : {held.target, held.path}) {
        if (std::string reason = not_a_file(name); !reason.empty()) {
            return failed(EINVAL, std::move(reason));
        }
    }
    for (int attempt = 0; attempt < 100; ++attempt) {
        held.file =
            ::open(held.path.c_str(), O_WRONLY | O_CREAT | O_CLOEXEC | O_NONBLOCK | O_NOCTTY,
                   part ? 0640 : 0666);
        if (held.file < 0) return failed(errno, "");
        // a file system without locks: as before
        if (::flock(held.file, LOCK_EX | LOCK_NB) != 0 && errno == EWOULDBLOCK) {
            return failed(EBUSY,
                          "another recorder is writing it; end that one, or name another file");
        }
        struct stat about{};
        // else the other recorder has just completed it
        const bool current = same_file(held.file, held.path);
        if (current && ::fstat(held.file, &about) != 0) return failed(errno, "");
        if (current && (!part || about.st_size == 0)) {
            if (about.st_size != 0 && ::ftruncate(held.file, 0) != 0) return failed(errno, "");
            return held;
        }
        if (current) {
            held.kept = set_aside(held.path, held.target);
            if (held.kept.empty()) return failed(errno, "");
        }
        ::close(held.file);
        held.file = -1;
    }
    return failed(EBUSY, "");
}

}  // namespace

std::string unwritable(const std::string& path) {
    const std::string target = followed(path);
    if (std::string reason = not_a_file(target); !reason.empty()) return reason;
    std::string name = target + ".XXXXXX";
    const int file = ::mkstemp(name.data());
    if (file < 0) return std::strerror(errno);
    ::close(file);
    ::unlink(name.c_str());
    return "";
}

HeldFile hold_part(const std::string& path) { return hold(path, true); }
HeldFile hold_file(const std::string& path) { return hold(path, false); }

}  // namespace hal::mcap
