// SPDX-License-Identifier: MIT
#include "bus/can/periodic.hpp"

#include <fmt/core.h>
#include <unistd.h>

#include "cli/output.hpp"
#include "text/quoting.hpp"

namespace hal::tools {

Repeated repeat(Bus& bus, const PeriodicOptions& options, std::int64_t interval_ns,
                const std::function<void(std::uint64_t)>& send) {
    std::uint64_t rounds = 0;
    const std::int64_t began = monotonic_ns();
    for (std::int64_t due = began;;) {
        send(rounds);
        bus.link->flush(can::unclocked);
        ++rounds;
        due += interval_ns;
        const bool is_over = options.for_ns >= 0 && due - began >= options.for_ns;
        if (rounds == options.count || is_over) break;
        const std::int64_t left = due - monotonic_ns();
        if (left > 0 ? bus.stop.wait_ns(left) : bus.stop.requested()) break;
    }
    return {rounds, static_cast<double>(monotonic_ns() - began) / 1e9};
}

int finish_rounds(Bus& bus, const Options& options, std::uint64_t frames, const Repeated& rounds) {
    const int status = finish_sending(bus, options, frames);
    if (status == 0) {
        write_all(STDERR_FILENO,
                  fmt::format("{} in {:.2f} s\n", counted(frames, "frame"), rounds.seconds));
    }
    return status;
}

int send_periodically(Bus& bus, const PeriodicOptions& options, std::int64_t interval_ns,
                      const std::function<can::Frame(std::uint64_t)>& next) {
    const Repeated sent = repeat(bus, options, interval_ns,
                                 [&](std::uint64_t n) { send_with_timeout(bus, next(n)); });
    return finish_rounds(bus, options, sent.rounds, sent);
}

}  // namespace hal::tools
