// SPDX-License-Identifier: MIT
// The state of the instance as lines: what `hal top` shows, of this machine and over the network.
#include <algorithm>
#include <cstring>

#include <unistd.h>

#include "machine/session.hpp"
#include "machine/state.hpp"

namespace hal {

std::string Session::status_text() const {
    char host[256] = "";
    ::gethostname(host, sizeof host - 1);
    std::string text = "instance " + options().name + "\nhost " + host + "\npid " + std::to_string(::getpid()) + "\nrunning " +
                       (running() ? "1" : "0") + "\n";
    for (const ThreadReport& thread : thread_reports())
        text += "thread " + thread.name + " " + std::to_string(thread.period_ns) + " " + std::to_string(thread.cycles) + " " +
                std::to_string(thread.missed) + " " + (thread.faulted ? "1" : "0") + "\n";
    text += "faults " + std::to_string(fault_count()) + "\n";
    state_->collect_faults();
    if (!state_->fault_log.empty()) text += "fault " + state_->fault_log.back().record.line() + "\n";
    return text;
}

std::size_t status_for_plugins(const hal_status* self, char* to, std::size_t room) {
    Session& session = *static_cast<Session*>(self->data);
    const std::unique_lock lock(session.mutex, std::try_to_lock);
    if (!lock) return 0;
    try {
        const std::string text = session.status_text();
        const std::size_t length = std::min(room, text.size());
        std::memcpy(to, text.data(), length);
        return length;
    } catch (const std::bad_alloc&) { return 0; }
}

}  // namespace hal
