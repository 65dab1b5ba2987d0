// SPDX-License-Identifier: MIT
#include "machine/processes/stream_users.hpp"

#include <algorithm>
#include <cerrno>
#include <csignal>

namespace hal {
namespace {

/// The end of its connection may still be on its way.
bool has_ended(pid_t process) { return process > 0 && ::kill(process, 0) != 0 && errno == ESRCH; }

std::string rejection(std::string_view stream, StreamUsers::End end, pid_t process) {
    const bool feeds = end == StreamUsers::End::feeds;
    const std::string by = process > 0 ? "process " + std::to_string(process) : "another process";
    const std::string who = process > 0 ? "that process" : "it";
    return "stream '" + std::string(stream) + "' is " + (feeds ? "fed" : "read") + " by " + by +
           " already; " +
           (feeds ? "records of two would be mixed"
                  : "two readers would take each other's records") +
           "; end " + who + " first";
}

}  // namespace

std::string StreamUsers::claim(std::string_view stream, End end, std::uint64_t owner,
                               pid_t process) {
    const auto user = std::ranges::find_if(
        users_, [&](const User& u) { return u.stream == stream && u.end == end; });
    if (user == users_.end()) {
        users_.push_back({std::string(stream), end, {owner}, process});
        return "";
    }
    if (std::ranges::find(user->owners, owner) != user->owners.end()) return "";
    if (process > 0 && user->process == process) {
        user->owners.push_back(owner);
        return "";
    }
    if (!has_ended(user->process)) return rejection(stream, end, user->process);
    user->owners = {owner};
    user->process = process;
    return "";
}

void StreamUsers::release(std::uint64_t owner) {
    for (User& user : users_) {
        std::erase(user.owners, owner);
    }
    std::erase_if(users_, [](const User& user) { return user.owners.empty(); });
}

}  // namespace hal
