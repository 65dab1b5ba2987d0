// SPDX-License-Identifier: MIT
#include "control/endpoint.hpp"

#include <array>
#include <cerrno>
#include <cstring>
#include <utility>

#include <fcntl.h>
#include <sys/file.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <unistd.h>

#include "base/own_descriptors.hpp"
#include "control/client_group.hpp"
#include "machine/processes/address.hpp"

namespace hal {
namespace {

std::string system_reason() { return std::strerror(errno); }

/// Locks a file that others may have locked for a moment, to see whether an instance runs.
bool lock_unless_held(int file) {
    constexpr int attempts = 100;
    constexpr int apart_us = 1000;
    for (int i = 0; i < attempts; ++i) {
        if (flock(file, LOCK_EX | LOCK_NB) == 0) return true;
        usleep(apart_us);
    }
    return false;
}

std::string content_of(int file) {
    std::array<char, 32> text{};
    const ssize_t got = pread(file, text.data(), text.size() - 1, 0);
    std::string content(text.data(), static_cast<std::size_t>(got > 0 ? got : 0));
    return content.substr(0, content.find('\n'));
}

}  // namespace

bool Endpoint::open(std::string_view name, const std::string& group, Diagnostics& diagnostics) {
    if (!good_instance_name(name)) {
        diagnostics.error("no-socket", {},
                          "'" + std::string(name) + "' is not a valid instance name", "",
                          "use up to 64 letters, digits, -, _ and ., without a leading dot");
        return false;
    }
    if (!group.empty()) {
        group_ = group_number(group);
    }
    if (!group.empty() && !group_) {
        diagnostics.error("no-socket", {}, "unknown group '" + group + "'", "",
                          "create it: sudo groupadd --system " + group);
        return false;
    }
    path_ = socket_path(name);
    if (path_.size() >= sizeof(sockaddr_un::sun_path)) {
        diagnostics.error("no-socket", {}, "the path of the control socket is too long: " + path_,
                          "", "set XDG_RUNTIME_DIR to a shorter path");
        return false;
    }
    if (prepare_folder(socket_folder(), diagnostics)) {
        running_instances();  // removes what killed instances left behind
        if (take_lock(name, diagnostics) && listen_at(diagnostics)) return true;
    }
    close_all();
    return false;
}

/// Makes the folder if needed. It must be ours, and nobody else may write to it: a socket in it
/// gives full control of a machine.
bool Endpoint::prepare_folder(const std::string& folder, Diagnostics& diagnostics) {
    if (mkdir(folder.c_str(), 0700) != 0 && errno != EEXIST) {
        diagnostics.error("no-socket", {},
                          "the folder of the control sockets '" + folder +
                              "' cannot be created: " + system_reason(),
                          "", "set XDG_RUNTIME_DIR to a folder of your own");
        return false;
    }
    struct stat about{};
    const bool is_ours =
        lstat(folder.c_str(), &about) == 0 && S_ISDIR(about.st_mode) && about.st_uid == geteuid();
    if (is_ours && group_) {
        if (chown(folder.c_str(), uid_t(-1), *group_) == 0 && chmod(folder.c_str(), 0750) == 0) {
            return true;
        }
        diagnostics.error("no-socket", {},
                          "the folder of the control sockets '" + folder +
                              "' cannot be given to the group: " + system_reason(),
                          "", "only a member of the group can share an instance with it");
        return false;
    }
    // the group may enter it where another instance of this user is shared
    const bool is_closed = (about.st_mode & 0027) == 0;
    if (is_ours && (is_closed || chmod(folder.c_str(), 0700) == 0)) return true;
    diagnostics.error("no-socket", {},
                      "the folder of the control sockets '" + folder +
                          "' belongs to another user or is accessible to others",
                      "", "remove it, or set XDG_RUNTIME_DIR to a folder of your own");
    return false;
}

/// Locks the name of the instance: a file that is locked as long as this process lives, with its
/// process number in it. Returns false after reporting why that is not possible.
bool Endpoint::take_lock(std::string_view name, Diagnostics& diagnostics) {
    const std::string file = lock_path(name);
    while (true) {
        lock_ = ::open(file.c_str(), O_RDWR | O_CREAT | O_CLOEXEC | O_NOFOLLOW, 0600);
        if (lock_ < 0) {
            diagnostics.error("no-socket", {},
                              "'" + file + "' cannot be opened: " + system_reason());
            return false;
        }
        if (!lock_unless_held(lock_)) {
            const std::string pid = content_of(lock_);
            diagnostics.error(
                "instance-running", {},
                "an instance named '" + std::string(name) + "' is already running" +
                    (pid.empty() ? "" : " (process " + pid + ")"),
                "",
                "choose another name with --name" +
                    (pid.empty() ? "" : ", or end the running instance: kill " + pid));
            close(lock_);
            lock_ = -1;
            return false;
        }
        // An instance that ended between our open and our lock has removed the file: then we hold
        // the lock of a deleted file.
        struct stat locked{}, there{};
        if (fstat(lock_, &locked) == 0 && stat(file.c_str(), &there) == 0 &&
            locked.st_ino == there.st_ino) {
            break;
        }
        close(lock_);
    }
    lock_file_ = file;
    if (!give_to_group(lock_, 0640)) {
        diagnostics.error("no-socket", {}, "'" + file + "' cannot be shared: " + system_reason());
        return false;
    }
    list_descriptor(lock_, "the lock of the instance name");
    const std::string pid = lock_content(getpid());
    if (ftruncate(lock_, 0) != 0 || pwrite(lock_, pid.data(), pid.size(), 0) < 0) {
        diagnostics.error("no-socket", {}, "'" + file + "' cannot be written: " + system_reason());
        return false;
    }
    return true;
}

bool Endpoint::give_to_group(int file, mode_t mode) const {
    if (!group_) return true;
    return fchown(file, uid_t(-1), *group_) == 0 && fchmod(file, mode) == 0;
}

bool Endpoint::share_socket() const {
    if (!group_) return true;
    return chown(path_.c_str(), uid_t(-1), *group_) == 0 && chmod(path_.c_str(), 0660) == 0;
}

bool Endpoint::listen_at(Diagnostics& diagnostics) {
    socket_ = socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
    sockaddr_un address{};
    address.sun_family = AF_UNIX;
    path_.copy(address.sun_path, sizeof address.sun_path - 1);
    unlink(path_.c_str());  // we hold the lock: what is there was left over by a dead process
    // The mode a socket has when it is bound becomes the file's: there is no moment at which it is
    // open to others.
    if (socket_ >= 0 && fchmod(socket_, 0600) == 0 &&
        bind(socket_, reinterpret_cast<const sockaddr*>(&address), sizeof address) == 0 &&
        share_socket() && listen(socket_, 64) == 0) {
        list_descriptor(socket_, "the control socket");
        return true;
    }
    diagnostics.error("no-socket", {},
                      "the control socket '" + path_ + "' cannot be opened: " + system_reason());
    return false;
}

void Endpoint::stop_listening() {
    if (socket_ < 0) return;
    // a program that watches the file sees that this instance ends in order
    [[maybe_unused]] const int emptied = ftruncate(lock_, 0);
    unlink(path_.c_str());
    close_own(std::exchange(socket_, -1));
}

void Endpoint::close_all() {
    stop_listening();
    if (lock_ >= 0) {
        if (!lock_file_.empty()) {
            unlink(lock_file_.c_str());
        }
        close_own(lock_);
    }
    lock_ = -1;
    lock_file_.clear();
}

}  // namespace hal
