// SPDX-License-Identifier: MIT
// 1. The parent sends the number of a setting, then changes the setting.
// 2. The parent ends, or is killed: the child reads the end of the connection.
// 3. The child restores in reverse order, and ends with status 0 when all was restored.
// A parent that is killed between sending and changing has a setting restored that was not changed,
// which writes the value that it has.
#include "inspect/restore_observer.hpp"

#include <cerrno>
#include <csignal>
#include <cstdint>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>
#include <utility>

namespace hal::tools {

namespace {

/// Returns false when a write of it failed.
bool restored(const std::string& interface, const InterfaceSetting& setting) {
    bool good = true;
    for (const SettingWrite& write : setting.restore) {
        good = write.run(interface) == 0 && good;
    }
    return good;
}

}  // namespace

RestoreObserver::RestoreObserver(std::string interface,
                                 const std::vector<InterfaceSetting>& settings)
    : interface_(std::move(interface)), settings_(settings) {
    int pair[2];
    if (::socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, pair) != 0) return;
    child_ = ::fork();
    if (child_ == 0) {
        ::close(pair[0]);
        observe(pair[1]);
    }
    ::close(pair[1]);
    connection_ = pair[0];
}

RestoreObserver::~RestoreObserver() { restore(); }

bool RestoreObserver::add(std::size_t number) {
    const auto byte = static_cast<std::uint8_t>(number);
    if (::send(connection_, &byte, 1, MSG_NOSIGNAL) != 1) return false;
    changed_.push_back(number);
    return true;
}

std::vector<std::string> RestoreObserver::restore() {
    if (connection_ < 0) return {};
    ::close(std::exchange(connection_, -1));
    int status = -1;
    const pid_t child = std::exchange(child_, -1);
    if (child > 0) {
        while (::waitpid(child, &status, 0) < 0 && errno == EINTR) {
        }
    }
    return status == 0 ? std::vector<std::string>() : restore_here();
}

std::vector<std::string> RestoreObserver::restore_here() {
    std::vector<std::string> failed;
    for (auto number = changed_.rbegin(); number != changed_.rend(); ++number) {
        if (!restored(interface_, settings_[*number])) {
            failed.push_back(settings_[*number].finding.subject);
        }
    }
    return failed;
}

void RestoreObserver::observe(int connection) {
    ::setsid();  // a signal for the terminal's processes must not end it before it has restored
    for (const int number : {SIGINT, SIGTERM, SIGHUP, SIGQUIT, SIGPIPE}) {
        ::signal(number, SIG_IGN);
    }
    // A reader of the parent's output must not wait for this process.
    for (const int descriptor : {STDIN_FILENO, STDOUT_FILENO, STDERR_FILENO}) {
        ::close(descriptor);
    }
    std::uint8_t number = 0;
    for (ssize_t length = 0;
         (length = ::read(connection, &number, 1)) == 1 || (length < 0 && errno == EINTR);) {
        if (length == 1 && number < settings_.size()) changed_.push_back(number);
    }
    ::_exit(restore_here().empty() ? 0 : 1);
}

}  // namespace hal::tools
