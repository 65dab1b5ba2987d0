// SPDX-License-Identifier: MIT
#include "bus/can/periodic.hpp"

#include <fmt/core.h>
#include <unistd.h>

#include "cli/output.hpp"
#include "text/quoting.hpp"

namespace hal::tools {

int send_periodically(Bus& bus, const PeriodicOptions& options, std::int64_t interval_ns,
                      const std::function<can::Frame(std::uint64_t)>& next) {
    std::uint64_t wanted = 0;
    const std::int64_t began = monotonic_ns();
    for (std::int64_t due = began;;) {
        send_with_timeout(bus, next(wanted));
        bus.link->flush(can::unclocked);
        ++wanted;
        due += interval_ns;
        if (wanted == options.count || (options.for_ns >= 0 && due - began >= options.for_ns)) {
            break;
        }
        const std::int64_t left = due - monotonic_ns();
        if (left > 0 ? bus.stop.wait_ns(left) : bus.stop.requested()) break;
    }
    const double seconds = static_cast<double>(monotonic_ns() - began) / 1e9;
    const int status = finish_sending(bus, options, wanted);
    if (status == 0) {
        write_all(STDERR_FILENO,
                  fmt::format("{} in {:.2f} s\n", counted(wanted, "frame"), seconds));
    }
    return status;
}

}  // namespace hal::tools
