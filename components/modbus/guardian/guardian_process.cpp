// SPDX-License-Identifier: MIT
#include "guardian_process.hpp"

namespace hal::modbus {

std::string GuardianProcess::start(const GuardianArguments& arguments, const std::string& text,
                                   const Bus& bus, const Plan& plan) {
    end_limit_ns_ = stop_limit_ns(plan, bus);
    if (std::string problem = child_.map(Image::size_of(bus, plan), text); !problem.empty()) {
        return problem;
    }
    image_ = Image(child_.memory(), bus, plan, true);
    return child_.start(
        {arguments.program, arguments.name, arguments.file, arguments.link, arguments.report},
        image_.header().start, arguments.lock);
}

bool GuardianProcess::end() noexcept {
    if (!child_.is_running()) return true;
    resume();
    image_.header().requests.end();
    if (has_ended_within(end_limit_ns_)) return true;
    child_.kill();
    return false;
}

}  // namespace hal::modbus
