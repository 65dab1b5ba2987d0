// SPDX-License-Identifier: MIT
#include "fieldbus/guardian/guardian_process.hpp"

#include <new>

namespace hal::guardian {

std::string GuardianProcess::start() {
    if (std::string problem = child_.map(sizeof(GuardianMemory), ""); !problem.empty()) {
        return problem;
    }
    memory_ = new (child_.memory()) GuardianMemory;
    return start_process();
}

std::string GuardianProcess::replace() {
    child_.kill();
    return start_process();
}

std::string GuardianProcess::start_process() {
    return child_.start({arguments_.program, arguments_.name, arguments_.link, arguments_.frames,
                         arguments_.confirmations, std::to_string(arguments_.schedule.rounds),
                         std::to_string(arguments_.schedule.every_ns), arguments_.report},
                        memory_->start, arguments_.lock);
}

bool GuardianProcess::end(std::int64_t limit_ns) noexcept {
    if (!child_.is_running()) return false;
    resume();
    memory_->requests.end();
    if (has_ended_within(limit_ns)) return memory_->record.status().phase == Phase::ended;
    child_.kill();
    return false;
}

}  // namespace hal::guardian
