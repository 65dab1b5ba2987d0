// SPDX-License-Identifier: MIT
#include "bus/canopen/drive_session.hpp"

#include <fmt/core.h>
#include <unistd.h>

#include "cli/output.hpp"

namespace hal::tools {

DriveSession::DriveSession(const Options& options, NodeClient& station, Supervision& supervision,
                           const Settings& settings)
    : options_(options), station_(station), supervision_(supervision), settings_(settings) {}

bool DriveSession::print_line(const std::string& text) const { return print(text + "\n"); }

bool DriveSession::wrong(const std::string& sentence) const {
    fail(options_, sentence);
    return false;
}

bool DriveSession::without_effect(const std::string& command) const {
    return wrong(
        fmt::format("{0}: a factor is valid for the commands after it, and there are none; type "
                    "them as lines of a session: "
                    "printf '{0}\\nGA:100\\n' | hal can drive {1} --node {2}",
                    command, options_.words.front(), settings_.node));
}

void DriveSession::idle() {
    station_.turn(0);
    // no command is running that it could interrupt
    if (pressed_.load() || supervision_.collided()) {
        station_.bus.stop.request();
    }
}

SdoAxis::Interruption DriveSession::interruption() const {
    using enum SdoAxis::Interruption;
    if (station_.bus.stop.requested() || supervision_.collided()) return end;
    if (pressed_.load()) return stop;
    return none;
}

SdoAxis& DriveSession::axis(unsigned number) {
    auto& made = axes_[number];
    if (!made) {
        made = std::make_unique<SdoAxis>(options_, station_, settings_.node, number);
    }
    made->interrupted = [this] { return interruption(); };
    return *made;
}

bool DriveSession::watched(SdoAxis& a) { return a.look() && supervision_.arm(a.number()); }

bool DriveSession::collided() const {
    if (!supervision_.collided()) return false;
    wrong(
        fmt::format("another device sends heartbeats as node {}, so the drive would not notice "
                    "the end of this program; start again with another --heartbeat-id",
                    supervision_.own_node()));
    return true;
}

void DriveSession::report_moving(SdoAxis& a) const {
    if (!supervision_.active() || !a.moves()) return;
    write_all(STDERR_FILENO,
              fmt::format("{0}: {1}: still moving, no longer supervised; to stop it: "
                          "hal can drive {2} --node {3} {1} stop\n",
                          options_.program, a.letter(), options_.words.front(), settings_.node));
}

bool DriveSession::stop_axis(SdoAxis& a, const char* why, bool expected) {
    std::string what;
    const bool stopped = a.secure(what);
    if (what.empty()) return stopped;
    if (stopped && expected) {
        print(fmt::format("{}: {} ({})\n", a.letter(), what, why));
        return true;
    }
    if (!stopped && supervision_.active()) {
        what += "; the drive stops when it misses our heartbeat";
    }
    fail(options_, fmt::format("{}: {} ({})", a.letter(), what, why));
    return stopped;
}

int DriveSession::end(bool leave, const char* why, bool expected) {
    bool stopped = true;
    for (const auto& a : axes_) {
        if (!a || !a->touched()) continue;
        if (leave) {
            report_moving(*a);
        } else {
            stopped = stop_axis(*a, why, expected) && stopped;
        }
    }
    // An axis that could not be stopped stays supervised: the heartbeat ends with this program, and
    // the drive reacts.
    return exit_code(stopped && supervision_.release());
}

}  // namespace hal::tools
