// SPDX-License-Identifier: MIT
#include "fieldbus/guardian/guardian_process.hpp"

#include <new>

namespace hal::guardian {

namespace {

constexpr std::int64_t start_limit_ns = 3'000'000'000;

}  // namespace

std::string GuardianProcess::start(const GuardianArguments& arguments) {
    if (std::string problem = child_.map(sizeof(GuardianMemory), ""); !problem.empty()) {
        return problem;
    }
    memory_ = new (child_.memory()) GuardianMemory;
    if (std::string problem =
            child_.spawn({arguments.program, arguments.name, arguments.link, arguments.frames,
                          arguments.confirmations, std::to_string(arguments.schedule.rounds),
                          std::to_string(arguments.schedule.every_ns), arguments.report});
        !problem.empty()) {
        return problem;
    }
    const auto phase = [this] {
        return Status::of(memory_->status.load(std::memory_order_acquire)).phase;
    };
    const std::int64_t limit = link::monotonic_ns() + start_limit_ns;
    while (phase() == Phase::starting) {
        const bool has_ended = has_ended_within(2'000'000);
        if (!has_ended && link::monotonic_ns() < limit) continue;
        if (phase() != Phase::starting) break;
        kill();
        return has_ended ? "the guardian has ended during its start"
                         : "the guardian did not start within 3 s";
    }
    if (phase() == Phase::ended) {
        kill();
        return memory_->problem.data();
    }
    return {};
}

bool GuardianProcess::end(std::int64_t limit_ns) noexcept {
    if (!child_.is_running()) return true;
    resume();
    memory_->stop(StopReason::unload);
    memory_->ending.store(1, std::memory_order_release);
    if (has_ended_within(limit_ns)) return true;
    kill();
    return false;
}

}  // namespace hal::guardian
