// SPDX-License-Identifier: MIT
// The machines that a page can choose from: that of the command line, and all others that run for
// this user. One that has ended stays in the list.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "panel/machine_watch.hpp"

struct lws_vhost;

namespace hal::tools {

class MachineList {
public:
    /// `own`: the instance of the command line.
    MachineList(lws_vhost* host, std::string own) : host_(host), own_(std::move(own)) {}

    /// Receives the event for the pages when the list has changed.
    std::function<void(const std::string&)> on_change;
    /// The event with the whole list; empty before the first tick().
    const std::string& event() const { return event_; }
    /// Looks for machines once a second. Call it every 50 ms while a page is connected.
    void tick(std::int64_t now_ms);

private:
    void look(std::int64_t now_ms);
    void report();
    MachineWatch* find(const std::string& name) const;
    void forget_ended();

    static constexpr std::int64_t interval_ms = 1000;
    static constexpr std::size_t max_machines = 64;

    lws_vhost* host_;
    std::string own_;
    std::vector<std::unique_ptr<MachineWatch>> machines_;  ///< sorted by name
    std::string event_;
    std::int64_t looked_ms_ = -interval_ms;
};

}  // namespace hal::tools
