// SPDX-License-Identifier: MIT
#include "machine/processes/program_entry.hpp"

#include <algorithm>
#include <csignal>
#include <cstring>
#include <ctime>

namespace hal {

std::string time_of_day(std::int64_t ago_ns) {
    const std::time_t now = std::time(nullptr) - static_cast<std::time_t>(ago_ns / 1'000'000'000);
    std::tm parts{};
    char text[16];
    if (!localtime_r(&now, &parts) || std::strftime(text, sizeof text, "%H:%M:%S", &parts) == 0) {
        return "?";
    }
    return text;
}

std::string exit_text(int status) {
    if (status <= 128) return "exit status " + std::to_string(status);
    const char* const name = sigabbrev_np(status - 128);
    return name ? std::string("SIG") + name : "signal " + std::to_string(status - 128);
}

bool ProgramEntry::comes_back() const {
    if (!dead()) return false;
    return restarts.due_ns != 0 || (running() && restarts.policy.when != Restart::no);
}

std::int64_t ProgramEntry::heartbeat_due_ns() const {
    if (!responds() || heartbeat.every_ns == 0) return 0;
    const std::int64_t timeout = timeout_ns >= 0 ? timeout_ns : usual_timeout_ns;
    return heartbeat.last_ns + heartbeat.every_ns + timeout;
}

std::int64_t ProgramEntry::declared_due_ns() const {
    const Dead* const dead = death();
    if (!dead || dead->declared || timeout_ns < 0) return 0;
    return dead->since_ns + timeout_ns;
}

std::int64_t ProgramEntry::next_due_ns() const {
    std::int64_t first = INT64_MAX;
    for (const std::int64_t due :
         {declared_due_ns(), heartbeat_due_ns(), restarts.due_ns, kill_ns}) {
        if (due != 0) {
            first = std::min(first, due);
        }
    }
    return first;
}

void ProgramEntry::unregister() {
    component = Unregistered{};
    owner = 0;
    pins.clear();
    heartbeat = {};
}

void ProgramEntry::die(std::int64_t now_ns, std::string report) {
    Dead dead;
    dead.since_ns = now_ns;
    if (const Dead* const before = death()) {
        dead.since_ns = before->since_ns;
        dead.declared = before->declared;
    }
    dead.report = std::move(report);
    unregister();
    reserved = false;
    component = std::move(dead);
}

std::string ProgramEntry::state() const {
    if (const Dead* const dead = death()) {
        const std::string text = "dead " + dead->report;
        if (restarts.due_ns != 0) return text + ", starts again";
        return dead->restarted && !ended() ? text + ", started again" : text;
    }
    std::string text = "initializing";
    if (responds()) {
        text = "ready";
    } else if (ready()) {
        text = "not responding " + heartbeat.missing;
    }
    return stopping ? text + ", stopping" : text;
}

}  // namespace hal
