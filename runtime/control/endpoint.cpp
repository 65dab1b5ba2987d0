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
#include "machine/processes/address.hpp"

namespace hal {
namespace {

std::string system_reason() { return std::strerror(errno); }

/// Makes the folder if needed. It must be ours and closed to others: the socket in it gives full
/// control of the machine.
bool private_folder(const std::string& folder, Diagnostics& diagnostics) {
    struct stat about{};
    if (mkdir(folder.c_str(), 0700) != 0 && errno != EEXIST) {
        diagnostics.error("no-socket", {},
                          "the folder of the control sockets '" + folder +
                              "' cannot be created: " + system_reason(),
                          "", "set XDG_RUNTIME_DIR to a folder of your own");
        return false;
    }
    if (lstat(folder.c_str(), &about) == 0 && S_ISDIR(about.st_mode) && about.st_uid == geteuid()) {
        if ((about.st_mode & 0077) == 0 || chmod(folder.c_str(), 0700) == 0) return true;
    }
    diagnostics.error("no-socket", {},
                      "the folder of the control sockets '" + folder +
                          "' belongs to another user or is accessible to others",
                      "", "remove it, or set XDG_RUNTIME_DIR to a folder of your own");
    return false;
}

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

bool Endpoint::open(std::string_view name, Diagnostics& diagnostics) {
    if (!good_instance_name(name)) {
        diagnostics.error("no-socket", {},
                          "'" + std::string(name) + "' is not a valid instance name", "",
                          "use up to 64 letters, digits, -, _ and ., without a leading dot");
        return false;
    }
    path_ = socket_path(name);
    if (path_.size() >= sizeof(sockaddr_un::sun_path)) {
        diagnostics.error("no-socket", {}, "the path of the control socket is too long: " + path_,
                          "", "set XDG_RUNTIME_DIR to a shorter path");
        return false;
    }
    if (private_folder(socket_folder(), diagnostics)) {
        running_instances();  // removes what killed instances left behind
        if (take_lock(name, diagnostics) && listen_at(diagnostics)) return true;
    }
    close_all();
    return false;
}

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
    list_descriptor(lock_, "the lock of the instance name");
    const std::string pid = lock_content(getpid());
    if (ftruncate(lock_, 0) != 0 || pwrite(lock_, pid.data(), pid.size(), 0) < 0) {
        diagnostics.error("no-socket", {}, "'" + file + "' cannot be written: " + system_reason());
        return false;
    }
    return true;
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
        listen(socket_, 64) == 0) {
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
