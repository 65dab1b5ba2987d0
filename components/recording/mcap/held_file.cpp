// SPDX-License-Identifier: MIT
#include "recording/mcap/held_file.hpp"

#include <cerrno>
#include <cstdint>
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
/// part that a killed recorder left behind is kept under another name, in HeldFile::kept.
class Holder {
public:
    Holder(const std::string& path, bool part) : part_(part) {
        held_.target = followed(path);
        held_.path = part ? held_.target + ".part" : held_.target;
    }

    /// Opens again when the file was replaced between opening and locking it.
    HeldFile hold() {
        constexpr int max_attempts = 100;
        for (const std::string& name : {held_.target, held_.path}) {
            std::string reason = not_a_file(name);
            if (!reason.empty()) return failed(EINVAL, std::move(reason));
        }
        for (int attempt = 0; attempt < max_attempts; ++attempt) {
            if (!open()) return failed(errno);
            if (!lock()) {
                return failed(EBUSY,
                              "another recorder is writing it; end that one, or name another file");
            }
            switch (claim()) {
            case Claim::held: return held_;
            case Claim::failed: return failed(errno);
            case Claim::again: close(); break;
            }
        }
        return failed(EBUSY);
    }

private:
    enum class Claim : std::uint8_t { held, failed, again };

    bool open() {
        held_.file =
            ::open(held_.path.c_str(), O_WRONLY | O_CREAT | O_CLOEXEC | O_NONBLOCK | O_NOCTTY,
                   part_ ? 0640 : 0666);
        return held_.file >= 0;
    }

    /// Returns false when another recorder has it. A file system without locks has none.
    bool lock() const {
        return ::flock(held_.file, LOCK_EX | LOCK_NB) == 0 || errno != EWOULDBLOCK;
    }

    /// Takes the locked file, or moves what an earlier recorder left out of the way.
    Claim claim() {
        // another recorder has completed it between opening and locking
        if (!same_file(held_.file, held_.path)) return Claim::again;
        struct stat about{};
        if (::fstat(held_.file, &about) != 0) return Claim::failed;
        if (about.st_size == 0) return Claim::held;
        if (!part_) return ::ftruncate(held_.file, 0) == 0 ? Claim::held : Claim::failed;
        held_.kept = set_aside(held_.path, held_.target);
        return held_.kept.empty() ? Claim::failed : Claim::again;
    }

    void close() {
        if (held_.file >= 0) {
            ::close(held_.file);
        }
        held_.file = -1;
    }

    HeldFile failed(int error, std::string sentence = "") {
        close();
        held_.error = error;
        held_.problem = sentence.empty() ? std::strerror(error) : std::move(sentence);
        return held_;
    }

    bool part_;
    HeldFile held_;
};

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

HeldFile hold_part(const std::string& path) { return Holder(path, true).hold(); }
HeldFile hold_file(const std::string& path) { return Holder(path, false).hold(); }

}  // namespace hal::mcap
