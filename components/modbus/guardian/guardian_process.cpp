// SPDX-License-Identifier: MIT
#include "guardian_process.hpp"

namespace hal::modbus {

namespace {

constexpr std::int64_t arm_ns = 3'000'000'000;

}  // namespace

std::string GuardianProcess::start(const GuardianArguments& arguments, const std::string& text,
                                   const Bus& bus, const Plan& plan) {
    end_limit_ns_ = stop_limit_ns(plan, bus);
    if (std::string problem = child_.map(Image::size_of(bus, plan), text); !problem.empty()) {
        return problem;
    }
    image_ = Image(child_.memory(), bus, plan, true);
    if (std::string problem = child_.spawn(
            {arguments.program, arguments.name, arguments.file, arguments.link, arguments.report});
        !problem.empty()) {
        return problem;
    }
    const std::int64_t limit = link::monotonic_ns() + arm_ns;
    const ImageHeader& header = image_.header();
    while (header.phase.load(std::memory_order_acquire) ==
           static_cast<std::uint32_t>(Phase::starting)) {
        const bool ended = has_ended_within(2'000'000);
        if (!ended && link::monotonic_ns() < limit) continue;
        if (header.phase.load() != static_cast<std::uint32_t>(Phase::starting)) break;
        end();
        return ended ? "the guardian has ended during its start"
                     : "the guardian did not start within 3 s";
    }
    if (header.phase.load() == static_cast<std::uint32_t>(Phase::ended)) {
        std::string problem(header.problem.data());
        end();
        return problem;
    }
    return {};
}

bool GuardianProcess::end() noexcept {
    if (!child_.is_running()) return true;
    resume();
    image_.stop(StopReason::unload);
    image_.header().ending.store(1, std::memory_order_release);  // behind the stop: see Guardian
    if (has_ended_within(end_limit_ns_)) return true;
    child_.kill();
    return false;
}

}  // namespace hal::modbus
